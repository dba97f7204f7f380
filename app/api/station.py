"""The live state of a session at an automated stand: reports in, commands out."""

import asyncio
from collections.abc import AsyncIterator
from typing import Annotated, Final

from fastapi import APIRouter, Depends, Header, Query, Response
from fastapi.concurrency import run_in_threadpool
from fastapi.sse import EventSourceResponse, ServerSentEvent

from app.api.auth import Caller, Reader, Uploader
from app.api.schemas.common import Id
from app.api.schemas.station import NewCommand, ReportTaken, StationCommand, StationNow, StationReport
from app.services import live

router = APIRouter(tags=["station"])
POLL_S: Final = 0.25
_PLACE: Final = "/sessions/{session_id}/station"

Events = Annotated[int, Query(ge=0, le=1000, description="Most events to give.")]


@router.put(_PLACE, responses={404: {}, 409: {}})
def report(session_id: Id, body: StationReport, caller: Uploader) -> ReportTaken:
    """A stand's program tells how it stands, about once a second; the answer brings it what people ask.

    A report that is not newer than the run's last one changes nothing. The run that was heard of last is
    the session's present one; a report of a run before it gets 409.
    """
    with caller.write() as work:
        return ReportTaken.model_validate(live.report(work, session_id, body.report()))


@router.get(_PLACE, responses={404: {}})
def present(session_id: Id, caller: Reader, events: Events = live.MOST_EVENTS) -> StationNow:
    """The present run's newest report, its age, what was asked and what happened; 404 before the first."""
    with caller.read() as work:
        return StationNow.of(live.run(work, session_id, events))


@router.post(
    _PLACE + "/commands",
    status_code=201,
    responses={200: {"model": StationCommand, "description": "Asked before, not answered yet."}, 404: {}, 409: {}},
)  # fmt: skip
def command(session_id: Id, body: NewCommand, caller: Uploader, response: Response) -> StationCommand:
    """Ask the station for something; it answers with one of its next reports. 409 when the run has ended."""
    with caller.write() as work:
        asked, new = live.command(work, session_id, body.kind, body.theta_deg, body.psi_deg)
    response.status_code = 201 if new else 200
    return StationCommand.model_validate(asked)


def _watched(session_id: Id, caller: Reader) -> tuple[Caller, StationNow]:
    return caller, _now(caller, session_id)


@router.get(_PLACE + "/events", response_class=EventSourceResponse, responses={404: {}})
async def events(
    watched: Annotated[tuple[Caller, StationNow], Depends(_watched)],
    last_event_id: Annotated[str | None, Header(max_length=200)] = None,
) -> AsyncIterator[ServerSentEvent]:
    """A `station` event with the whole state whenever it has changed; `end` when the run has ended."""
    (caller, now), seen = watched, last_event_id
    while not caller.lab.stopping:
        mark = await run_in_threadpool(_mark, caller, now.session)
        if mark != seen:
            now = await run_in_threadpool(_now, caller, now.session)
            yield ServerSentEvent(data=now, event="station", id=mark)
        if now.ended:
            yield ServerSentEvent(data=now, event="end", id=mark)
            return
        seen = mark
        await asyncio.sleep(POLL_S)


def _now(caller: Caller, session_id: int) -> StationNow:
    with caller.read() as work:
        return StationNow.of(live.run(work, session_id))


def _mark(caller: Caller, session_id: int) -> str:
    with caller.read() as work:
        return live.state_mark(work, session_id)
