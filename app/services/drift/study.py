"""A gyro's study by one method: what its parameters do over its life. Pure: columns in, a document out."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import timedelta
from typing import Any

from app.exchange.json_values import Json
from app.exchange.si import PARAMETER_UNITS
from app.services.drift import charting, events, intervals
from app.services.drift.alarms import Finding
from app.services.drift.courses import course_study
from app.services.drift.findings import AHEAD, Told, findings
from app.services.drift.repeatability import repeatability
from app.services.drift.series import Column, SeriesTable, aware, iso
from app.services.drift.views import BaselineView, EventView
from app.services.verdicts import judge
from solver import __version__
from solver.records import PARAMETERS


@dataclass(frozen=True, slots=True)
class Known:
    """What a gyro's values are judged by.

    Attributes
    ----------
    limits
        By parameter ``low``, ``high``, ``repeatability``.
    interval_days
        How long a calibration of its type holds; None when nobody has said.
    events
        What people entered for the gyro and for its stands.
    baselines
        In force, of this method.
    """

    gyro: str
    method: str
    limits: Mapping[str, Mapping[str, float | None]]
    interval_days: int | None
    events: tuple[EventView, ...]
    baselines: tuple[BaselineView, ...]

    def limit(self, parameter: str, side: str) -> float | None:
        """A limit of a parameter: ``low``, ``high`` or ``repeatability``; None when there is none."""
        return self.limits.get(parameter, {}).get(side)


@dataclass(frozen=True, slots=True)
class Studied:
    """A study: its document, the series with the charts' columns, its findings."""

    document: Json
    table: SeriesTable
    findings: tuple[Finding, ...]


def study(table: SeriesTable, known: Known) -> Studied:
    """Study every parameter of a gyro.

    Parameters
    ----------
    table
        Results that count, by one method.
    """
    entries: dict[str, Json] = {}
    columns: dict[str, Column] = {}
    found: list[Finding] = []
    happened = (*known.events, *events.derived(table, known.gyro))
    for name in PARAMETERS:
        entries[name], more, told = _parameter(table, known, name, happened)
        columns |= more
        found += told
    last = aware(table["measured_at"][-1]) if len(table) else None
    document: Json = {
        "gyro": known.gyro, "method": known.method, "sessions": len(table),
        "from": iso(table["measured_at"][0]) if len(table) else None,
        "until": None if last is None else last.isoformat(), "solver_version": __version__,
        "parameters": entries, "interval": intervals.interval(
            table, known.limits, known.interval_days, entries, known.events
        ),
    }  # fmt: skip
    return Studied(document, table.with_columns(columns), tuple(found))


def _parameter(
    table: SeriesTable, known: Known, name: str, happened: Sequence[EventView]
) -> tuple[Json, dict[str, Column], list[Finding]]:
    """One parameter: its document entry, its charts' columns, its findings."""
    places = table.determined(name)
    low, high = known.limit(name, "low"), known.limit(name, "high")
    if not len(places):
        return _nothing(name), charting.no_columns(table, name), []
    baselines = [item for item in known.baselines if item.parameter == name]
    charts = charting.charts(table, name, baselines, known.events)
    course = course_study(table, name, happened, low, high)
    entry: dict[str, Any] = {
        "unit": PARAMETER_UNITS[name][0],
        "latest": _latest(table, name, int(places[-1]), low, high),
        "status": charts.status, "charts": charts.document,
        "changes": list(course.changes), "outliers": list(course.outliers), "trend": course.trend,
        "forecast": course.forecast,
        **repeatability(table, name, course.course, known.limit(name, "repeatability")),
    }  # fmt: skip
    columns = charts.columns | {f"{name}.course": course.fitted, f"{name}.u_course": course.u_fitted}
    ahead = AHEAD if known.interval_days is None else timedelta(days=known.interval_days)
    told = Told(name, PARAMETER_UNITS[name][0], entry, charts.signals)
    return entry, columns, list(findings(table, told, low, high, ahead))


def _nothing(name: str) -> Json:
    return {
        "unit": PARAMETER_UNITS[name][0], "latest": None, "status": "no-baseline", "charts": None, "changes": [],
        "outliers": [], "trend": None, "forecast": None, "components": [], "together": None,
        "repeatability_limit": None, "repeatability_verdict": "no-limit",
    }  # fmt: skip


def _latest(table: SeriesTable, name: str, place: int, low: float | None, high: float | None) -> Json:
    value, u, k = (float(table[f"{name}.{part}"][place]) for part in ("value", "u", "k"))
    stated = None if u != u else u
    return {
        "value": value, "u": stated, "k": k, "session": int(table["session"][place]),
        "calibration": int(table["calibration"][place]), "at": iso(table["measured_at"][place]),
        "verdict": judge(value, stated, low, high, k),
    }  # fmt: skip
