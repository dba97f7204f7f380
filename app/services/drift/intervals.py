"""How long a calibration of a gyro holds, as the study's document has it: by the methods of ILAC-G24, with reasons.

What a calibration found is the largest share of its type's limits that any parameter used, by the mean of the sessions
of one visit to the laboratory. An interval ends at the first visit beyond the limits, or at the first one after three
quarters of the interval stated (`Findings.of_history`): how often somebody measures in between changes nothing. Without
limits there is nothing to leave, and without an interval stated for the type nothing to judge.
"""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from app.exchange.json_values import Json, message_from
from app.exchange.si import PARAMETER_UNITS
from app.services.drift.courses import DAY, HORIZON
from app.services.drift.series import Column, SeriesTable, moment, seconds
from app.services.drift.views import EventView
from solver.drift.recalibrating.in_use import Use
from solver.drift.recalibrating.interval_evidence import Check, Evidence, Findings, Outlook
from solver.drift.recalibrating.recalibration import (
    MethodAdvice,
    Recommendation,
    choose,
    recommend,
    statistical,
)
from solver.errors import Message
from solver.records import Array

_FEWEST: Final = 2
_VISIT_DAYS: Final = 1.0
"""Sessions closer together are one visit to the laboratory."""
_BREAKS: Final = ("repair", "adjustment")
"""What happened to the gyro itself: a calibration after it tells nothing of one before."""
Limits = Mapping[str, Mapping[str, float | None]]


def interval(
    table: SeriesTable,
    limits: Limits,
    stated_days: int | None,
    entries: Mapping[str, Json],
    events: Sequence[EventView] = (),
) -> Json:
    """The interval stated for the type, what each method recommends, and what was found at the end of intervals.

    Parameters
    ----------
    entries
        The study's parameters.
    events
        Of the gyro and its stands.
    """
    limited = {name: ends for name, ends in both_ends(limits).items() if entries[name]["latest"] is not None}
    days, used = _visits(table, limited, breaks := _breaks(events))
    if not stated_days or len(days) < _FEWEST:
        return _document(stated_days, None, None)
    own = Findings.of_history(days, used, float(stated_days), breaks)
    evidence = Evidence(
        days=float(stated_days),
        own=own,
        outlooks=tuple(_outlooks(entries, limited)),
        uses=tuple(_uses(table, limited)),
        checks=tuple(_checks(entries, limited)),
        horizon=HORIZON / DAY,
    )
    times, shares = own.checked()
    findings = {"limits": both_ends(limits), "days": times.tolist(), "used": shares.tolist()}
    return _document(stated_days, recommend(evidence), findings)


def type_advice(stated_days: int | None, findings: Sequence[Json], limits: Limits) -> MethodAdvice | None:
    """The share within limits over all gyros of a type; None while nothing is known of it.

    Parameters
    ----------
    findings
        Of each gyro of the type, as `interval` has them.
    limits
        Of the type now: what was found by others does not count.
    """
    now = {name: list(ends) for name, ends in both_ends(limits).items()}
    known = Findings.together(
        [Findings(one["days"], one["used"]) for one in findings if one["limits"] == now]
    )
    if not stated_days or not len(known.checked()[0]):
        return None
    return statistical(float(stated_days), None, known)


def by_type(document: Json, advice: MethodAdvice | None) -> Json:
    """What `interval` gave, with the advice of its type (`type_advice`) in place of its own of that method."""
    if advice is None or not document.get("findings"):
        return document
    methods = tuple(
        advice if item["method"] == advice.method else _read(item) for item in document["methods"]
    )
    found = choose(float(document["stated_days"]), methods)
    return _document(document["stated_days"], found, document["findings"])


def both_ends(limits: Limits) -> dict[str, tuple[float, float]]:
    """The limits of the parameters that have a lower and an upper one."""
    return {
        name: (side["low"], side["high"])
        for name, side in limits.items()
        if side["low"] is not None and side["high"] is not None
    }


def _document(stated_days: int | None, found: Recommendation | None, findings: Json | None) -> Json:
    if found is None:
        return {"stated_days": stated_days, "recommended_days": None, "methods": [], "reason": None,
                "findings": findings}  # fmt: skip
    return {
        "stated_days": stated_days, "recommended_days": found.days, "reason": _reason(found.reason),
        "methods": [_advice(item) for item in found.methods], "findings": findings,
    }  # fmt: skip


