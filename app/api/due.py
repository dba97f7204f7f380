"""What is to be calibrated next."""

from typing import Annotated, Final

from fastapi import APIRouter, Query, Request, Response
from pydantic import Field

from app.api.auth import Reader
from app.api.pagination import TABLE_TOO, Columns, Listing, Part, cut, listed
from app.api.schemas.common import Name
from app.api.schemas.due import Due, State
from app.services.drift import due

router = APIRouter(tags=["drift"])

_COLUMNS: Final[Columns[Due]] = {
    "gyro": lambda item: item.gyro,
    "type": lambda item: item.type,
    "check": lambda item: int(item.check),
    "state": lambda item: item.state,
    "due": lambda item: item.due.isoformat() if item.due else None,
    "days": lambda item: item.days,
    "interval_days": lambda item: item.interval_days,
    "session": lambda item: item.session,
    "calibration": lambda item: item.calibration,
    "measured_at": lambda item: item.measured_at,
    "stand": lambda item: item.stand,
}


class DuePart(Part):
    """Which gyros."""

    type: Name | None = None
    state: Annotated[State | None, Field(description="Only gyros in this state.")] = None


@router.get("/due", response_model=Listing[Due], responses=TABLE_TOO)
def listing(part: Annotated[DuePart, Query()], caller: Reader, request: Request) -> Response:
    """Every gyro with the day until which its calibration holds, the most urgent first."""
    with caller.read() as work:
        everything = due.due_list(work, type_name=part.type)
    wanted = [item for item in everything if part.state in (None, item.state)]
    found, following = cut(wanted, part, lambda item: item.gyro)
    return listed(request, [Due.model_validate(item) for item in found], following, _COLUMNS)
