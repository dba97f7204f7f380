"""What the engine asks of whoever keeps the jobs."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final, Protocol

from app.errors import Problem

MAX_CRASHES: Final = 3
"""So often a child may die of itself (a crash, not our stopping it) before the job fails."""


@dataclass(frozen=True)
class Task:
    """What a child process is to compute.

    Attributes
    ----------
    function
        ``package.module:callable``, imported in the child and called as ``fn(payload, report)``,
        where ``report(fraction, phase)`` tells the progress. It returns a dict that can be pickled,
        raises `AppError` or `SolverError` for what it foresees, and starts no processes itself.
    payload
        Its input: small and pickleable; long records travel as references.
    timeout_s
        Longest time one attempt may take, s.
    """

    function: str
    payload: dict[str, Any]
    timeout_s: float = 3600


class Ledger(Protocol):
    """The jobs' own rows. Each call is one short transaction and may come from any thread.

    A call that raises leaves the job where it was; the engine logs it and looks at the job again a
    minute later.
    """

    def begin(self, job_id: str) -> Task | None:
        """Mark the job running and count the attempt; what is to be computed.

        None when there is nothing to do any more: it is cancelled, finished or unknown, or it was
        attempted too often, in which case the ledger has failed it with `problems.given_up`. An
        attempt is counted for a crashed child as well as for a restarted service, so the limit lies
        above `MAX_CRASHES`.
        """
        ...

    def progress(self, job_id: str, fraction: float, phase: str) -> None:
        """Note how far a running job is, at most twice a second; nothing if it is not running."""
        ...

    def succeed(self, job_id: str, output: dict[str, Any]) -> None:
        """Store the result and mark the job succeeded; nothing if it is finished or cancelled."""
        ...

    def fail(self, job_id: str, problems: Sequence[Problem]) -> None:
        """Mark the job failed for these reasons; nothing if it is finished or cancelled."""
        ...
