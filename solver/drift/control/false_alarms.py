"""How often a chart raises a false alarm, when what it judges by was itself estimated from few values.

The rate is that of alarms per value of a quantity in control, when counting begins anew after each: 1/ARL. A baseline
of n values errs in its centre and in its scatter, and all values after it are judged with the same error: given δ =
(centre − µ)/σ and r = σ̂/σ the values are independent again, so that `run_length` gives the rate, and the
chart's stated rate is its mean over the baselines that might have been::

    rate = E 1/ARL(δ, r),   δ ~ N(0, 1/n),   r² ~ χ²_ν/ν

The mean of the rates, not of the run lengths: a baseline that happened to be wide has an ARL of millions, and would
speak for all the others. So 1/rate is the number of values in which one false alarm is to be expected. For single
values outside prediction limits it is 370 whatever n (`solver.drift.control.baseline`).

With values of known uncertainty (paule-mandel) the true rate is lower: what is known of V cannot be wrong.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Final

import numpy as np
from scipy import special

from solver.drift.control import run_length
from solver.drift.control.baseline import Baseline, Limits, c4
from solver.errors import InputError, Message
from solver.records import Array

_DELTAS: Final = 10
_RATIOS: Final = 24
_CUT: Final = 1e-8
"""Probability beyond the range of the mean over r, on each side."""
_FARTHEST: Final = 5.5
"""Range of the mean over δ, in its standard deviations."""
_FASTEST: Final = 1e-3
"""Limits of an EWMA that differ by less from their last value are that."""


@dataclass(frozen=True, slots=True)
class Chances:
    """False alarms per value, of each chart chosen and of all; 0 for a chart that is not.

    Attributes
    ----------
    individuals, ewma, cusum
        Alarms per value in control.
    """

    individuals: float
    ewma: float
    cusum: float

    @property
    def rate(self) -> float:
        """Of all charts together at most: alarms that two of them raise count twice."""
        return self.individuals + self.ewma + self.cusum

    @property
    def values_between(self) -> float:
        """Values in which one false alarm is to be expected; infinite where no chart is chosen."""
        return 1.0 / self.rate if self.rate > 0.0 else float("inf")


def expected(
    baseline: Baseline | None,
    limits: Limits = "prediction",
    *,
    rules: Sequence[str] = (),
    ewma: tuple[float, float] | None = None,
    cusum: tuple[float, float] | None = None,
) -> Chances:
    """State the rate of false alarms of the charts chosen.

    Parameters
    ----------
    baseline
        What they judge by; None for centre and scatter that are known.
    limits
        prediction or three-sigma.
    rules
        Run rules of the chart of individuals, codes of `solver.drift.control.run_rules.RULES`.
    ewma
        Weight λ and width L.
    cusum
        Allowance k and decision interval h.

    Raises
    ------
    InputError
        When there is no such rule, or a setting is out of range.
    """
    if ewma is not None and not (0.0 < ewma[0] <= 1.0 and ewma[1] > 0.0):
        raise InputError(_RANGE)
    if cusum is not None and not (cusum[0] >= 0.0 and cusum[1] > 0.0):
        raise InputError(_RANGE)
    # To a quarter of a degree of freedom: it makes no difference, and many baselines share a result.
    key = (0, 0.0, limits, False) if baseline is None else (
        baseline.count, max(1.0, round(4.0 * baseline.dof) / 4.0), limits, baseline.estimator == "moving-range",
    )  # fmt: skip
    return Chances(
        individuals=_of_rules(tuple(rules), *key) if rules else 0.0,
        ewma=_of_ewma(*ewma, *key) if ewma is not None else 0.0,
        cusum=_of_cusum(*cusum, *key) if cusum is not None else 0.0,
    )


@dataclass(frozen=True, slots=True)
class _Cases:
    """Baselines that might have been: their errors (q,), their weights, and what their limits are made with."""

    delta: Array
    ratio: Array
    weight: Array
    count: int
    dof: float
    limits: Limits

    def mean(self, lengths: Array) -> float:
        """Mean rate."""
        return float(self.weight @ np.maximum(1.0 / lengths, 0.0))

    def quantile(self, width: Array) -> Array:
        """Distance of a line at `width` from the centre, in estimated standard deviations of what is judged."""
        if self.limits == "three-sigma" or not self.count:
            return width
        # From the lower tail, which keeps its digits.
        return np.asarray(-np.sign(width) * special.stdtrit(self.dof, special.ndtr(-np.abs(width))))

    def centre_share(self) -> float:
        """What the centre's error adds to the variance of a value, in V."""
        return 1.0 / self.count if self.limits == "prediction" and self.count else 0.0


