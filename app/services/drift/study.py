"""A gyro's study by one method: what its parameters do over its life. Pure: columns in, a document out."""

from collections.abc import Mapping
from dataclasses import dataclass
from datetime import datetime, timedelta
from typing import Any

from app.exchange.json_values import Json
from app.exchange.si import PARAMETER_UNITS
from app.services.drift.alarms import Finding
from app.services.drift.series import SeriesTable, aware, iso
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


@dataclass(frozen=True, slots=True)
class Studied:
    """A study: its document (see `app.services.drift.views.GyroDrift`), the series with the charts, its findings."""

    document: Json
    table: SeriesTable
    findings: tuple[Finding, ...]


def study(table: SeriesTable, known: Known) -> Studied:
    """Study every parameter of a gyro."""
    parameters = {name: _parameter(table, known, name) for name in PARAMETERS}
    document: Json = {
        "gyro": known.gyro, "method": known.method, "sessions": len(table), "from": None, "until": None,
        "solver_version": __version__, "parameters": parameters, "interval": {}, "due": None,
    }  # fmt: skip
    if len(table):
        document |= {"from": iso(table["measured_at"][0]), "until": iso(table["measured_at"][-1])}
        document |= {"due": _due(aware(table["measured_at"][-1]), known.interval_days)}
    return Studied(document, table, ())


def _due(last: datetime, days: int | None) -> str | None:
    return None if days is None else (last + timedelta(days=days)).isoformat()


def _parameter(table: SeriesTable, known: Known, name: str) -> dict[str, Any]:
    places = table.determined(name)
    return {
        "unit": PARAMETER_UNITS[name][0],
        "latest": latest(table, known, name, int(places[-1])) if len(places) else None,
        "status": "no-baseline",
    }


def latest(table: SeriesTable, known: Known, name: str, place: int) -> Json:
    """The value of one session, as it stands in the document."""
    value, u, k = (float(table[f"{name}.{part}"][place]) for part in ("value", "u", "k"))
    stated = None if u != u else u
    limits = known.limits.get(name, {})
    return {
        "value": value, "u": stated, "k": k, "session": int(table["session"][place]),
        "calibration": int(table["calibration"][place]), "at": iso(table["measured_at"][place]),
        "verdict": judge(value, stated, limits.get("low"), limits.get("high"), k),
    }  # fmt: skip
