"""Types of gyros and their limits."""

from fastapi import APIRouter

from app.api.auth import Reader, Uploader
from app.api.pagination import Listing
from app.api.schemas.common import Name
from app.api.schemas.equipment import GyroType, NewLimits
from app.services import gyros
from app.services.views import TypeView

router = APIRouter(tags=["gyros"])


@router.get("/types")
def listing(caller: Reader) -> Listing[GyroType]:
    """Every type with its limits, in one part."""
    with caller.read() as work:
        return Listing(items=[_shown(item) for item in gyros.types(work)], next=None)


@router.put("/types/{name}/limits")
def set_limits(name: Name, body: NewLimits, caller: Uploader) -> GyroType:
    """Enter a type's limits, in laboratory units; an unknown type is created."""
    with caller.write() as work:
        gyros.set_limits(work, name, {key: (limit.low, limit.high) for key, limit in body.limits.items()})
        known = {item.name: item for item in gyros.types(work)}
    return _shown(known[name.strip()])


def _shown(view: TypeView) -> GyroType:
    limits = {name: {"low": low, "high": high} for name, (low, high) in view.limits.items()}
    return GyroType.model_validate(
        {"name": view.name, "note": view.note, "gyros": view.gyros, "limits": limits}
    )
