"""Control charts of a parameter against its frozen baselines: columns for the series, and which rules are broken.

A baseline judges the sessions from its `valid_from` up to the next one's, or to the first repair or adjustment of
the gyro after the sessions that it was made of. Those themselves stand on its charts and raise nothing. All three
charts are drawn; what raises alarms was chosen with the baseline.

What is judged is a start: the mean of its sessions, which share what it brought (`solver.drift.start_means`).
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final, cast

import numpy as np
from numpy.typing import NDArray

from app.errors import Invalid, problem
from app.exchange.json_values import Json
from app.services.drift.series import Column, SeriesTable, moment
from app.services.drift.views import BaselineView, EventView
from solver.drift.control.baseline import WIDTH, Baseline, Estimator, Limits
from solver.drift.control.charts import WEIGHT, ewma, individuals
from solver.drift.control.cusum import ALLOWANCE, DECISION, cusum
from solver.drift.control.run_rules import RULES
from solver.drift.start_means import start_means

CHARTS: Final = (
    "individuals", "individuals_centre", "individuals_low", "individuals_high", "moving_range", "moving_range_centre",
    "moving_range_high", "ewma", "ewma_centre", "ewma_low", "ewma_high", "cusum_above", "cusum_below", "cusum_high",
    "course", "u_course",
)  # fmt: skip
"""Columns that a study adds to the series, after the parameter's name: the individual value's standardised distance
from the centre, centre and control limits; the moving range with its mean and limit; the weighted average with its
limits; the cumulative sums in standard deviations with the decision interval; the course fitted, with its u. In
the parameter's unit where nothing else is said."""
DEFAULT_RULES: Final[Mapping[str, Any]] = {
    "individuals": ["nelson-1"],
    "ewma": {"weight": WEIGHT, "width": WIDTH},
}
"""A large change at once, and a small one that lasts."""
_SETTINGS: Final[Mapping[str, Mapping[str, float]]] = {
    "ewma": {"weight": WEIGHT, "width": WIDTH},
    "cusum": {"allowance": ALLOWANCE, "decision": DECISION},
}
LARGEST_SETTING: Final = 1000.0
_ENDING: Final = frozenset({"repair", "adjustment"})


@dataclass(frozen=True, slots=True)
class Signal:
    """A rule broken: its code, the baseline, the pattern's places in the table, and the one that completed it."""

    rule: str
    baseline: int
    places: NDArray[np.int64]
    raised: int


@dataclass(frozen=True, slots=True)
class Charts:
    """A parameter's charts.

    Attributes
    ----------
    columns
        For the series, with the parameter's name before them.
    signals
        The rules broken, one for each pattern.
    status
        in-control, beyond-control or no-baseline, by the latest value.
    document
        For the study's document: which baseline judges now, and by what.
    """

    columns: dict[str, Column]
    signals: tuple[Signal, ...]
    status: str
    document: Json | None


def checked(rules: Mapping[str, Any]) -> dict[str, Any]:
    """Rules as a baseline keeps them: ``individuals`` a list of run rules, ``ewma`` and ``cusum`` their settings.

    A setting that is not given is the product's own.

    Raises
    ------
    Invalid
        A chart, a rule or a setting that there is not, or a setting that is not a number.
    """
    _among(rules, ("individuals", *_SETTINGS))
    kept: dict[str, Any] = {}
    if "individuals" in rules:
        codes = rules["individuals"]
        if not isinstance(codes, list):
            raise _unusable("individuals")
        _among(codes, tuple(RULES))
        kept["individuals"] = list(dict.fromkeys(codes))
    for chart, settings in _SETTINGS.items():
        if chart in rules:
            if not isinstance(rules[chart], dict):
                raise _unusable(chart)
            _among(rules[chart], tuple(settings))
            kept[chart] = {
                name: _number(rules[chart].get(name, value), name) for name, value in settings.items()
            }
    return kept


def _among(names: Iterable[Any], known: Sequence[str]) -> None:
    for name in names:
        if name not in known:
            raise Invalid(problem("unknown-rule", "There is no rule “%(name)s”; choose among %(names)s.",
                                  column="rules", name=str(name), names=", ".join(known)))  # fmt: skip


def _number(value: Any, name: str) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float) or not 0.0 < value < LARGEST_SETTING:
        raise _unusable(name)
    if name == "weight" and value > 1.0:
        raise _unusable(name)
    return float(value)


def _unusable(name: str) -> Invalid:
    return Invalid(
        problem("bad-rule", "The setting “%(name)s” of the rules cannot be used.", column="rules", name=name)
    )


