"""A gyro's history: control charts, alarms and events, repeatability, trend, and every value."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from datetime import UTC, date, datetime, time, timedelta
from typing import Annotated, Any, Final, Literal

from fastapi import APIRouter, Depends, Query, Request, Response
from pydantic import BeforeValidator

from app.figures import measured
from app.pages import drift_labels, drift_panels, drift_tables, drift_words
from app.pages.alarms import may_judge
from app.pages.base import Reader, TheLab, render
from app.pages.drift_panels import ORDER, SOLID
from app.pages.tables import Row, csv_answer, json_answer, parquet_answer
from app.services import gyros, sessions
from app.services.drift import alarms, due, events, grouping, reading
from app.services.drift.alarms import CAUSES
from app.services.drift.views import DriftPoint, EventView, GyroDrift, ParameterDrift

router = APIRouter()

PERIODS: Final = {"quarter": 92, "year": 366, "three": 1097, "all": None}
"""Choices of the period, in days back from today."""
Period = Literal["quarter", "year", "three", "repair", "all"]
Method = Literal["least-squares", "generalised", "robust", "paper"]
Group = Literal["session", "start", "day", "month", "year"]
_MOST_ROWS: Final = 50
_SESSIONS: Final = 6


Day = Annotated[date | None, BeforeValidator(lambda text: text or None)]
"""A day of an address; a field left empty names none."""


@dataclass(frozen=True, slots=True)
class View:
    """What of a history is wanted: a period by its name or by its days, a grouping, a method.

    Without a method it is the one that stands for the gyro.
    """

    period: Period = "year"
    begin: Annotated[Day, Query(alias="from")] = None
    until: Day = None
    by: Group = "session"
    method: Method | None = None


Wanted = Annotated[View, Depends()]


@router.get("/gyros/{serial}")
def page(request: Request, person: Reader, lab: TheLab, serial: str, wanted: Wanted) -> Response:
    """The drift of one gyro."""
    now = datetime.now(UTC)
    with lab.read(person) as work:
        gyro = gyros.gyro(work, serial)
        repaired = last_repair(events.of_gyro(work, serial))
        since, until = bounds(wanted, repaired, now)
        found = reading.gyro_drift(
            work, serial, method=wanted.method, parameters=ORDER, since=since, until=until, by=wanted.by,
            newest=_MOST_ROWS,
        )  # fmt: skip
        known = alarms.alarms(work, gyro=serial, method=found.method, state=None)
        rows = drift_tables.by_session(
            [replace(item, points=item.newest) for item in found.parameters], _MOST_ROWS
        )
        latest = sessions.sessions(work, gyro=serial, limit=_SESSIONS)
        holds = due.due_of(work, [serial]).get(serial)
    window = drift_panels.window_of(found, since, until, now)
    return render(
        request, "history/page.html", gyro=gyro, found=found, alarms=known, period=chosen(wanted),
        periods=choices(repaired), method=found.method, by=wanted.by, groups=grouping.GROUPS,
        panels=list(drift_panels.panels(found, window)), rows=rows, total=_results(found.parameters), order=ORDER,
        ahead=any((item.study or {}).get("forecast") for item in found.parameters), repaired=window.breaks,
        bases=drift_tables.bases(found), trends=drift_tables.trends(found), latest=latest, due=holds,
        repeatability=drift_tables.repeatability(found), interval=(found.document or {}).get("interval"),
        judges=may_judge(person), may_write="upload" in person.scopes, now=now, today=now.date(), causes=CAUSES,
        drift=drift_labels, words=drift_words, measured=measured, may_withdraw=events.may_withdraw,
    )  # fmt: skip


@router.get("/gyros/{serial}/study")
def study(person: Reader, lab: TheLab, serial: str, method: Method | None = None) -> Response:
    """Whether the study has caught up: nothing while it has not, then htmx is told to show the page anew."""
    with lab.read(person) as work:
        found = reading.gyro_drift(work, serial, method=method, parameters=(), by="session", most=1)
    if not found.up_to_date:
        return Response(status_code=204)
    return Response(headers={"HX-Refresh": "true"})


@router.get("/gyros/{serial}/history.{form}")
def exported(
    person: Reader, lab: TheLab, serial: str, form: Literal["csv", "json", "parquet"], wanted: Wanted,
) -> Response:  # fmt: skip
    """The same values as a file: one row for each parameter of each session, or of each group."""
    with lab.read(person) as work:
        since, until = bounds(wanted, last_repair(events.of_gyro(work, serial)), datetime.now(UTC))
        found = reading.gyro_drift(
            work,
            serial,
            method=wanted.method,
            parameters=ORDER,
            since=since,
            until=until,
            by=wanted.by,
            most=None,
        )
    rows = [value_row(found, item, point) for item in found.parameters for point in item.points]
    if form == "json":
        return json_answer(rows)
    answer = csv_answer if form == "csv" else parquet_answer
    return answer(rows, COLUMNS, f"history-{serial}")


@router.get("/gyros/{serial}/repeatability.csv")
def scatter(person: Reader, lab: TheLab, serial: str, method: Method | None = None) -> Response:
    """The variance components with every digit."""
    with lab.read(person) as work:
        rows = [_component(serial, item) for item in reading.components(work, serial, method=method)]
    return csv_answer(rows, _SCATTER_COLUMNS, f"repeatability-{serial}")


def last_repair(known: tuple[EventView, ...]) -> datetime | None:
    """When the gyro last became another one."""
    return max((item.at for item in known if item.kind in SOLID and item.gyro), default=None)


def choices(repaired: datetime | None) -> tuple[str, ...]:
    """Periods to choose from."""
    return (*PERIODS, "repair") if repaired else tuple(PERIODS)


def chosen(wanted: View) -> str:
    """The period's name; empty when days are given."""
    return "" if wanted.begin or wanted.until else wanted.period


