"""Background work as people see it: submitting, watching, cancelling."""

import uuid
from collections.abc import Mapping
from typing import Any, Final

from app.errors import NotFound, problem
from app.services.job_views import job_view
from app.services.lab import Work
from app.services.views import JobView
from app.store import results
from app.store.tables import Job

_PRIORITY: Final = {"calibrate": 10, "import": 30, "follow": 40, "simulate": 50, "validate": 70}
"""Lower runs first: a person waits for a calibration, and what comes in together is studied together."""


def submit(work: Work, kind: str, request: Mapping[str, Any], session_id: int | None) -> JobView:
    """Put a job in the queue in the same transaction as what it works on."""
    row = Job(
        id=str(uuid.uuid4()), kind=kind, state="queued", session_id=session_id, request=dict(request),
        progress=0.0, phase="", attempts=0, created_at=work.now, created_by=work.person.name,
    )  # fmt: skip
    work.db.add(row)
    work.db.flush()
    work.queue.enqueue(work.db, row.id, priority=_PRIORITY[kind])
    return job_view(row)


def job(work: Work, job_id: str) -> JobView:
    """One job as it stands now."""
    return job_view(_find(work, job_id))


def active(work: Work) -> tuple[JobView, ...]:
    """Jobs that wait or run, the oldest first."""
    return tuple(job_view(row) for row in results.active_jobs(work.db))


def counts(work: Work) -> Mapping[str, int]:
    """How many jobs there are in each state."""
    return results.job_counts(work.db)


def cancel(work: Work, job_id: str) -> JobView:
    """Cancel a job that has not ended; one that has ended stays as it is."""
    row = _find(work, job_id)
    if row.state in results.ACTIVE:
        row.state, row.finished_at = "cancelled", work.now
        work.db.flush()
        work.afterwards.append(lambda: work.queue.cancel(job_id))
    return job_view(row)


def _find(work: Work, job_id: str) -> Job:
    row = results.job(work.db, job_id)
    if row is None:
        raise NotFound(problem("unknown-job", "There is no job %(id)s.", id=job_id))
    return row
