"""Work in the background: how it stands, as a stream of events too, and stopping it."""

import asyncio
from collections.abc import AsyncIterator
from typing import Annotated, Final

from fastapi import APIRouter, Depends, Header, Path
from fastapi.concurrency import run_in_threadpool
from fastapi.sse import EventSourceResponse, ServerSentEvent

from app.api.auth import Caller, Reader, Uploader
from app.api.pagination import Listing
from app.api.schemas.jobs import Job
from app.services import jobs

router = APIRouter(tags=["jobs"])
POLL_S: Final = 0.2

JobId = Annotated[str, Path(max_length=100)]


@router.get("/jobs")
def listing(caller: Reader) -> Listing[Job]:
    """Jobs that wait or run, the oldest first, in one part."""
    with caller.read() as work:
        return Listing(items=[Job.model_validate(item) for item in jobs.active(work)], next=None)


@router.get("/jobs/{job_id}", responses={404: {}})
def detail(job_id: JobId, caller: Reader) -> Job:
    """How a job stands, and where its result is."""
    return _now(caller, job_id)


@router.post("/jobs/{job_id}/cancel", responses={404: {}})
def cancel(job_id: JobId, caller: Uploader) -> Job:
    """Stop a job; one that has ended stays as it is."""
    with caller.write() as work:
        return Job.model_validate(jobs.cancel(work, job_id))


def _watched(job_id: JobId, caller: Reader) -> tuple[Caller, Job]:
    return caller, _now(caller, job_id)


@router.get("/jobs/{job_id}/events", response_class=EventSourceResponse, responses={404: {}})
async def events(
    watched: Annotated[tuple[Caller, Job], Depends(_watched)],
    last_event_id: Annotated[str | None, Header(max_length=200)] = None,
) -> AsyncIterator[ServerSentEvent]:
    """A `job` event with the job itself whenever it has changed; `end` after the last one."""
    (caller, job), seen = watched, last_event_id
    while not caller.lab.stopping:
        mark = _mark(job)
        if mark != seen:
            yield ServerSentEvent(data=job, event="job", id=mark)
        if job.finished_at is not None:
            yield ServerSentEvent(data=job, event="end", id=mark)
            return
        seen = mark
        await asyncio.sleep(POLL_S)
        job = await run_in_threadpool(_now, caller, job.id)


def _now(caller: Caller, job_id: str) -> Job:
    with caller.read() as work:
        return Job.model_validate(jobs.job(work, job_id))


def _mark(job: Job) -> str:
    """What tells one state of a job from the next."""
    return f"{job.state}-{job.progress:.4f}-{job.phase}".replace(" ", "-")
