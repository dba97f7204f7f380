"""The job engine's book: what each job computes, and what becomes of the answer.

Every call is one short transaction; nothing is open while a child process computes.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

from app.errors import AppError, Problem
from app.jobs.ledger import Task
from app.jobs.problems import given_up
from app.services import calibrations, ingest, simulations, validation
from app.services.access import SYSTEM
from app.services.drift import following, studying
from app.services.job_views import stored_problem
from app.services.lab import Lab, Person, Work
from app.store import results
from app.store.tables import Job

MAX_ATTEMPTS: Final = 100
"""How often a job is begun at the most. Interruptions of the whole service count, and somebody who
restarts it thirty times must lose nothing; a job whose own child process keeps dying is ended much
sooner, by the engine (`app.jobs.ledger.MAX_CRASHES`)."""


@dataclass(frozen=True, slots=True)
class _Kind:
    """What is computed where; `prepare` and `store` get the session's number, None for a kind without one."""

    function: str
    prepare: Callable[[Work, Any, Mapping[str, Any]], dict[str, Any]]
    store: Callable[[Work, Any, Mapping[str, Any], Mapping[str, Any]], int | None]
    of_session: bool = True


_KINDS: Final = {
    "calibrate": _Kind("app.services.computing:calibrate", calibrations.prepare, calibrations.store),
    "import": _Kind("app.services.computing:import_records", ingest.prepare_import, ingest.store_import),
    "simulate": _Kind("app.services.computing:simulate", simulations.prepare, simulations.store),
    validation.KIND: _Kind(
        "app.services.validating:validate", validation.prepare, validation.store, of_session=False
    ),
    following.KIND: _Kind(
        "app.services.computing:follow", studying.prepare, studying.store, of_session=False
    ),
}


class JobLedger:
    """Implements `app.jobs.Ledger` over the job table."""

    def __init__(self, lab: Lab) -> None:
        self._lab = lab

    def begin(self, job_id: str) -> Task | None:
        """Mark a job running and say what to compute; None when there is nothing to do any more."""
        with self._lab.write(SYSTEM) as work:
            row = _open_job(work, job_id)
            if row is None:
                return None
            row.attempts += 1
            if row.attempts > MAX_ATTEMPTS:
                _end(work, row, "failed", [given_up(MAX_ATTEMPTS)])
                return None
            row.state, row.started_at = "running", work.now
            return Task(_KINDS[row.kind].function, _KINDS[row.kind].prepare(work, _session(row), row.request))

    def progress(self, job_id: str, fraction: float, phase: str) -> None:
        """Note how far a job is."""
        with self._lab.write(SYSTEM) as work:
            row = _open_job(work, job_id)
            if row is not None:
                row.progress, row.phase = fraction, phase

    def succeed(self, job_id: str, output: Mapping[str, Any]) -> None:
        """Keep a job's answer; a job that has ended meanwhile keeps its end.

        An answer that cannot be kept, positions that are not certified, say, fails the job.
        """
        try:
            self._keep(job_id, output)
        except AppError as error:
            self.fail(job_id, error.problems)

    def _keep(self, job_id: str, output: Mapping[str, Any]) -> None:
        with self._lab.write(SYSTEM) as work:
            row = _open_job(work, job_id)
            if row is None:
                return
            work.person = Person(row.created_by, row.created_by, "", frozenset())
            row.calibration_id = _KINDS[row.kind].store(work, _session(row), row.request, output)
            row.progress = 1.0
            _end(work, row, "succeeded", None)

    def fail(self, job_id: str, problems: Sequence[Problem]) -> None:
        """Note why a job failed."""
        with self._lab.write(SYSTEM) as work:
            row = _open_job(work, job_id)
            if row is not None:
                _end(work, row, "failed", problems)


def _open_job(work: Work, job_id: str) -> Job | None:
    row = results.job(work.db, job_id)
    return row if row is not None and row.state in results.ACTIVE else None


def _session(row: Job) -> int | None:
    if row.session_id is None and _KINDS[row.kind].of_session:
        raise ValueError(f"job {row.id} belongs to no session")
    return row.session_id


def _end(work: Work, row: Job, state: str, problems: Sequence[Problem] | None) -> None:
    row.state, row.finished_at, row.phase = state, work.now, ""
    row.problems = None if problems is None else [stored_problem(item) for item in problems]
