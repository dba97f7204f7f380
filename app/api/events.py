"""What happened to gyros and stands."""

from typing import Annotated, Final

from fastapi import APIRouter, Query, Request, Response

from app.api.auth import Reader, Uploader
from app.api.pagination import TABLE_TOO, Columns, Listing, listed
from app.api.schemas.common import Id, Name
from app.api.schemas.drift import Event, NewEvent
from app.services.drift import events, reading

router = APIRouter(tags=["drift"])

_COLUMNS: Final[Columns[Event]] = {
    "id": lambda item: item.id,
    "kind": lambda item: item.kind,
    "at": lambda item: item.at,
    "gyro": lambda item: item.gyro,
    "stand": lambda item: item.stand,
    "note": lambda item: item.note,
    "session": lambda item: item.session,
    "created_at": lambda item: item.created_at,
    "created_by": lambda item: item.created_by,
    "withdrawn_at": lambda item: item.withdrawn_at,
    "withdrawn_by": lambda item: item.withdrawn_by,
}
Withdrawn = Annotated[bool, Query(description="Those withdrawn as well.")]


@router.get("/gyros/{serial}/events", response_model=Listing[Event], responses=TABLE_TOO | {404: {}})
def of_gyro(serial: Name, caller: Reader, request: Request, withdrawn: Withdrawn = False) -> Response:
    """What happened to a gyro and to its stands, and what its sessions tell: certificates, stands, solver."""
    with caller.read() as work:
        found = reading.all_events(work, serial, withdrawn=withdrawn)
    return listed(request, [Event.model_validate(item) for item in found], None, _COLUMNS)


@router.post("/gyros/{serial}/events", status_code=201, responses={404: {}})
def add_to_gyro(serial: Name, body: NewEvent, caller: Uploader) -> Event:
    """Enter what happened to a gyro; its drift is studied anew."""
    with caller.write() as work:
        return Event.model_validate(events.add(work, body.kind, body.happened_at, body.note, gyro=serial))


@router.get("/stands/{name}/events", response_model=Listing[Event], responses=TABLE_TOO | {404: {}})
def of_stand(name: Name, caller: Reader, request: Request, withdrawn: Withdrawn = False) -> Response:
    """What happened to a stand."""
    with caller.read() as work:
        found = events.of_stand(work, name, withdrawn=withdrawn)
    return listed(request, [Event.model_validate(item) for item in found], None, _COLUMNS)


@router.post("/stands/{name}/events", status_code=201, responses={404: {}})
def add_to_stand(name: Name, body: NewEvent, caller: Uploader) -> Event:
    """Enter what happened to a stand; the drift of the gyros measured there is studied anew."""
    with caller.write() as work:
        return Event.model_validate(events.add(work, body.kind, body.happened_at, body.note, stand=name))


@router.post("/events/{number}/withdrawal", responses={403: {}, 404: {}, 409: {}})
def withdraw(number: Id, caller: Uploader) -> Event:
    """Take back an event that was entered in error; for whoever entered it, and for the roles that judge."""
    with caller.write() as work:
        return Event.model_validate(events.withdraw(work, number))
