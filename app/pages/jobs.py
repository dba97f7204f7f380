"""A job: live progress, its end, why it failed and what to do then."""

import asyncio
from collections.abc import AsyncIterator
from datetime import UTC, datetime
from time import monotonic
from typing import Annotated, Final

from fastapi import APIRouter, Depends, Request, Response
from fastapi.concurrency import run_in_threadpool
from fastapi.sse import EventSourceResponse, ServerSentEvent

from app.pages.base import Reader, TheLab, Writer, fragment, render, see
from app.pages.labels import job_mark
from app.services import jobs, sessions
from app.services.lab import Lab, Person
from app.services.views import JobView, SessionView

router = APIRouter()

_LOOK_EVERY_S: Final = 0.25
_AGES_EVERY_S: Final = 1.0

Seen = tuple[JobView, SessionView | None]


def seen(job_id: str, person: Reader, lab: TheLab) -> Seen:
    """The job as it stands now and the session it belongs to."""
    return _look(lab, person, job_id)


Found = Annotated[Seen, Depends(seen)]


def _look(lab: Lab, person: Person, job_id: str) -> Seen:
    with lab.read(person) as work:
        job = jobs.job(work, job_id)
        return job, sessions.session(work, job.session) if job.session is not None else None


@router.get("/jobs/{job_id}")
def detail(request: Request, found: Found) -> Response:
    """The job; while it goes on the page follows it."""
    job, session = found
    return render(request, "jobs/detail.html", job=job, session=session, now=datetime.now(UTC))


@router.get("/jobs/{job_id}/events", response_class=EventSourceResponse)
async def events(person: Reader, lab: TheLab, found: Found) -> AsyncIterator[ServerSentEvent]:
    """The job's state as a part of the page, whenever it changes and every second while it runs.

    ``said`` is its state in words, for a screen reader, when that changes; ``end``: nothing more comes.
    """
    job, session = found
    shown: JobView | None = None
    shown_at = 0.0
    while not lab.stopping:
        if shown is None or job.state != shown.state:
            yield ServerSentEvent(raw_data=job_mark(job).word, event="said")
        grown = job.state == "running" and monotonic() - shown_at >= _AGES_EVERY_S
        if job != shown or grown:
            html = fragment("jobs/state.html", job=job, session=session, now=datetime.now(UTC), person=person)
            yield ServerSentEvent(raw_data=html, event="state")
            shown, shown_at = job, monotonic()
        if job.ended:
            yield ServerSentEvent(raw_data="", event="end")
            break
        await asyncio.sleep(_LOOK_EVERY_S)
        job, session = await run_in_threadpool(_look, lab, person, job.id)


@router.post("/jobs/{job_id}/cancel")
def cancel(person: Writer, lab: TheLab, job_id: str) -> Response:
    """Stop the job; one that has ended stays as it is."""
    with lab.write(person) as work:
        jobs.cancel(work, job_id)
    return see(f"/jobs/{job_id}")
