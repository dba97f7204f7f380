"""What a baseline would be before it is frozen, and how often the charts of one raise a false alarm."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, cast

import numpy as np

from app.exchange.si import PARAMETER_UNITS
from app.services.drift import baselines, charting, series
from app.services.drift.series import SeriesTable
from app.services.drift.views import BaselineView
from app.services.lab import Work
from app.services.lookup import find_gyro
from solver.drift.control import false_alarms
from solver.drift.control.baseline import WIDTH, Baseline, Estimator, Limits
from solver.drift.control.false_alarms import Chances
from solver.drift.start_means import start_means


@dataclass(frozen=True, slots=True)
class Preview:
    """What a parameter would be judged by.

    Attributes
    ----------
    centre, scatter, dof
        As the frozen baseline would have them.
    low, high
        Control limits of a value as uncertain as the baseline's are typically.
    count
        Starts among the sessions chosen that determined the parameter.
    judged, beyond
        Starts since the first one chosen that would be judged, and how many of them lie beyond their limits.
    """

    parameter: str
    unit: str
    centre: float
    scatter: float
    dof: float
    low: float
    high: float
    count: int
    judged: int
    beyond: int


@dataclass(frozen=True, slots=True)
class Previewed:
    """A baseline for several parameters, and the false alarms of its charts for each of them."""

    parameters: tuple[Preview, ...]
    chances: Chances


def preview(
    work: Work,
    serial: str,
    parameters: Sequence[str],
    calibrations: Sequence[int],
    *,
    method: str = "least-squares",
    estimator: str = "paule-mandel",
    limits: str = "prediction",
    rules: Mapping[str, Any] | None = None,
) -> Previewed:
    """Compute what `baselines.freeze` would keep, and keep nothing.

    Raises
    ------
    Invalid
        As `baselines.freeze`.
    """
    kept = charting.checked(charting.DEFAULT_RULES if rules is None else rules)
    baselines.check(parameters, estimator, limits)
    table = series.load(work, find_gyro(work, serial).id, method)
    chosen = baselines.chosen(table, calibrations)
    made = {name: baselines.numbers(chosen, name, estimator) for name in parameters}
    kind = cast(Limits, limits)
    found = tuple(_preview(table, chosen, name, line, kind) for name, line in made.items())
    # One statement for all parameters: their degrees of freedom hardly differ, and each costs a second.
    typical = sorted(made.values(), key=lambda line: float(line["dof"]))[len(made) // 2]
    return Previewed(found, _expected(_baseline(typical), kind, kept))


def chances(view: BaselineView) -> Chances:
    """How often the charts of a frozen baseline raise a false alarm."""
    return _expected(charting.of_view(view), cast(Limits, view.limits), view.rules)


def _baseline(kept: Mapping[str, Any]) -> Baseline:
    return Baseline(
        kept["centre"], kept["scatter"], kept["dof"], kept["count"], cast(Estimator, kept["estimator"]),
        kept["u_typical"],
    )  # fmt: skip


def _preview(
    table: SeriesTable, chosen: SeriesTable, name: str, kept: Mapping[str, Any], limits: Limits
) -> Preview:
    line = _baseline(kept)
    half = float(line.half_width(line.u_typical, limits))
    judged = table.rows(
        (table["measured_at"] >= chosen["measured_at"][0])
        & ~np.isin(table["calibration"], chosen["calibration"])
    )
    later = start_means(judged.history(name), kept["within"]).history
    z = line.standardised(later.value, later.u, limits)
    return Preview(
        name, PARAMETER_UNITS[name][0], line.centre, line.scatter, line.dof, line.centre - half, line.centre + half,
        line.count, len(later), int(np.count_nonzero(np.abs(z) > WIDTH)),
    )  # fmt: skip


def _expected(line: Baseline, limits: Limits, rules: Mapping[str, Any]) -> Chances:
    ewma, cusum = rules.get("ewma"), rules.get("cusum")
    return false_alarms.expected(
        line, limits, rules=tuple(rules.get("individuals", ())),
        ewma=None if ewma is None else (ewma["weight"], ewma["width"]),
        cusum=None if cusum is None else (cusum["allowance"], cusum["decision"]),
    )  # fmt: skip
