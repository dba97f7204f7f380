"""What of a study a person has to be told: each finding with its first and last result, and its sentence.

A finding is stated once for each episode: values that break a rule belong to one as long as no more than `GAP` values
in between do not. A step that an event explains raises nothing, but an alarm that stands goes on with it. Trends and
steps that are significant but not by much are in the study only: every new session is one more look at the same
history, so that a level which is right for one look is not for all of them.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from datetime import datetime, timedelta
from itertools import groupby
from textwrap import shorten
from typing import Any, Final

import numpy as np

from app.exchange.json_values import Json
from app.services.drift.alarms import Finding
from app.services.drift.charting import Signal
from app.services.drift.series import SeriesTable, iso, moment
from app.services.drift.views import Quantity, quantity
from app.services.verdicts import judge
from solver.drift.control.run_rules import RULES
from solver.errors import Message

GAP: Final = 3
LEVEL: Final = 0.001
"""Of the probability that chance alone makes a step or a trend, below which an alarm is raised: monthly looks over
five years then raise a false one in a few per cent of histories."""
_NOTE: Final = 120
"""Letters of an event's note in a sentence."""
AHEAD: Final = timedelta(days=365)
"""How far ahead of the last session a limit is looked for where no interval is stated."""


@dataclass(frozen=True, slots=True)
class Told:
    """A parameter's part of the study: its document entry, and the rules that it breaks."""

    name: str
    unit: str
    entry: Json
    signals: Sequence[Signal]


def findings(
    table: SeriesTable, told: Told, low: float | None, high: float | None, ahead: timedelta
) -> Iterator[Finding]:
    """Everything about one parameter that a person has to be told."""
    yield from _rules(table, told)
    yield from _steps(table, told)
    yield from _trend(table, told)
    yield from _limits(table, told, low, high)
    yield from _limit_ahead(table, told, ahead)
    yield from _repeatability(table, told)


def _rules(table: SeriesTable, told: Told) -> Iterator[Finding]:
    for (rule, baseline), signals in groupby(
        sorted(told.signals, key=lambda item: (item.rule, item.baseline, item.raised)),
        key=lambda item: (item.rule, item.baseline),
    ):
        for run in episodes(list(signals)):
            first, last = run[0], int(run[-1].places[-1])
            count = len({int(place) for item in run for place in item.places})
            values = {"unit": told.unit, "value": _at(table, told, last), "rule": rule, "count": count}
            kind = "beyond-limits" if rule == "nelson-1" else rule
            found = _finding(table, told, kind, first.raised, last, sentence(kind, count), values, baseline)
            yield replace(found, since=iso(table["measured_at"][int(first.places[0])]))


def sentence(kind: str, count: int) -> Message:
    """What is said of a rule that so many values break."""
    known = {"beyond-limits": _BEYOND if count > 1 else _BEYOND_ONE, "ewma": _EWMA, "cusum": _CUSUM}
    return known[kind] if kind in known else RULES[kind].description


def episodes(signals: Sequence[Signal]) -> list[list[Signal]]:
    """Patterns of one rule in runs: no more than `GAP` values lie between two of the same run."""
    runs: list[list[Signal]] = []
    for signal in signals:
        if runs and int(signal.places[0]) - int(runs[-1][-1].places[-1]) <= GAP + 1:
            runs[-1].append(signal)
        else:
            runs.append([signal])
    return runs


def _steps(table: SeriesTable, told: Told) -> Iterator[Finding]:
    for change in told.entry["changes"]:
        chance = change["p_value"]
        if change["kind"] != "step" or chance is None or chance > LEVEL:
            continue
        place = int(np.flatnonzero(table["calibration"] == change["calibration"])[0])
        values = {"unit": told.unit, "size": quantity(change["size"], change["u"], change=True),
                  "since": change["before"][:10], "day": change["at"][:10]}  # fmt: skip
        said, circumstances = _circumstances(change)
        found = _finding(table, told, "step", place, place, said, values | circumstances, None)
        yield replace(
            found, since=change["since"], until=change["until"], explained=change["event_kind"] is not None
        )


def _circumstances(change: Json) -> tuple[Message, dict[str, Any]]:
    """A step's sentence by what else happened then: what explains it before what only lies there."""
    if change["event_kind"] is not None:
        return _STEP_EXPLAINED, {"event": change["event_kind"], "happened": change["event_at"][:10]}
    for item in change["beside"]:
        note = shorten(item["note"], _NOTE, placeholder=" …") or "–"
        return _STEP_BESIDE[item["kind"]], {"note": note, "happened": item["at"][:10]}
    return _STEP, {}


def _trend(table: SeriesTable, told: Told) -> Iterator[Finding]:
    trend = told.entry["trend"]
    if trend is None or trend["model"] == "constant" or trend["p_value"] is None or trend["p_value"] > LEVEL:
        return
    places = table.determined(told.name)
    since = int(np.searchsorted(table["measured_at"], _moment(trend["since"])))
    values = {"unit": told.unit, "since": trend["since"][:10],
              "slope": quantity(trend["slope_per_year"], trend["u_slope_per_year"], change=True)}  # fmt: skip
    last = int(places[-1])
    found = _finding(table, told, "trend", last, last, _TREND, values, None)
    yield replace(found, since=iso(table["measured_at"][since]))