def no_columns(table: SeriesTable, parameter: str) -> dict[str, Column]:
    """Columns where there is nothing to show."""
    empty: dict[str, Column] = {f"{parameter}.{name}": np.full(len(table), np.nan) for name in CHARTS}
    return empty | {f"{parameter}.signals": np.full(len(table), "", object)}


def charts(
    table: SeriesTable, parameter: str, baselines: Sequence[BaselineView], events: Sequence[EventView]
) -> Charts:
    """Chart a parameter against its baselines; `events` are those that people entered."""
    columns = no_columns(table, parameter)
    signals: list[Signal] = []
    judged = list(_judged(table, parameter, baselines, events))
    for view, places in judged:
        signals += _drawn(table, parameter, view, places, columns)
    said = columns[f"{parameter}.signals"]
    for signal in signals:
        for place in signal.places:
            said[place] = f"{said[place]} {signal.rule}".lstrip()
    last = int(table.determined(parameter)[-1])
    now = next((view for view, places in judged if last in places), None)
    status = "no-baseline" if now is None else "beyond-control" if said[last] else "in-control"
    return Charts(columns, tuple(signals), status, None if now is None else _document(now, table))


def _judged(
    table: SeriesTable, parameter: str, baselines: Sequence[BaselineView], events: Sequence[EventView]
) -> Iterator[tuple[BaselineView, NDArray[np.int64]]]:
    """Each baseline with the places that it is drawn over."""
    ordered = sorted(baselines, key=lambda item: (item.valid_from, item.id))
    places = table.determined(parameter)
    times = table["measured_at"][places]
    for number, view in enumerate(ordered):
        chosen = times[np.isin(table["session"][places], view.sessions)]
        made = max([moment(view.valid_from), *chosen[-1:]])
        ends = [moment(item.at) for item in events if item.gyro is not None and item.kind in _ENDING]
        ends = [end for end in ends if end > made] + [
            moment(item.valid_from) for item in ordered[number + 1 :]
        ]
        here = times >= moment(view.valid_from)
        for end in ends:
            here &= times < end
        if here.any():
            yield view, places[here]


def of_view(view: BaselineView) -> Baseline:
    """The baseline as the solver knows it, from the numbers that were kept."""
    return Baseline(
        view.centre, view.scatter, view.dof, view.count, cast(Estimator, view.estimator), view.u_typical
    )


def _drawn(
    table: SeriesTable,
    parameter: str,
    view: BaselineView,
    places: NDArray[np.int64],
    columns: Mapping[str, Column],
) -> Iterator[Signal]:
    """Draw the three charts of one baseline; the rules broken that were chosen with it."""
    kept, limits = of_view(view), cast(Limits, view.limits)
    means = start_means(table.rows(places).history(parameter), view.within)
    history = means.history
    new = np.bincount(means.member, np.isin(table["session"][places], view.sessions)) == 0.0
    single = individuals(history, kept, limits, view.rules.get("individuals", ()), new)
    average = ewma(history, kept, **view.rules.get("ewma", _SETTINGS["ewma"]), limits=limits, judged=new)
    sums = cusum(history, kept, **view.rules.get("cusum", _SETTINGS["cusum"]), limits=limits, judged=new)
    drawn = {
        "individuals": single.z, "individuals_centre": kept.centre, "individuals_low": single.lower,
        "individuals_high": single.upper, "moving_range": single.moving_range,
        "moving_range_centre": single.mean_range, "moving_range_high": single.range_limit,
        "ewma": average.statistic, "ewma_centre": kept.centre, "ewma_low": average.lower, "ewma_high": average.upper,
        "cusum_above": sums.up, "cusum_below": sums.down, "cusum_high": sums.decision,
    }  # fmt: skip
    for name, column in drawn.items():
        columns[f"{parameter}.{name}"][places] = np.broadcast_to(np.asarray(column), len(history))[
            means.member
        ]
    for found, chosen in (
        (single.violations, True), (average.violations, "ewma" in view.rules), (sums.violations, "cusum" in view.rules),
    ):  # fmt: skip
        if chosen:
            for item in found:
                shown = (means.member >= item.first) & (means.member <= item.last)
                yield Signal(item.rule, view.id, places[shown], int(places[means.first[item.raised]]))


def _document(view: BaselineView, table: SeriesTable) -> Json:
    """What judges now, and which of its results have been replaced since."""
    gone = sorted(set(view.calibrations) - set(table["calibration"].tolist()))
    return {
        "baseline": view.id, "centre": view.centre, "scatter": view.scatter, "dof": view.dof,
        "u_typical": view.u_typical, "within": view.within, "count": view.count, "estimator": view.estimator,
        "limits": view.limits, "rules": dict(view.rules), "valid_from": view.valid_from.isoformat(),
        "replaced": gone,
    }  # fmt: skip
