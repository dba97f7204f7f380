"""A stand's drift: did it turn, or did a gyro change; and what it touched."""

from datetime import UTC, date, datetime, time, timedelta
from typing import Annotated, Literal

from fastapi import APIRouter, Query, Request, Response

from app.pages import drift_labels, stand_drift_view, stand_drift_words
from app.pages.base import Reader, TheLab, render
from app.pages.fleet_view import ORDER
from app.pages.tables import csv_answer, json_answer, parquet_answer
from app.services import stands
from app.services.drift import events, stand_reading
from app.services.drift.stand_rows import COLUMNS, rows

router = APIRouter()

_AFFECTED_SHOWN = 20
By = Literal["session", "day", "week", "month", "year"]


@router.get("/stands/{name}/drift")
def page(
    request: Request, person: Reader, lab: TheLab, name: str, by: Annotated[By | None, Query()] = None,
    since: date | None = None, until: date | None = None, parameter: str = "kx",
) -> Response:  # fmt: skip
    """What the stand's gyros say of it together."""
    with lab.read(person) as work:
        stand = stands.stand(work, name)
        found = stand_reading.stand_drift(work, name, since=_begin(since), until=_end(until), by=by)
    told = stand_drift_words.findings(found)
    parameter = parameter if parameter in ORDER else "kx"
    shown = bool(found.points)
    return render(
        request, "stand_drift/page.html", stand=stand, found=found, findings=told, order=ORDER, parameter=parameter,
        verdict=stand_drift_words.verdict(found, told), smallest=stand_drift_words.smallest(found),
        panels=list(stand_drift_view.panels(found)) if shown else [],
        common=stand_drift_view.common(found, parameter) if shown else None, rows=stand_drift_view.rows(found),
        groups=stand_reading.GROUPS, drift=drift_labels, whole=since is None and until is None,
        may_write="upload" in person.scopes, shown=_AFFECTED_SHOWN, most=stand_reading.MOST_POINTS,
        size=stand_drift_words.size, between=stand_drift_words.between, may_withdraw=events.may_withdraw,
    )  # fmt: skip


@router.get("/stands/{name}/drift/study")
def study(person: Reader, lab: TheLab, name: str) -> Response:
    """Whether the study has caught up: nothing while it has not, then htmx is told to show the page anew."""
    with lab.read(person) as work:
        up_to_date = stand_reading.is_up_to_date(work, name)
    return Response(headers={"HX-Refresh": "true"}) if up_to_date else Response(status_code=204)


@router.get("/stands/{name}/drift.{form}")
def exported(person: Reader, lab: TheLab, name: str, form: Literal["csv", "json", "parquet"]) -> Response:
    """Every session on the stand with what it shows, as a file."""
    with lab.read(person) as work:
        table = rows(stand_reading.table_of(work, name))
    if form == "json":
        return json_answer(table)
    answer = csv_answer if form == "csv" else parquet_answer
    return answer(table, COLUMNS, f"stand-{name}")


def _begin(day: date | None) -> datetime | None:
    return None if day is None else datetime.combine(day, time(), UTC)


def _end(day: date | None) -> datetime | None:
    return None if day is None else datetime.combine(day, time(), UTC) + timedelta(days=1, microseconds=-1)
