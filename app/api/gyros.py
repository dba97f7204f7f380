"""Gyros."""

from typing import Annotated, Final

from fastapi import APIRouter, Query, Request, Response

from app.api import links
from app.api.auth import Reader, Uploader
from app.api.pagination import CSV_TOO, Columns, Listing, Part, listed
from app.api.schemas.common import Name
from app.api.schemas.equipment import Gyro, GyroChange, NewGyro
from app.services import gyros

router = APIRouter(tags=["gyros"])

_COLUMNS: Final[Columns[Gyro]] = {
    "serial": lambda item: item.serial,
    "type": lambda item: item.type,
    "note": lambda item: item.note,
    "check": lambda item: int(item.check),
    "created_at": lambda item: item.created_at,
    "last_session": lambda item: item.last_session,
    "last_measured_at": lambda item: item.last_measured_at,
    "last_stand": lambda item: item.last_stand,
    "last_result": lambda item: item.last_result.id if item.last_result else None,
    "verdict": lambda item: item.last_result.verdict if item.last_result else None,
}


class GyroPart(Part):
    """Which gyros."""

    type: Name | None = None


@router.post("/gyros", status_code=201, responses={409: {}})
def add(body: NewGyro, caller: Uploader, response: Response) -> Gyro:
    """Register a gyro."""
    with caller.write() as work:
        made = gyros.add_gyro(work, body.serial, body.type, body.note, check=body.check)
    response.headers["location"] = links.gyro(made.serial)
    return Gyro.model_validate(made)


@router.get("/gyros", response_model=Listing[Gyro], responses=CSV_TOO)
def listing(part: Annotated[GyroPart, Query()], caller: Reader, request: Request) -> Response:
    """Gyros by serial number, each with its latest result."""
    with caller.read() as work:
        found = gyros.gyros(work, type_name=part.type, after=part.after(), limit=part.limit)
    return listed(request, [Gyro.model_validate(item) for item in found.items], found.next, _COLUMNS)


@router.get("/gyros/{serial}", responses={404: {}})
def detail(serial: Name, caller: Reader) -> Gyro:
    """One gyro."""
    with caller.read() as work:
        return Gyro.model_validate(gyros.gyro(work, serial))


@router.patch("/gyros/{serial}", responses={404: {}})
def change(serial: Name, body: GyroChange, caller: Uploader) -> Gyro:
    """Correct a gyro's type or note, or make it a check gyro."""
    with caller.write() as work:
        changed = gyros.change_gyro(work, serial, type_name=body.type, note=body.note, check=body.check)
        return Gyro.model_validate(changed)