def _cases(count: int, dof: float, limits: Limits, moving_range: bool) -> _Cases:
    if not count:
        one = np.ones(1)
        return _Cases(np.zeros(1), one, one, 0, np.inf, limits)
    nodes, weights = np.polynomial.legendre.leggauss(_DELTAS)
    # Rates are even in δ.
    standard = _FARTHEST / 2.0 * (nodes + 1.0)
    of_delta = weights * np.exp(-np.square(standard) / 2.0)
    half = dof / 2.0
    nodes, weights = np.polynomial.legendre.leggauss(_RATIOS)
    # By √r: with few degrees of freedom much depends on how often r is near 0.
    low, high = (
        (special.gammaincinv(half, _CUT) / half) ** 0.25,
        (special.gammainccinv(half, _CUT) / half) ** 0.25,
    )
    root = low + (high - low) / 2.0 * (nodes + 1.0)
    ratio = np.square(root)
    # The density over its value at 1, where it is of the size of its maximum.
    of_ratio = weights * root / ratio * np.exp(half * (2.0 * np.log(ratio) - np.square(ratio) + 1.0))
    weight = np.outer(of_delta / of_delta.sum(), of_ratio / of_ratio.sum()).ravel()
    unbias = c4(dof) if moving_range and limits == "three-sigma" else 1.0
    delta = np.repeat(standard / np.sqrt(count), _RATIOS)
    return _Cases(delta, np.tile(ratio / unbias, _DELTAS), weight, count, dof, limits)


@lru_cache(maxsize=256)
def _of_rules(rules: tuple[str, ...], count: int, dof: float, limits: Limits, moving_range: bool) -> float:
    cases = _cases(count, dof, limits, moving_range)
    factor = cases.ratio * np.sqrt(1.0 + cases.centre_share())
    zones = run_length.of_rules(rules, lambda width: cases.quantile(np.full(1, width)) * factor, cases.delta)
    # Nothing tells a trend from another by where the baseline is.
    return cases.mean(zones) + 1.0 / run_length.of_orders(tuple(sorted(rules)))


@lru_cache(maxsize=256)
def _of_ewma(
    weight: float, width: float, count: int, dof: float, limits: Limits, moving_range: bool
) -> float:
    cases = _cases(count, dof, limits, moving_range)
    keep = 1.0 - weight
    steps = 1 if weight == 1.0 else int(np.ceil(np.log(_FASTEST) / np.log(keep)))
    left = keep ** np.arange(1.0, steps + 1.0)
    variance = weight / (2.0 - weight) * (1.0 - left**2) + cases.centre_share() * (1.0 - left) ** 2
    reach = cases.quantile(np.full(1, width)) * np.outer(np.sqrt(variance), cases.ratio)
    return cases.mean(run_length.of_ewma(weight, reach, cases.delta))


@lru_cache(maxsize=256)
def _of_cusum(
    allowance: float, decision: float, count: int, dof: float, limits: Limits, moving_range: bool
) -> float:
    cases = _cases(count, dof, limits, moving_range)
    factor = cases.ratio * np.sqrt(1.0 + cases.centre_share())

    def slope(z: Array) -> Array:
        if limits == "three-sigma" or not count:
            return np.broadcast_to(factor, (*z.shape[:-1], len(factor)))
        quantile = cases.quantile(z)
        log = special.gammaln((dof + 1.0) / 2.0) - special.gammaln(dof / 2.0) - np.log(dof / 2.0) / 2.0
        # dt/dz of two quantiles of one probability: the ratio of the densities φ(z) and t_ν(t).
        density = -np.square(z) / 2.0 - log + (dof + 1.0) / 2.0 * np.log1p(np.square(quantile) / dof)
        return np.asarray(np.exp(density) * factor)

    lengths = run_length.of_cusum(
        allowance, decision, lambda z: cases.quantile(z) * factor, slope, cases.delta
    )
    return cases.mean(lengths)


_RANGE: Final = Message(
    "chart-range",
    "An EWMA has a weight above 0 and not above 1, a CUSUM an allowance not below 0; limits are above 0.",
)
