"""The first screen: the open session with its one next action, and the latest sessions."""

from datetime import UTC, datetime

from fastapi import APIRouter, Request, Response

from app.pages.base import Reader, TheLab, render
from app.pages.positions import last_measured, next_position, position_map
from app.services import gyros, overview, stands

router = APIRouter()


@router.get("/")
def today(request: Request, person: Reader, lab: TheLab) -> Response:
    """What is open, what comes next, what was found last."""
    with lab.read(person) as work:
        seen = overview.overview(work)
        has_gyro = bool(gyros.gyros(work, limit=1).items)
        known = stands.stands(work)
    current = seen.current
    return render(
        request, "today/page.html", current=current, recent=seen.recent, now=datetime.now(UTC).astimezone(),
        coming=next_position(current.positions) if current else None,
        last=last_measured(current) if current else None,
        map=position_map(current) if current else None,
        has_gyro=has_gyro, has_stand=bool(known), certified=any(item.certificate for item in known),
    )  # fmt: skip
