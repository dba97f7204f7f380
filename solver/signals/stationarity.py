"""Does a record stay what it is: warm-up slope, and the first half against the second.

The slope is that of ordinary least squares; with W = Σ(tᵢ − t̄)² its variance is λ²/W, where λ² is the
power of the slow fluctuations (n·u² of a mean), not the variance of a sample. It is measured by the
slow cosines of `solver.signals.noise` on what the straight line leaves over, from the second one on, because
the line has taken nearly all of the first (96/π⁴ = 98.6 % of a line's power), with as many degrees
of freedom as cosines.

The halves' means are compared by Welch's test with the uncertainties of `mean_with_uncertainty`, which
allow for correlation; their variances by the logarithm of their ratio, whose uncertainty comes from the
means of the squared deviations in the same way, so that it allows for correlation and for a
distribution that is not normal.
"""

from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy import special

from solver.errors import InputError, Message
from solver.signals.noise import (
    Array,
    Mean,
    checked,
    checked_interval,
    is_constant,
    mean_with_uncertainty,
    slow_cosines,
)

FEWEST: Final = 128
"""Samples that both halves need to be judged for correlation themselves."""
UNLIKELY: Final = 0.01
"""Level of the verdict on a record, shared by its tests (Bonferroni): a session has dozens of records."""


class Tested(NamedTuple):
    """A value with its standard uncertainty and degrees of freedom, tested against zero, two-sided.

    The unit is the samples' (a slope's: per second); a ratio of variances is given as its logarithm.
    """

    value: float
    standard_uncertainty: float
    dof: float
    p_value: float


@dataclass(frozen=True, slots=True)
class Stationarity:
    """Three tests of one record.

    Attributes
    ----------
    slope
        Of the record, unit of the samples per second.
    mean_step
        Mean of the second half less that of the first.
    log_variance_ratio
        ln(variance of the second half / variance of the first).
    duration
        Of the record, s.
    """

    slope: Tested
    mean_step: Tested
    log_variance_ratio: Tested
    duration: float

    @property
    def p_value(self) -> float:
        """Smallest of the three, times three (Bonferroni), at most 1."""
        least = min(self.slope.p_value, self.mean_step.p_value, self.log_variance_ratio.p_value)
        return min(1.0, 3.0 * least)

    @property
    def finding(self) -> Message:
        """What to think of the record, in one sentence."""
        if self.p_value >= UNLIKELY:
            return Message(
                "steady", "The record is steady: no slope, step or change of its noise beyond chance."
            )
        if self.slope.p_value <= self.mean_step.p_value and 3.0 * self.slope.p_value < UNLIKELY:
            return Message(
                "slope", "The current drifts: wait until the gyro has warmed up, or take the position again."
            )
        if 3.0 * self.mean_step.p_value < UNLIKELY:
            return Message(
                "step", "The current changes between the halves of the record: take the position again."
            )
        return Message(
            "noise-changes",
            "The noise of the second half differs from that of the first: look at the record.",
        )


def stationarity(samples: ArrayLike, interval: float) -> Stationarity | None:
    """Test a record; None when the samples of a half are all equal, so that nothing can be said.

    Parameters
    ----------
    samples : (n,) array_like
        At least 128 evenly sampled values.
    interval
        Between samples, s.

    Raises
    ------
    InputError
        With too few samples, one that is not finite, or an interval that is not positive.
    """
    values = checked(samples)
    if len(values) < FEWEST:
        raise InputError(
            Message("too-few-samples", "A test for drift needs at least %(n)d samples.", {"n": FEWEST})
        )
    checked_interval(interval)
    middle = len(values) // 2
    halves = values[:middle], values[middle:]
    if any(is_constant(half) for half in halves):
        return None
    first, second = (mean_with_uncertainty(half) for half in halves)
    return Stationarity(
        slope=_slope(values, interval),
        mean_step=_difference(first, second),
        log_variance_ratio=_difference(*(_log_variance(half) for half in halves)),
        duration=len(values) * interval,
    )


def _slope(values: Array, interval: float) -> Tested:
    n = len(values)
    place = np.arange(n) - (n - 1) / 2.0
    weight = float(np.sum(place * place))
    centred = values - np.mean(values)
    slope = float(np.sum(place * centred)) / weight
    slow = slow_cosines(centred - slope * place, first=1)
    u = float(np.sqrt(np.mean(slow) / weight))
    return _test(slope / interval, u / interval, float(len(slow)))


def _log_variance(half: Array) -> Mean:
    """Logarithm of the variance, with its uncertainty to first order."""
    squares = mean_with_uncertainty((half - np.mean(half)) ** 2)
    return squares._replace(
        value=float(np.log(squares.value)), standard_uncertainty=squares.standard_uncertainty / squares.value
    )


def _difference(first: Mean, second: Mean) -> Tested:
    """Welch's test; degrees of freedom by Welch and Satterthwaite (JCGM 100, G.4)."""
    variances = np.array([first.standard_uncertainty, second.standard_uncertainty]) ** 2
    total = float(np.sum(variances))
    if total == 0.0:  # Squares of two values that lie alike on both sides of their mean.
        return Tested(second.value - first.value, 0.0, 0.0, 1.0)
    parts = [v**2 / m.dof for v, m in zip(variances, (first, second), strict=True) if m.dof > 0.0]
    return _test(second.value - first.value, total**0.5, total**2 / float(np.sum(parts)))


def _test(value: float, u: float, dof: float) -> Tested:
    p_value = 2.0 * float(special.stdtr(dof, -abs(value) / u)) if u else 1.0
    return Tested(value, u, dof, p_value)
