"""The job that makes a subject's studies: data out of the database, studies and alarms back into it.

`prepare` and `store` run in the service, each in one short transaction; `studied` runs in a child process and
knows no database. A study of a stand has the same three steps in `app.services.drift.stand_study`.
"""

from collections.abc import Callable, Mapping
from typing import Any, Final, Protocol

from app.services.drift import alarms, following, gyro_study, stand_study
from app.services.drift.alarms import Finding
from app.services.lab import Work
from app.store import drift

Report = Callable[[float, str], None]


class _Steps(Protocol):
    """What a kind of subject brings: see `gyro_study`."""

    def prepare(self, work: Work, subject_id: int, /) -> dict[str, Any]:
        """What the studying process needs, plain."""

    def studied(self, payload: Mapping[str, Any], report: Report, /) -> dict[str, Any]:
        """By method: ``document``, ``series``, ``solver_version``, ``findings``, ``counting``."""


_STEPS: Final[Mapping[str, _Steps]] = {"gyro": gyro_study, "stand": stand_study}


def prepare(work: Work, _session_id: int | None, request: following.Subject) -> dict[str, Any]:
    """What the studying process needs: the subject's data, and the counts that they stand for."""
    ((kind, subject_id),) = request.items()
    seen = {row.method: row.changed for row in drift.studies(work.db, *following.ids(request))}
    return {"kind": kind, "seen": seen, **_STEPS[kind].prepare(work, subject_id)}


def studied(payload: Mapping[str, Any], report: Report) -> dict[str, Any]:
    """The studies of a subject, in the child process."""
    return {"seen": payload["seen"], "studies": _STEPS[payload["kind"]].studied(payload, report)}


def store(
    work: Work, _session_id: int | None, request: following.Subject, output: Mapping[str, Any]
) -> int | None:
    """Keep each method's study with its alarms, unless a later one is there already."""
    gyro_id, stand_id = following.ids(request)
    drift.locked(work.db, gyro_id, stand_id)
    for row in drift.studies(work.db, gyro_id, stand_id):
        seen, made = output["seen"].get(row.method, 0), output["studies"].get(row.method)
        if made is None or seen <= row.studied:
            continue
        row.studied, row.studied_at = seen, work.now
        row.document, row.series, row.solver_version = (
            made["document"],
            made["series"],
            made["solver_version"],
        )
        row.recalibrations = made.get("recalibrations")
        alarms.take_in(work, row, [Finding(**item) for item in made["findings"]], made["counting"])
    work.db.flush()
    if gyro_id is not None:
        following.studied_gyro(work, gyro_id, output["studies"])
    return None


class NoJobs:
    """A queue for who builds a laboratory without a job engine, and calls `follow_all_now` at the end."""

    def enqueue(self, session: object, job_id: str, *, priority: int = 100) -> None:
        """Leave the job to `follow_all_now`."""

    def cancel(self, job_id: str) -> None:
        """Nothing runs."""


def follow_all_now(work: Work) -> None:
    """Make every study that is behind, at once and in this process, and end the jobs that wait to."""
    rows = list(drift.behind(work.db))
    for key in sorted({row.gyro_id for row in rows if row.gyro_id is not None}):
        _now(work, {"gyro": key})
    rows += [row for row in drift.behind(work.db) if row.stand_id is not None]
    for key in sorted({row.stand_id for row in rows if row.stand_id is not None}):
        _now(work, {"stand": key})
    for job in drift.jobs(work.db, {row.job_id for row in rows if row.job_id is not None}):
        job.state, job.started_at, job.finished_at, job.progress = "succeeded", work.now, work.now, 1.0


def follow_now(work: Work, gyro_id: int) -> None:
    """Study a gyro at once and in this process: for who builds a laboratory without a job engine."""
    _now(work, {"gyro": gyro_id})


def follow_stand_now(work: Work, stand_id: int) -> None:
    """Study a stand at once and in this process."""
    _now(work, {"stand": stand_id})


def _now(work: Work, subject: following.Subject) -> None:
    store(work, None, subject, studied(prepare(work, None, subject), _quietly))


def _quietly(_fraction: float, _phase: str) -> None:
    """For whoever watches no progress."""