def bounds(wanted: View, repaired: datetime | None, now: datetime) -> tuple[datetime | None, datetime | None]:
    """Beginning and end of the period, None where it is open."""
    if wanted.begin or wanted.until:
        return _midnight(wanted.begin), _midnight(wanted.until and wanted.until + timedelta(days=1))
    if wanted.period == "repair":
        return repaired, None
    days = PERIODS[wanted.period]
    return None if days is None else now - timedelta(days=days), None


def _midnight(day: date | None) -> datetime | None:
    return None if day is None else datetime.combine(day, time(), UTC)


def _results(parameters: tuple[ParameterDrift, ...]) -> int:
    return max((item.sessions for item in parameters), default=0)


COLUMNS: Final = (
    "gyro", "measured_at", "until", "sessions", "session", "start", "stand", "certificate", "result", "revision",
    "parameter", "value", "standard_uncertainty", "expanded_uncertainty", "coverage_factor",
    "standard_deviation", "unit", "low", "high", "verdict", "signals",
)  # fmt: skip
_SCATTER_COLUMNS: Final = (
    "gyro", "parameter", "unit", "source", "sd", "low", "high", "dof", "f", "p_value", "confounded_with",
)  # fmt: skip


def value_row(found: GyroDrift, item: ParameterDrift, point: DriftPoint) -> Row:
    """A point as a row of a file."""
    return {
        "gyro": found.gyro, "measured_at": point.at, "until": point.until, "sessions": point.sessions,
        "session": point.session, "start": point.start, "stand": point.stand, "certificate": point.certificate,
        "result": point.calibration, "revision": point.revisions, "parameter": item.parameter,
        "value": point.value, "standard_uncertainty": point.u, "expanded_uncertainty": point.expanded,
        "coverage_factor": point.k, "standard_deviation": point.scatter, "unit": item.unit, "low": item.low,
        "high": item.high, "verdict": point.verdict, "signals": " ".join(point.signals),
    }  # fmt: skip


def _component(serial: str, part: Mapping[str, Any]) -> Row:
    known = {name: part.get(name) for name in _SCATTER_COLUMNS}
    return {**known, "gyro": serial, "confounded_with": " ".join(part.get("confounded_with") or ())}
