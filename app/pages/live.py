"""A session that a station measures: where it is, its currents now, what happened; pause, skip, take again.

The page's parts are sent again when they have changed: ``ages`` about every second, the others with
the station's reports. Every button is a form, so that the page works without script; with htmx the
answer is nothing, or why it was refused, and the parts show what was asked.
"""

import asyncio
import json
from collections.abc import AsyncIterator, Iterator
from time import monotonic
from typing import Annotated, Any, Final, Literal

from fastapi import APIRouter, Depends, Request, Response
from fastapi.concurrency import run_in_threadpool
from fastapi.sse import EventSourceResponse, ServerSentEvent

from app.errors import AppError, Invalid, problem
from app.pages import live_view
from app.pages.base import Reader, TheLab, Writer, fragment, render, see
from app.pages.forms import Form, Sent, sentence
from app.pages.live_map import Numbers
from app.pages.live_view import Seen
from app.pages.tables import csv_answer, json_answer
from app.services import live, sessions
from app.services.lab import Lab, Person
from app.services.live_views import CommandKind

router = APIRouter()

_LOOK_EVERY_S: Final = 0.25
_AGES_EVERY_S: Final = 1.0
_PARTS: Final = ("ages", "state", "map", "warning", "controls", "stop", "log")
_KINDS: Final[tuple[CommandKind, ...]] = ("pause", "resume", "skip", "retake", "stop")
_READINGS: Final = ("at", "jx_ma", "jy_ma", "settled")


def found(session_id: int, person: Reader, lab: TheLab) -> Numbers:
    """How the session counts its positions; `NotFound` for a session that is not there."""
    with lab.read(person) as work:
        return Numbers(sessions.detail(work, session_id).positions)


Counted = Annotated[Numbers, Depends(found)]


def look(lab: Lab, person: Person, session_id: int, numbers: Numbers) -> Seen | None:
    """The session's run as it stands now, None when no station has reported."""
    with lab.read(person) as work:
        run = live.find(work, session_id)
        return live_view.seen(run, sessions.session(work, session_id), numbers) if run else None


@router.get("/sessions/{session_id}/live")
def page(request: Request, person: Reader, lab: TheLab, session_id: int, numbers: Counted) -> Response:
    """The run of the session's station, followed while it goes on."""
    return _page(request, lab, person, session_id, numbers)


def _page(
    request: Request, lab: Lab, person: Person, session_id: int, numbers: Numbers,
    refused: AppError | None = None,
) -> Response:  # fmt: skip
    with lab.read(person) as work:
        session = sessions.session(work, session_id)
    return render(
        request, "live/page.html", status=refused.status if refused else 200, session=session,
        seen=look(lab, person, session_id, numbers), view=live_view,
        refused=[sentence(item) for item in refused.problems] if refused else (),
    )  # fmt: skip


@router.get("/sessions/{session_id}/live.{form}")
def readings(person: Reader, lab: TheLab, session_id: int, form: Literal["csv", "json"]) -> Response:
    """The currents that the charts show, as a file."""
    with lab.read(person) as work:
        run = live.run(work, session_id)
    rows = [item._asdict() for item in run.readings]
    return json_answer(rows) if form == "json" else csv_answer(rows, _READINGS, f"session-{session_id}-live")


@router.post("/sessions/{session_id}/live/commands")
def command(
    request: Request, person: Writer, lab: TheLab, session_id: int, sent: Sent, numbers: Counted
) -> Response:
    """Ask the station for something."""
    form = Form.of(sent, "kind", "cell")
    try:
        kind, place = _asked(form)
        with lab.write(person) as work:
            live.command(work, session_id, kind, *place)
    except AppError as error:
        if error.status not in (409, 422):
            raise
        if request.headers.get("hx-request"):
            texts = [sentence(item) for item in error.problems]
            html = fragment("live/refused.html", refused=texts)
            return Response(html, status_code=error.status, media_type="text/html; charset=utf-8")
        return _page(request, lab, person, session_id, numbers, error)
    if request.headers.get("hx-request"):
        return Response("", media_type="text/html; charset=utf-8")
    return see(f"/sessions/{session_id}/live")


def _asked(form: Form) -> tuple[CommandKind, tuple[float | None, float | None]]:
    kind = next((item for item in _KINDS if item == form.value("kind")), None)
    theta, _, psi = form.value("cell").partition("/")
    try:
        place = (float(theta), float(psi)) if form.value("cell") else (None, None)
    except ValueError:
        kind = None
    if kind is None:
        raise Invalid(problem("unknown-command", "The page asked for something that a station does not know. "
                              "Load it again and choose once more."))  # fmt: skip
    return kind, place


@router.get("/sessions/{session_id}/live/events", response_class=EventSourceResponse)
async def events(
    person: Reader, lab: TheLab, session_id: int, numbers: Counted, ended: bool | None = None
) -> AsyncIterator[ServerSentEvent]:
    """The page's parts as they change.

    `ended` says of which kind of run the page was made: the part to stop it is sent only when that has
    changed, so that what somebody reads there does not close. ``said`` is how the run stands in words,
    for a screen reader, when that changes; ``chart-x`` and ``chart-y`` are what is new for the charts;
    ``end``: nothing more comes.
    """
    shown: dict[str, str] = {}
    mark, shown_at = "", 0.0
    while not lab.stopping:
        newest = await run_in_threadpool(_mark, lab, person, session_id)
        if newest != mark or monotonic() - shown_at >= _AGES_EVERY_S:
            mark, shown_at = newest, monotonic()
            seen = await run_in_threadpool(look, lab, person, session_id, numbers)
            if seen and not shown and ended == seen.run.ended:
                shown["stop"] = dict(_parts(seen, person))["stop"]
            for name, data in _parts(seen, person) if seen else ():
                if shown.get(name) != data:
                    shown[name] = data
                    yield ServerSentEvent(raw_data=data, event=name)
            if seen and seen.run.phase == "finished":
                yield ServerSentEvent(raw_data="", event="end")
                break
        await asyncio.sleep(_LOOK_EVERY_S)


def _parts(seen: Seen, person: Person) -> Iterator[tuple[str, str]]:
    context: dict[str, Any] = {"seen": seen, "run": seen.run, "session": seen.session, "person": person}
    for name in _PARTS:
        yield name, fragment(f"live/{name}.html", view=live_view, **context)
    yield "said", seen.mark.word
    for axis in "xy":
        yield f"chart-{axis}", json.dumps(seen.news(axis))


def _mark(lab: Lab, person: Person, session_id: int) -> str:
    with lab.read(person) as work:
        return live.state_mark(work, session_id)
