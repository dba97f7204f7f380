"""Control charts of values that each have an uncertainty of their own, against a frozen baseline.

Every chart takes the values to be judged and a `baseline.Baseline`, and the kind of limits (see there).
Points not to be judged, those of the baseline itself say, get their limits and z, but raise nothing and are in no
run or average. A repair ends a baseline: values after it are judged by the next one, in another call.

Individuals and moving range
    NIST/SEMATECH e-Handbook of Statistical Methods, 6.3.2.2.
EWMA
    ``Z_i = λ·x_i + (1 − λ)·Z_{i−1}``, Z_0 the centre c (e-Handbook, 6.3.2.4). With variances V_i of their own::

        var Z_i = λ²·V_i + (1 − λ)²·var Z_{i−1},   var Z_0 = 0

    which for equal V_i is the exact ``V·λ/(2 − λ)·(1 − (1 − λ)^{2i})``. Prediction limits add what the centre's error
    does to all alike, ``(1 − (1 − λ)^i)²·u²(c)``: the weights in Z_i − c sum to 1 − (1 − λ)^i.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import accumulate
from typing import Final

import numpy as np
from numpy.typing import NDArray

from solver.drift.control.baseline import D2, D4, WIDTH, Baseline, Limits
from solver.drift.control.run_rules import Mask, Violation, episodes, violations
from solver.drift.history import History
from solver.errors import InputError, Message
from solver.records import Array

WEIGHT: Final = 0.2
"""λ of an EWMA, unless told otherwise."""


@dataclass(frozen=True, slots=True)
class Individuals:
    """Individuals and moving range; in the quantity's unit but z.

    Attributes
    ----------
    z : (n,) array
        Standardised values: beyond ±3 exactly outside the limits.
    lower, upper : (n,) array
        Control limits of each point.
    violations
        Of the rules asked for.
    moving_range : (n,) array
        Of each point and the one before; NaN for the first.
    mean_range, range_limit : (n,) array
        Centre line and upper limit of the moving range.
    ranges_beyond : (n,) bool array
        Moving ranges above their limit.

    A range of two values of unequal V is expected as if both had their mean.
    """

    z: Array
    lower: Array
    upper: Array
    violations: tuple[Violation, ...]
    moving_range: Array
    mean_range: Array
    range_limit: Array
    ranges_beyond: Mask

    @property
    def signals(self) -> Mask:
        """Points that are in a violation, (n,)."""
        within = np.zeros(len(self.z), np.bool_)
        for item in self.violations:
            within[item.first : item.last + 1] = True
        return within


@dataclass(frozen=True, slots=True)
class Ewma:
    """Exponentially weighted moving average, in the quantity's unit.

    Attributes
    ----------
    z : (n,) array
        Standardised values of the points themselves.
    statistic, lower, upper : (n,) array
        The average after each point and its limits; NaN where a point is not judged.
    signals : (n,) bool array
        Average outside its limits.
    violations
        Of the rule ``ewma``, one for each stretch outside.
    """

    z: Array
    statistic: Array
    lower: Array
    upper: Array
    signals: Mask
    violations: tuple[Violation, ...]


def individuals(
    history: History,
    baseline: Baseline,
    limits: Limits = "prediction",
    rules: Sequence[str] = ("nelson-1",),
    judged: Mask | None = None,
) -> Individuals:
    """Chart single values and their moving ranges.

    Parameters
    ----------
    history
        The values, n of them.
    baseline
        What they are judged by.
    limits
        prediction or three-sigma.
    rules
        Codes of `solver.drift.control.run_rules.RULES`.
    judged : (n,) bool array, optional
        Which points to judge; all if not given.

    Raises
    ------
    InputError
        When there is no such rule.
    """
    where = judged_points(history, judged)
    variance = baseline.variance(history.u)
    half = baseline.half_width(history.u, limits)
    z = baseline.standardised(history.value, history.u, limits)
    pair = np.append(np.nan, np.sqrt((variance[1:] + variance[:-1]) / 2.0))
    ranges = np.append(np.nan, np.abs(np.diff(history.value)))
    with_previous = np.append(False, where[1:] & where[:-1])
    return Individuals(
        z=z,
        lower=baseline.centre - half,
        upper=baseline.centre + half,
        violations=violations(np.where(where, z, np.nan), rules),
        moving_range=ranges,
        mean_range=D2 * pair,
        range_limit=D4 * D2 * pair,
        ranges_beyond=with_previous & (ranges > D4 * D2 * pair),
    )


def ewma(
    history: History,
    baseline: Baseline,
    weight: float = WEIGHT,
    width: float = WIDTH,
    limits: Limits = "prediction",
    *,
    asymptotic: bool = False,
    judged: Mask | None = None,
) -> Ewma:
    """Chart an exponentially weighted moving average.

    Parameters
    ----------
    history, baseline, limits, judged
        As of `individuals`.
    weight
        λ, above 0 and not above 1; 1 makes it the chart of individuals.
    width
        Half width of the limits in standard deviations of the average.
    asymptotic
        Limits as after many values from the first one on, as in many a textbook; of the values' own variances.

    Raises
    ------
    InputError
        When weight or width is out of range.
    """
    if not (0.0 < weight <= 1.0 and width > 0.0):
        raise InputError(_EWMA_RANGE)
    where = judged_points(history, judged)
    chosen = history[where]
    average = _decaying(weight, 1.0 - weight, chosen.value - baseline.centre)
    half = _half_widths(chosen, baseline, weight, width, limits, asymptotic=asymptotic)
    beyond = np.where(np.abs(average) > half, np.sign(average), 0.0)
    found = [item for side in (1, -1) for item in runs("ewma", beyond == side, None, where, side)]
    return Ewma(
        z=baseline.standardised(history.value, history.u, limits),
        statistic=placed(where, baseline.centre + average),
        lower=placed(where, baseline.centre - half),
        upper=placed(where, baseline.centre + half),
        signals=placed(where, np.abs(beyond)) == 1.0,
        violations=in_order(found),
    )


def judged_points(history: History, judged: Mask | None) -> Mask:
    """Which points to judge, (n,): all if nothing is said."""
    return np.ones(len(history), np.bool_) if judged is None else np.asarray(judged, np.bool_)


def _decaying(weight: float, keep: float, values: Array) -> Array:
    """``y_i = weight·x_i + keep·y_{i−1}``, y before the first 0, (n,)."""
    weighted = (weight * values).tolist()
    return np.array([*accumulate(weighted, lambda before, new: keep * before + new, initial=0.0)][1:])


def _half_widths(
    history: History, baseline: Baseline, weight: float, width: float, limits: Limits, *, asymptotic: bool
) -> Array:
    """Distance of an average's limits from the centre after each value, (n,)."""
    keep = 1.0 - weight
    own, ones = baseline.known(history.u), np.ones(len(history))
    if asymptotic:
        share, common = weight / (2.0 - weight) * ones, ones
        own = share * own
    else:
        share, own = _decaying(weight**2, keep**2, ones), _decaying(weight**2, keep**2, own)
        common = np.square(1.0 - keep ** np.arange(1.0, len(history) + 1.0))
    if limits == "three-sigma":
        return np.asarray(width * np.sqrt(share * baseline.scatter**2 + own))
    share = share + common / baseline.count
    own = own + common * baseline.u_typical**2 / baseline.count
    return baseline.prediction().bound(width, share, own)


def runs(rule: str, met: Mask, start: NDArray[np.int64] | None, where: Mask, side: int) -> list[Violation]:
    """Violations among the points judged, by the indices of all points."""
    place = np.flatnonzero(where)
    begins = np.arange(len(met)) if start is None else start
    return [
        Violation(rule, int(place[item.first]), int(place[item.last]), int(place[item.raised]), side)
        for item in episodes(met, begins, rule, side)
    ]


def placed(where: Mask, values: Array) -> Array:
    """Values of the points judged at their places among all, NaN at the others."""
    all_of_them = np.full(len(where), np.nan)
    all_of_them[where] = values
    return all_of_them


def in_order(found: list[Violation]) -> tuple[Violation, ...]:
    """Violations as they were raised."""
    return tuple(sorted(found, key=lambda item: item.raised))


_EWMA_RANGE: Final = Message(
    "ewma-range", "The weight of an EWMA is above 0 and not above 1, the width of its limits above 0."
)
