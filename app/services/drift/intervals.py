"""How long a calibration of a gyro holds, as the study's document has it: by the methods of ILAC-G24, with reasons.

What each session found at the end of an interval is the largest share of its type's limits that any parameter used.
Without limits there is nothing to leave, and without an interval stated the last one is taken for it.
"""

from collections.abc import Iterator, Mapping
from typing import Any, Final

import numpy as np

from app.exchange.json_values import Json
from app.exchange.si import PARAMETER_UNITS
from app.services.drift.courses import DAY, HORIZON
from app.services.drift.series import Column, SeriesTable, seconds
from solver.drift.recalibrating.in_use import Use
from solver.drift.recalibrating.interval_evidence import Check, Evidence, Findings, Outlook
from solver.drift.recalibrating.recalibration import MethodAdvice, recommend
from solver.errors import Message
from solver.records import Array

_FEWEST: Final = 2
_SHORTEST_DAYS: Final = 1.0
"""Sessions closer together are one visit to the laboratory, not an interval."""
Limits = Mapping[str, Mapping[str, float | None]]


def interval(
    table: SeriesTable, limits: Limits, stated_days: int | None, entries: Mapping[str, Json]
) -> Json:
    """The interval stated for the type, and what each method recommends.

    Parameters
    ----------
    entries
        The study's parameters.
    """
    nothing: Json = {"stated_days": stated_days, "recommended_days": None, "methods": [], "reason": None}
    limited = {
        name: (side["low"], side["high"])
        for name, side in limits.items()
        if side["low"] is not None and side["high"] is not None and entries[name]["latest"] is not None
    }
    days, used = _findings(table, limited)
    if not limited or len(days) < _FEWEST - 1:
        return nothing
    evidence = Evidence(
        days=float(stated_days or max(_SHORTEST_DAYS, round(float(days[-1])))),
        own=Findings(days, used),
        outlooks=tuple(_outlooks(entries, limited)),
        uses=tuple(_uses(table, limited)),
        checks=tuple(_checks(entries, limited)),
        horizon=HORIZON / DAY,
    )
    found = recommend(evidence)
    return {
        "stated_days": stated_days, "recommended_days": found.days, "reason": _reason(found.reason),
        "methods": [_advice(item) for item in found.methods],
    }  # fmt: skip


def _findings(table: SeriesTable, limited: Mapping[str, tuple[float, float]]) -> tuple[Array, Array]:
    """Length of each interval, days, and the share of the limits used at its end."""
    if not limited or len(table) < _FEWEST:
        return np.empty(0), np.empty(0)
    shares = [
        np.abs(table[f"{name}.value"] - 0.5 * (low + high)) / (0.5 * (high - low))
        for name, (low, high) in limited.items()
    ]
    used = np.where(np.isfinite(shares), shares, 0.0).max(axis=0)
    days = np.diff(seconds(table["measured_at"])) / DAY
    counts = days >= _SHORTEST_DAYS
    return days[counts], used[1:][counts]


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


def _advice(item: MethodAdvice) -> dict[str, Any]:
    return {
        "method": item.method, "days": None if item.days is None else round(item.days),
        "interval_of": item.interval_of, "reason": _reason(item.reason),
    }  # fmt: skip
