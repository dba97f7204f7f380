"""Alarms: what the studies found, and what people answered."""

from typing import Annotated, Final, Literal

from fastapi import APIRouter, Query, Request, Response

from app.api.auth import Reader, Uploader
from app.api.pagination import TABLE_TOO, Columns, Listing, Part, listed
from app.api.schemas.common import Id, Name, OptionalText
from app.api.schemas.drift import Acknowledgement, Alarm
from app.services.drift import alarms

router = APIRouter(tags=["drift"])

_COLUMNS: Final[Columns[Alarm]] = {
    "id": lambda item: item.id,
    "severity": lambda item: item.severity,
    "state": lambda item: item.state,
    "gyro": lambda item: item.gyro,
    "stand": lambda item: item.stand,
    "parameter": lambda item: item.parameter,
    "unit": lambda item: item.unit,
    "method": lambda item: item.method,
    "kind": lambda item: item.kind,
    "detail": lambda item: item.detail,
    "at": lambda item: item.at,
    "session": lambda item: item.session,
    "calibration": lambda item: item.calibration,
    "last_at": lambda item: item.last_at,
    "last_session": lambda item: item.last_session,
    "last_calibration": lambda item: item.last_calibration,
    "baseline": lambda item: item.baseline,
    "raised_at": lambda item: item.raised_at,
    "ended_at": lambda item: item.ended_at,
    "acknowledged_at": lambda item: item.acknowledged_at,
    "acknowledged_by": lambda item: item.acknowledged_by,
    "cause": lambda item: item.cause,
    "note": lambda item: item.note,
}


class Which(Part):
    """Which alarms."""

    gyro: Name | None = None
    stand: Name | None = None
    kind: OptionalText = None
    state: Literal["open", "acknowledged", "replaced", "lapsed", "any"] = "open"


@router.get("/alarms", response_model=Listing[Alarm], responses=TABLE_TOO)
def listing(which: Annotated[Which, Query()], caller: Reader, request: Request) -> Response:
    """Alarms, the worst first; open ones unless another state is asked for."""
    start = which.before() or 0
    with caller.read() as work:
        found = alarms.alarms(
            work, gyro=which.gyro, stand=which.stand, kind=which.kind, start=start, limit=which.limit + 1,
            state=None if which.state == "any" else which.state,
        )  # fmt: skip
    following = str(start + which.limit) if len(found) > which.limit else None
    shown = [Alarm.model_validate(item) for item in found[: which.limit]]
    return listed(request, shown, following, _COLUMNS)


@router.get("/alarms/{number}", responses={404: {}})
def detail(number: Id, caller: Reader) -> Alarm:
    """One alarm."""
    with caller.read() as work:
        return Alarm.model_validate(alarms.alarm(work, number))


@router.post("/alarms/{number}/acknowledgement", responses={404: {}, 409: {}})
def acknowledge(number: Id, body: Acknowledgement, caller: Uploader) -> Alarm:
    """Answer for an alarm; for accounts with the role metrologist, quality or admin."""
    with caller.write() as work:
        return Alarm.model_validate(alarms.acknowledge(work, number, body.cause, body.note))
