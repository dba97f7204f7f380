"""What a parameter did and where it leads, as the study's document has it: changes, wild values, trend, forecast."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import isfinite
from typing import Any, Final

import numpy as np

from app.exchange.json_values import Json, finite
from app.services.drift.events import BREAKING
from app.services.drift.series import Column, SeriesTable, aware, iso, moment
from app.services.drift.views import EventView
from solver.drift.courses.course import describe
from solver.drift.courses.course_records import Change, Course
from solver.drift.courses.forecast import PROBABILITY, Leaving, leaves, predict
from solver.records import Array

DAY: Final = 86_400.0
YEAR: Final = 365.25 * DAY
LIKELY: Final = 0.05
"""A date of a step that is less probable does not count when an event is looked for that explains it."""
_BESIDE: Final = ("stand", "certificate", "other", "solver")
_MOMENTS: Final = 25
HORIZON: Final = 2 * YEAR
"""How far ahead a forecast looks, s."""


@dataclass(frozen=True, slots=True)
class CourseStudy:
    """A parameter's course, as found and as document entries; `fitted` and `u_fitted` for every session.

    `changes`, `outliers`, `trend` and `forecast` are as the study's document has them.
    """

    course: Course
    changes: tuple[Json, ...]
    outliers: tuple[Json, ...]
    trend: Json
    forecast: Json
    fitted: Column
    u_fitted: Column


def course_study(
    table: SeriesTable, parameter: str, events: Sequence[EventView], low: float | None, high: float | None
) -> CourseStudy:
    """Describe a parameter that at least one session determined; `events`: entered, and told by the sessions."""
    places = table.determined(parameter)
    here = table.rows(places)
    history = table.history(parameter)
    happened = [event for event in events if _concerns(here, event)]
    course = describe(history, [_second(event) for event in happened if event.kind in BREAKING])
    fitted, u_fitted = np.full(len(table), np.nan), np.full(len(table), np.nan)
    fitted[places], u_fitted[places] = course.fitted, course.u_fitted
    return CourseStudy(
        course,
        tuple(_change(here, change, happened) for change in course.changes),
        tuple(
            {**_session(here, item.index), "size": item.size, "u": item.u, "p_value": item.p_value}
            for item in course.outliers
        ),
        _trend(here, course),
        _forecast(course, history.u, low, high),
        fitted,
        u_fitted,
    )


def _concerns(table: SeriesTable, event: EventView) -> bool:
    """Whether it happened to the gyro, or to the stand of the session before it or of that after it."""
    after = int(np.searchsorted(table["measured_at"], moment(event.at)))
    return event.stand is None or event.stand in table["stand"][max(after - 1, 0) : after + 1]


def _second(event: EventView) -> float:
    return event.at.timestamp()


def _session(table: SeriesTable, place: int) -> Json:
    return {
        "calibration": int(table["calibration"][place]), "session": int(table["session"][place]),
        "at": iso(table["measured_at"][place]),
    }  # fmt: skip


def _change(table: SeriesTable, change: Change, events: Sequence[EventView]) -> Json:
    """A change, its dates as sessions, and what lies at its likely dates.

    ``event`` and ``event_kind`` are of the one that explains it; ``beside`` is what happened then as well and explains
    nothing by itself, the likelier first: another stand or certificate, a note, another version of the solver.
    """
    times = table["measured_at"]
    per_year = YEAR if change.kind == "bend" else 1.0
    dates = change.dates or ((change.index, 1.0),)
    likely = [index for index, chance in dates if chance >= LIKELY] or [change.index]
    begin, end = times[max(likely[0] - 1, 0)], times[likely[-1]]
    between = [event for event in events if begin <= moment(event.at) <= end]
    between.sort(key=lambda event: abs(_second(event) - change.time))
    named = next((event for event in between if event.kind in BREAKING), None)
    beside = [event for event in between if event.kind not in BREAKING]
    return {
        "kind": change.kind, **_session(table, change.index),
        "before": iso(times[max(change.index - 1, 0)]), "since": iso(begin), "until": iso(end),
        "size": change.size * per_year, "u": change.u * per_year, "p_value": finite(change.p_value),
        "dates": [{"session": int(table["session"][index]), "probability": chance} for index, chance in dates],
        "event": None if named is None else named.id, "event_kind": None if named is None else named.kind,
        "event_at": None if named is None else named.at.isoformat(),
        "beside": [
            {"kind": event.kind, "at": event.at.isoformat(), "note": event.note, "event": event.id}
            for event in sorted(beside, key=lambda event: _BESIDE.index(event.kind))
        ],
    }  # fmt: skip


def _trend(table: SeriesTable, course: Course) -> Json:
    constant = course.time_constant
    return {
        "model": course.model, "since": iso(table["measured_at"][course.since]), "sessions": course.count,
        "slope_per_year": course.slope * YEAR, "u_slope_per_year": finite(course.u_slope * YEAR),
        "p_value": finite(course.slope_p), "level": float(course.fitted[-1]),
        "u_level": finite(float(course.u_fitted[-1])),
        "time_constant_days": None if constant is None else constant / DAY, "scatter": course.scatter,
        "dof": course.dof, "agreement": course.agreement,
        "tests": [
            {"model": test.model, "against": test.against, "f": finite(test.f), "dof": list(test.dof),
             "p_value": finite(test.p_value)}
            for test in course.tests
        ],
    }  # fmt: skip


def _forecast(course: Course, noise: Array, low: float | None, high: float | None) -> Json:
    """The band of values to come, and when the course leaves the limits, for two years."""
    times = course.last + np.linspace(0.0, HORIZON, _MOMENTS)
    band = predict(course, times, float(np.median(noise)))
    level = float(course.fitted[-1])
    inside = (low is None or level > low) and (high is None or level < high)
    # A constant course inside its limits leads nowhere, and looking for where takes long.
    found = (
        None if course.model == "constant" and inside else leaves(course, low, high, course.last + HORIZON)
    )
    known = bool(np.isfinite(band.low).all() and np.isfinite(band.high).all())
    return {
        "probability": PROBABILITY, "at": [_iso(time) for time in times], "value": band.value.tolist(),
        "low": band.low.tolist() if known else [], "high": band.high.tolist() if known else [],
        "leaves": None if found is None else _leaving(found),
    }  # fmt: skip


def _leaving(found: Leaving) -> Json:
    return {
        "side": found.side, "limit": found.limit, "date": _iso(found.date), "earliest": _iso(found.earliest),
        "latest": None if found.latest is None else _iso(found.latest),
    }  # fmt: skip


def _iso(second: Any) -> str:
    if not isfinite(second):
        raise ValueError("a time that is not finite")
    return aware(np.datetime64(round(float(second) * 1e6), "us")).isoformat()
