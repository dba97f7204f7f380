"""The first screen: the stand now with its one next action, and the latest sessions."""

from collections.abc import Sequence
from datetime import UTC, datetime

from fastapi import APIRouter, Request, Response

from app.pages import drift_labels, drift_words, live_view
from app.pages.base import Reader, TheLab, render
from app.pages.live import look
from app.pages.live_map import Numbers
from app.pages.positions import last_measured, next_position, position_map
from app.services import gyros, overview, stands
from app.services.drift import alarms
from app.services.drift.views import AlarmView

router = APIRouter()

_ALARMS = 5
"""Gyros and stands with alarms that the first screen shows; the queue has the others."""


@router.get("/")
def today(request: Request, person: Reader, lab: TheLab) -> Response:
    """What is open, what comes next, what was found last."""
    with lab.read(person) as work:
        seen = overview.overview(work)
        has_gyro = bool(gyros.gyros(work, limit=1).items)
        known = stands.stands(work)
        worst, counts = _worst(alarms.alarms(work)), alarms.counts(work)
    current = seen.current
    run = current.session.station if current else None
    watched = (
        look(lab, person, current.session.id, Numbers(current.positions))
        if current and run and run.under_way
        else None
    )
    return render(
        request, "today/page.html", current=current, recent=seen.recent, now=datetime.now(UTC).astimezone(),
        coming=next_position(current.positions) if current else None,
        last=last_measured(current) if current else None,
        map=position_map(current) if current else None, watched=watched, view=live_view,
        worst=worst, open_count=sum(counts.values()), drift=drift_labels, words=drift_words,
        has_gyro=has_gyro, has_stand=bool(known), certified=any(item.certificate for item in known),
    )  # fmt: skip


def _worst(found: Sequence[AlarmView]) -> list[AlarmView]:
    """The worst alarm of each gyro and stand, the worst of these first."""
    first: dict[tuple[str | None, str | None], AlarmView] = {}
    for alarm in found:
        first.setdefault((alarm.gyro, alarm.stand), alarm)
    return list(first.values())[:_ALARMS]