def _limits(table: SeriesTable, told: Told, low: float | None, high: float | None) -> Iterator[Finding]:
    """Values outside the limits of the type, as long as the latest one still is."""
    if low is None or high is None:
        return
    value = table[f"{told.name}.value"]
    places = table.determined(told.name)
    outside = [int(place) for place in places if judge(float(value[place]), None, low, high) == "fails"]
    if outside and outside[-1] == int(places[-1]):
        cuts = np.flatnonzero(np.diff(outside) > GAP + 1)
        first, last = outside[int(cuts[-1]) + 1 if len(cuts) else 0], outside[-1]
        values = {"unit": told.unit, "value": _at(table, told, last), "low": low, "high": high}
        yield _finding(table, told, "out-of-limits", first, last, _OUT, values, None)


def _limit_ahead(table: SeriesTable, told: Told, ahead: timedelta) -> Iterator[Finding]:
    leaving = (told.entry["forecast"] or {}).get("leaves")
    places = table.determined(told.name)
    latest = told.entry["latest"]
    if leaving is None or latest is None or latest["verdict"] == "fails":
        return
    last = int(places[-1])
    if _moment(leaving["date"]) > table["measured_at"][last] + np.timedelta64(ahead):
        return
    values = {"unit": told.unit, "limit": leaving["limit"], "day": leaving["date"][:10],
              "earliest": leaving["earliest"][:10]}  # fmt: skip
    if leaving["latest"]:
        values["latest"] = leaving["latest"][:10]
    said = ahead_of(leaving, table["measured_at"][last])
    found = _finding(table, told, "limit-ahead", last, last, said, values, None)
    yield replace(found, since=told.entry["trend"]["since"])


def ahead_of(leaving: Json, last: np.datetime64) -> Message:
    """What is said of a limit ahead, after a last value at that time: the interval's ends as far as it has them."""
    if _moment(leaving["earliest"]) <= last:
        return _AHEAD_NOW
    return _AHEAD if leaving["latest"] else _AHEAD_OPEN


def _repeatability(table: SeriesTable, told: Told) -> Iterator[Finding]:
    if told.entry["repeatability_verdict"] != "fails":
        return
    places = table.determined(told.name)
    values = {"unit": told.unit, "sd": told.entry["together"]["sd"], "low": told.entry["together"]["low"],
              "limit": told.entry["repeatability_limit"]}  # fmt: skip
    first, last = int(places[0]), int(places[-1])
    found = _finding(table, told, "repeatability", last, last, _SCATTER, values, None)
    yield replace(found, since=iso(table["measured_at"][first]))


def _at(table: SeriesTable, told: Told, place: int) -> Quantity:
    value, u, k = (float(table[f"{told.name}.{part}"][place]) for part in ("value", "u", "k"))
    return quantity(value, u, k)


def _finding(
    table: SeriesTable, told: Told, kind: str, first: int, last: int, sentence: Message,
    values: dict[str, Any], baseline: int | None,
) -> Finding:  # fmt: skip
    times = table["measured_at"]
    return Finding(
        told.name, kind, int(table["calibration"][first]), int(table["calibration"][last]), iso(times[first]),
        iso(times[last]), sentence.template, values, baseline,
    )  # fmt: skip


def _moment(text: str) -> np.datetime64:
    return moment(datetime.fromisoformat(text))


_BEYOND: Final = Message(
    "beyond-limits", "%(count)d beyond the control limits, the last at %(value)s %(unit)s."
)
_BEYOND_ONE: Final = Message("beyond-limits-one", "%(value)s %(unit)s lies beyond the control limits.")
_EWMA: Final = Message(
    "ewma", "The weighted average left its limits: the level has shifted, by little or slowly."
)
_CUSUM: Final = Message(
    "cusum", "The cumulative sum left its limits: the level has shifted, by little or slowly."
)
_STEP: Final = Message(
    "step", "A step of %(size)s %(unit)s between %(since)s and %(day)s; no event explains it."
)
_STEP_EXPLAINED: Final = Message(
    "step-explained",
    "A step of %(size)s %(unit)s between %(since)s and %(day)s; entered for that time: %(event)s, %(happened)s.",
)
_STEP_BESIDE: Final = {
    "stand": Message(
        "step-stand",
        "A step of %(size)s %(unit)s between %(since)s and %(day)s, when the gyro came to stand %(note)s.",
    ),
    "certificate": Message(
        "step-certificate",
        "A step of %(size)s %(unit)s between %(since)s and %(day)s, when its stand went over to certificate %(note)s.",
    ),
    "solver": Message(
        "step-solver",
        "A step of %(size)s %(unit)s between %(since)s and %(day)s, where solver %(note)s took over.",
    ),
    "other": Message(
        "step-note",
        "A step of %(size)s %(unit)s between %(since)s and %(day)s; the note of %(happened)s does not explain it: "
        "“%(note)s”.",
    ),
}
"""By what lies at a step's date and explains it no more than a person says."""
_TREND: Final = Message("trend", "Drifts by %(slope)s %(unit)s a year since %(since)s.")
_OUT: Final = Message("out-of-limits", "%(value)s %(unit)s lies outside the limits %(low)g to %(high)g.")
_AHEAD: Final = Message(
    "limit-ahead", "Will reach the limit %(limit)g %(unit)s about %(day)s (%(earliest)s to %(latest)s)."
)
_AHEAD_OPEN: Final = Message(
    "limit-ahead-open",
    "Will reach the limit %(limit)g %(unit)s about %(day)s (not before %(earliest)s).",
)
_AHEAD_NOW: Final = Message(
    "limit-ahead-now",
    "Will reach the limit %(limit)g %(unit)s about %(day)s; it may be there already.",
)
_SCATTER: Final = Message(
    "repeatability",
    "Scatters by %(sd).2g %(unit)s from session to session (at least %(low).2g); %(limit)g is allowed.",
)
