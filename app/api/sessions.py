"""Sessions."""

from collections.abc import Mapping
from typing import Annotated, Any, Final

from fastapi import APIRouter, Header, Query, Request, Response

from app.api import links
from app.api.auth import Reader, Uploader
from app.api.pagination import CSV_TOO, Columns, Listing, Part, listed
from app.api.schemas.common import Id, Name, Since, Until
from app.api.schemas.measuring import NewSession, Session, SessionDetail
from app.exchange.si import PARAMETER_UNITS
from app.services import idempotency, sessions

router = APIRouter(tags=["sessions"])

Key = Annotated[
    str | None,
    Header(
        alias="Idempotency-Key",
        min_length=1,
        max_length=200,
        description="Any text of your own; a repeat with the same one makes nothing new.",
    ),
]
AGAIN: Final[dict[int | str, dict[str, Any]]] = {
    200: {"model": Session, "description": "Made before, with this Idempotency-Key."}
}

_COLUMNS: Final[Columns[Session]] = {
    "id": lambda item: item.id,
    "gyro": lambda item: item.gyro,
    "type": lambda item: item.type,
    "stand": lambda item: item.stand,
    "certificate": lambda item: item.certificate,
    "start": lambda item: item.start,
    "origin": lambda item: item.origin,
    "started_at": lambda item: item.started_at,
    "created_by": lambda item: item.created_by,
    "temperature_c": lambda item: item.temperature_c,
    "latitude_deg": lambda item: item.latitude_deg,
    "positions_measured": lambda item: item.positions_measured,
    "positions_total": lambda item: item.positions_total,
    "state": lambda item: item.state,
    "result": lambda item: item.result.id if item.result else None,
    "verdict": lambda item: item.result.verdict if item.result else None,
    "note": lambda item: item.note,
}


class SessionPart(Part):
    """Which sessions."""

    gyro: Name | None = None
    stand: Name | None = None
    since: Annotated[Since, Query(alias="from")] = None
    until: Annotated[Until, Query(alias="to")] = None


@router.post("/sessions", status_code=201, responses=AGAIN | {404: {}, 409: {}})
def add(body: NewSession, caller: Uploader, response: Response, key: Key = None) -> Session:
    """Open a session; with an Idempotency-Key a repeat answers 200 and the same session."""
    asked = idempotency.fingerprint("session", body.model_dump(mode="json", exclude_unset=True))
    with caller.write() as work:
        before = idempotency.made_before(work, key, asked)
        if before is None:
            made = sessions.open_session(work, sessions.NewSession(**body.model_dump(), origin="api"))
            idempotency.remember(work, key, asked, str(made.id))
        else:
            made, response.status_code = sessions.session(work, int(before)), 200
    response.headers["location"] = links.session(made.id)
    return Session.model_validate(made)


@router.get("/sessions", response_model=Listing[Session], responses=CSV_TOO)
def listing(part: Annotated[SessionPart, Query()], caller: Reader, request: Request) -> Response:
    """Sessions, the newest first."""
    with caller.read() as work:
        found = sessions.sessions(
            work, gyro=part.gyro, stand=part.stand, since=part.since, until=part.until,
            before=part.before(), limit=part.limit,
        )  # fmt: skip
    return listed(request, [Session.model_validate(item) for item in found.items], found.next, _COLUMNS)


@router.get("/sessions/{session_id}", responses={404: {}})
def detail(session_id: Id, caller: Reader) -> SessionDetail:
    """One session with its positions and results."""
    with caller.read() as work:
        found = sessions.detail(work, session_id)
    head = Session.model_validate(found.session)
    return SessionDetail.model_validate(
        dict(head) | {"positions": found.positions, "results": found.results, "truth": _truth(found.truth)}
    )


def _truth(values: Mapping[str, float] | None) -> dict[str, Any] | None:
    """A simulated gyro's true parameters in the shape of `truth.json`."""
    if values is None:
        return None
    units = {name: PARAMETER_UNITS[name][0] for name in values}
    return {"parameters": {name: {"value": value, "unit": units[name]} for name, value in values.items()}}
