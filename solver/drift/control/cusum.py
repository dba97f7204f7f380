"""CUSUM charts: cumulative sums of standardised values, that find small shifts and say when they began.

Tabular, both sides (NIST/SEMATECH e-Handbook of Statistical Methods, 6.3.2.3; D. C. Montgomery, Introduction to
Statistical Quality Control, 9.1)::

    C⁺_i = max(0, C⁺_{i−1} + z_i − k),   C⁻_i = max(0, C⁻_{i−1} − z_i − k)

A sum above the decision interval h says that the mean has shifted; it did so after the sum was last 0. Nothing is
reset after a signal. With prediction limits z is standard normal whatever the baseline; but what errors of the
baseline's centre add to all z alike stays in the sums: `false_alarms` says how many alarms that costs.
"""

from dataclasses import dataclass
from typing import Final

import numpy as np

from solver.drift.control.baseline import Baseline, Limits
from solver.drift.control.charts import in_order, judged_points, placed, runs
from solver.drift.control.run_rules import Mask, Violation
from solver.drift.history import History
from solver.errors import InputError, Message
from solver.records import Array

ALLOWANCE: Final = 0.5
"""k, unless told otherwise: half of the shift to be found, in standard deviations."""
DECISION: Final = 5.0
"""h, unless told otherwise."""


@dataclass(frozen=True, slots=True)
class Shift:
    """What a CUSUM found.

    Attributes
    ----------
    violation
        Of the rule ``cusum``: from the first point after the shift to the last one above the decision interval.
    size, u
        Estimated shift of the mean over these points, in the quantity's unit, and its standard uncertainty (that of
        the centre included).
    """

    violation: Violation
    size: float
    u: float


@dataclass(frozen=True, slots=True)
class Cusum:
    """Cumulative sums of standardised values, both sides.

    Attributes
    ----------
    z : (n,) array
        Standardised values.
    up, down : (n,) array
        C⁺ and C⁻, standard deviations, not below 0; NaN where a point is not judged.
    decision
        h: a sum above it signals.
    signals : (n,) bool array
        A sum above the decision interval.
    shifts
        One for each stretch of a sum above it.
    """

    z: Array
    up: Array
    down: Array
    decision: float
    signals: Mask
    shifts: tuple[Shift, ...]

    @property
    def violations(self) -> tuple[Violation, ...]:
        """Of the rule ``cusum``."""
        return tuple(shift.violation for shift in self.shifts)


def cusum(
    history: History,
    baseline: Baseline,
    allowance: float = ALLOWANCE,
    decision: float = DECISION,
    limits: Limits = "prediction",
    judged: Mask | None = None,
) -> Cusum:
    """Chart cumulative sums of standardised values.

    Parameters
    ----------
    history, baseline, limits, judged
        As of `individuals`.
    allowance, decision
        k, not negative, and h, positive, in standard deviations.

    Raises
    ------
    InputError
        When allowance or decision is out of range.
    """
    if not (allowance >= 0.0 and decision > 0.0):
        raise InputError(_CUSUM_RANGE)
    where = judged_points(history, judged)
    z = baseline.standardised(history.value, history.u, limits)
    up, down = (_cumulated(side * z[where] - allowance) for side in (1.0, -1.0))
    found = []
    for side, total in ((1, up), (-1, down)):
        index = np.arange(len(total))
        # A sum of 0 belongs to the state before the shift.
        start = np.maximum.accumulate(np.where(total > 0.0, 0, index + 1))
        found += runs("cusum", total > decision, start, where, side)
    return Cusum(
        z=z,
        up=placed(where, up),
        down=placed(where, down),
        decision=decision,
        signals=placed(where, np.maximum(up, down)) > decision,
        shifts=tuple(_shift(item, history, baseline, where) for item in in_order(found)),
    )


def _cumulated(steps: Array) -> Array:
    """``S_i = max(0, S_{i−1} + x_i)``, (n,): the sum, less its lowest value so far where that is below 0."""
    total = np.cumsum(steps)
    return np.asarray(total - np.minimum(np.minimum.accumulate(total), 0.0))


def _shift(violation: Violation, history: History, baseline: Baseline, where: Mask) -> Shift:
    since = slice(violation.first, violation.last + 1)
    since_then = history[since][where[since]]
    weight = 1.0 / baseline.variance(since_then.u)
    total = float(weight.sum())
    size = float(weight @ (since_then.value - baseline.centre)) / total
    return Shift(violation, size, float(np.hypot(total**-0.5, baseline.u_centre)))


_CUSUM_RANGE: Final = Message(
    "cusum-range", "The allowance of a CUSUM is not negative, its decision interval above 0."
)