def _breaks(events: Sequence[EventView]) -> list[float]:
    times = [moment(event.at) for event in events if event.kind in _BREAKS and event.gyro is not None]
    return sorted(float(day) for day in seconds(np.array(times, "datetime64[us]")) / DAY)


def _visits(
    table: SeriesTable, limited: Mapping[str, tuple[float, float]], breaks: Sequence[float]
) -> tuple[Array, Array]:
    """Time of each visit, days, and the share of the limits used.

    A visit at which some parameter was not determined tells of the limits only if another one was beyond.
    """
    if not limited or not len(table):
        return np.empty(0), np.empty(0)
    days = seconds(table["measured_at"]) / DAY
    visit, first = _grouped(days, np.searchsorted(breaks, days, side="right"))
    shares = np.array(
        [
            np.abs(_means(table[f"{name}.value"], visit) - 0.5 * (low + high)) / (0.5 * (high - low))
            for name, (low, high) in limited.items()
        ]
    )
    used = np.nan_to_num(shares, nan=0.0).max(axis=0)
    counts = np.isfinite(shares).all(axis=0) | (used > 1.0)
    return days[first][counts], used[counts]


def _grouped(days: Array, after: NDArray[np.int64]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """The visit of each session, and the first session of each visit; a repair ends a visit."""
    first = list[int]()
    for place, day in enumerate(days.tolist()):
        if not first or day - days[first[-1]] >= _VISIT_DAYS or after[place] != after[first[-1]]:
            first.append(place)
    return np.searchsorted(first, np.arange(len(days)), side="right") - 1, np.array(first, np.int64)


def _means(values: Column, visit: NDArray[np.int64]) -> Array:
    """Of each visit the mean of what was determined; NaN where nothing was."""
    known = np.isfinite(values)
    total = np.bincount(visit, np.where(known, values, 0.0))
    count = np.bincount(visit, known)
    means: Array = np.divide(total, count, out=np.full(len(total), np.nan), where=count > 0)
    return means


def _outlooks(entries: Mapping[str, Json], limited: Mapping[str, tuple[float, float]]) -> Iterator[Outlook]:
    for name, (low, high) in limited.items():
        band = entries[name]["forecast"]
        if band["low"]:
            days = seconds(_times(band["at"]))
            yield Outlook(name, (days - days[0]) / DAY, band["low"], band["high"], low, high)


def _times(texts: list[str]) -> Column:
    return np.array([text.removesuffix("+00:00") for text in texts], "datetime64[us]")


def _uses(table: SeriesTable, limited: Mapping[str, tuple[float, float]]) -> Iterator[Use]:
    """By starts, as far as they were counted here."""
    for name, (low, high) in limited.items():
        here = table.rows(table.determined(name))
        days = seconds(here["measured_at"]) / DAY
        starts = here["start"].astype(np.float64)
        if len(here) > 1 and days[-1] > days[0]:
            rate = float((starts[-1] - starts[0]) / (days[-1] - days[0]))
            yield Use(
                name, days - days[0], starts, here[f"{name}.value"], low, high, max(rate, 0.0), "starts",
                PARAMETER_UNITS[name][0],
            )  # fmt: skip


def _checks(entries: Mapping[str, Json], limited: Mapping[str, tuple[float, float]]) -> Iterator[Check]:
    for name, (low, high) in limited.items():
        trend, together = entries[name]["trend"], entries[name]["together"]
        if together is None or together["sd"] is None or trend["u_slope_per_year"] is None:
            continue
        drift = (abs(trend["slope_per_year"]) + 2.0 * trend["u_slope_per_year"]) / 365.25
        margin = min(high - trend["level"], trend["level"] - low)
        yield Check(name, together["sd"], margin, drift, PARAMETER_UNITS[name][0])


def _reason(message: Message) -> Json:
    return {"code": message.code, "template": message.template, "values": dict(message.values)}


def _read(item: Json) -> MethodAdvice:
    """What `_advice` wrote."""
    return MethodAdvice(item["method"], item["days"], message_from(item["reason"]), item["interval_of"])


def _advice(item: MethodAdvice) -> dict[str, Any]:
    return {
        "method": item.method, "days": None if item.days is None else round(item.days),
        "interval_of": item.interval_of, "reason": _reason(item.reason),
    }  # fmt: skip
