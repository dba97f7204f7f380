"""One job from its beginning to its end, and the jobs running at this moment."""

import threading
import time
from collections.abc import Callable
from typing import Final

import structlog

from app.jobs import problems
from app.jobs.ledger import MAX_CRASHES, Ledger
from app.jobs.process import Crashed, Done, Failed, Halted, compute

PROGRESS_EVERY_S: Final = 0.5
_ASK_EVERY_S: Final = 1.0
_log = structlog.get_logger(__name__)


class Abandoned(BaseException):
    """The job is left as it is, to be taken up again.

    Not an `Exception`: DBOS records those as the job's outcome and lets this one pass.
    """


class Run:
    """One job while a thread of the engine's works on it.

    Parameters
    ----------
    job_id
        The job.
    ledger
        Where its task comes from and its outcome goes to.
    cancelled_elsewhere
        Whether another process cancelled it; asked once a second.
    """

    def __init__(self, job_id: str, ledger: Ledger, cancelled_elsewhere: Callable[[str], bool]) -> None:
        self.job_id = job_id
        self._ledger = ledger
        self._cancelled_elsewhere = cancelled_elsewhere
        self._cancelled = threading.Event()
        self._abandoned = threading.Event()
        self._progress = _Progress(job_id, ledger)
        self._ask_at = time.monotonic() + _ASK_EVERY_S

    def cancel(self) -> None:
        """Kill the child; the ledger's row says cancelled already."""
        self._cancelled.set()

    def abandon(self) -> None:
        """Kill the child; the job is taken up again when the service is."""
        self._abandoned.set()

    def execute(self) -> None:
        """Work on the job until the ledger has its outcome.

        Raises
        ------
        Abandoned
            When it must be taken up again.
        """
        exit_code = 0
        for crashes in range(1, MAX_CRASHES + 1):
            if self._cancelled.is_set():
                return
            task = self._ledger.begin(self.job_id)
            if task is None:
                return
            outcome = compute(task, on_progress=self._progress.note, keep_going=self._keep_going)
            if self._abandoned.is_set() and not isinstance(outcome, Done | Failed):
                raise Abandoned
            if not isinstance(outcome, Crashed):
                self._record(outcome)
                return
            exit_code = outcome.exit_code
            _log.warning("job-crashed", job=self.job_id, exit_code=exit_code, times=crashes)
        self._ledger.fail(self.job_id, [problems.crashed(MAX_CRASHES, exit_code)])

    def _record(self, outcome: Done | Failed | Halted) -> None:
        """Tell the ledger; of a cancelled job it knows."""
        if isinstance(outcome, Done):
            self._ledger.succeed(self.job_id, outcome.output)
        elif isinstance(outcome, Failed):
            self._ledger.fail(self.job_id, outcome.problems)

    def _keep_going(self) -> bool:
        try:
            self._progress.flush()
            if self._cancelled_meanwhile():
                self._abandoned.set()  # DBOS's row says so already and stays as it is
        except Exception:
            # The database may be away for a moment; that is no reason to lose the computation.
            _log.exception("job-progress", job=self.job_id)
        return not (self._cancelled.is_set() or self._abandoned.is_set())

    def _cancelled_meanwhile(self) -> bool:
        if time.monotonic() < self._ask_at:
            return False
        self._ask_at = time.monotonic() + _ASK_EVERY_S
        return self._cancelled_elsewhere(self.job_id)


class _Progress:
    """Passes reports on to the ledger twice a second at most; the last one is never lost."""

    def __init__(self, job_id: str, ledger: Ledger) -> None:
        self._job_id = job_id
        self._ledger = ledger
        self._latest: tuple[float, str] | None = None
        self._next_at = 0.0

    def note(self, fraction: float, phase: str) -> None:
        self._latest = fraction, phase

    def flush(self) -> None:
        if self._latest is not None and time.monotonic() >= self._next_at:
            (fraction, phase), self._latest = self._latest, None
            self._next_at = time.monotonic() + PROGRESS_EVERY_S
            self._ledger.progress(self._job_id, fraction, phase)


class Runs:
    """The jobs running in this process."""

    def __init__(self) -> None:
        self._changed = threading.Condition()
        self._runs: dict[str, Run] = {}

    def enter(self, run: Run) -> bool:
        """Note that it runs; False if the same job runs already."""
        with self._changed:
            return self._runs.setdefault(run.job_id, run) is run

    def leave(self, run: Run) -> None:
        """Note that it runs no more."""
        with self._changed:
            del self._runs[run.job_id]
            self._changed.notify_all()

    def get(self, job_id: str) -> Run | None:
        """The job's run, if it runs here."""
        with self._changed:
            return self._runs.get(job_id)

    def abandon(self) -> None:
        """Stop them all."""
        with self._changed:
            for run in self._runs.values():
                run.abandon()

    def wait_until_none(self, timeout_s: float) -> bool:
        """Wait until nothing runs; whether that came true in time."""
        with self._changed:
            return self._changed.wait_for(lambda: not self._runs, timeout_s)
