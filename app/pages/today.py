"""The first screen: the queue of whoever looks, by the role.

A technician's begins with the stand and its one next action, a metrologist's with the results to review, that of
quality with what is overdue and out of control, and with what people have entered and answered.
"""

from collections import Counter
from collections.abc import Mapping, Sequence
from datetime import UTC, datetime
from typing import Final

from fastapi import APIRouter, Request, Response

from app.pages import drift_labels, drift_words, live_view
from app.pages.base import Reader, TheLab, render
from app.pages.live import look
from app.pages.live_map import Numbers
from app.pages.positions import last_measured, next_position, position_map
from app.services import gyros, overview, stands
from app.services.drift import acts, alarms, due
from app.services.drift.views import AlarmView

router = APIRouter()

_MOST: Final = 5
"""Lines of alarms, overdue gyros and results on the first screen; the lists behind it have the others."""
_ACTS: Final = 8
_ALARMS: Final = 5000
_PARTS: Final[Mapping[str, tuple[str, ...]]] = {
    "metrologist": ("results", "drift", "due", "now", "sessions"),
    "quality": ("due", "drift", "acts", "now", "sessions"),
}
"""What stands on the screen of a role, from the top; every part is a template."""
_USUAL: Final = ("now", "drift", "due", "sessions")


@router.get("/")
def today(request: Request, person: Reader, lab: TheLab) -> Response:
    """What is open, what comes next, what was found last."""
    parts = _PARTS.get(person.role, _USUAL)
    with lab.read(person) as work:
        seen = overview.overview(work)
        has_gyro = bool(gyros.gyros(work, limit=1).items)
        known = stands.stands(work)
        found = alarms.alarms(work, limit=_ALARMS)
        overdue = [item for item in due.due_list(work) if item.state == "overdue"]
        results = overview.results(work, _MOST) if "results" in parts else ()
        done = acts.latest(work, _ACTS) if "acts" in parts else ()
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
        parts=parts, most=_MOST, overdue=overdue, results=results, acts=done, worst=_worst(found),
        kinds=Counter(item.kind for item in found), open_count=len(found), drift=drift_labels, words=drift_words,
        has_gyro=has_gyro, has_stand=bool(known), certified=any(item.certificate for item in known),
    )  # fmt: skip


def _worst(found: Sequence[AlarmView]) -> list[AlarmView]:
    """The worst alarm of each gyro and stand, the worst of these first."""
    first: dict[tuple[str | None, str | None], AlarmView] = {}
    for alarm in found:
        first.setdefault((alarm.gyro, alarm.stand), alarm)
    return list(first.values())
