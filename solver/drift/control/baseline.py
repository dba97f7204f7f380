"""The frozen baseline that a control chart judges by: where a quantity stood, and how much it scattered.

A value is ``x_i = µ + b_i + e_i``: ``e_i ~ N(0, u_i²)`` is the known noise of its own measurement, ``b_i ~ N(0, τ²)``
the scatter from value to value beyond it. So each point of a chart has a variance of its own, ``V_i = τ² + u_i²``,
and limits of its own. Three estimators, from the n values of the baseline:

paule-mandel
    τ² by `solver.drift.scatter.paule_mandel`, the centre is the mean weighted by ``w_i = 1/V_i``. As Q(τ²) has the
    variance 2·(n − 1) and falls by ``E Σ w_i²·(x_i − c)² = Σw − Σw²/Σw`` with τ²::

        V_typ = n/Σw,   u²(centre) = V_typ/n,   u_typ² = V_typ − τ²
        var(τ²) = 2·(n − 1)/(Σw − Σw²/Σw)² = 2·V_typ²/ν

    ν = n − 1 when all u_i are equal, less when a few values have most of the weight.
standard-deviation
    s with n − 1 degrees of freedom about the plain mean; the textbook's chart: all scatter alike, u is ignored.
moving-range
    MR̄/1.128 about the plain mean (NIST/SEMATECH e-Handbook, 6.3.2.2), u ignored as well. A slow change of the level
    hardly adds to it. For its degrees of freedom see `moving_range_dof`.

Limits
    three-sigma: centre ± w·√V_i, as if centre and scatter were known; w = 3 in every textbook.

    prediction: the baseline's own uncertainty counts. A value in control differs from the centre by the variance
    ``(1 + 1/n)·τ² + u_i² + u_typ²/n``, of which τ² is estimated: `prediction`. It is outside as often as
    the width w says, 2·Φ(−w), whatever n; where the u_i matter, no oftener.
"""

from dataclasses import dataclass
from typing import Final, Literal, get_args

import numpy as np
from numpy.typing import ArrayLike
from scipy import optimize, special

from solver.drift.control.prediction import Prediction
from solver.drift.history import History
from solver.drift.scatter import paule_mandel
from solver.errors import InputError, Message
from solver.records import Array

Estimator = Literal["paule-mandel", "moving-range", "standard-deviation"]
Limits = Literal["prediction", "three-sigma"]

D2: Final = 1.128
"""Expected range of two values over their σ, 2/√π as the tables print it."""
D4: Final = 3.267
"""Upper limit of a moving range of two over the mean range, as the tables print it."""
WIDTH: Final = 3.0
"""Half width of control limits in standard deviations: 0.27 % of the points in control lie outside."""


@dataclass(frozen=True, slots=True)
class Baseline:
    """What a quantity is judged against. `freeze` makes it; its numbers, kept anywhere, make it again.

    Attributes
    ----------
    centre
        In the quantity's unit.
    scatter
        paule-mandel: τ, the standard deviation from value to value beyond each value's own u; the
        other estimators: the whole standard deviation of a value. In the same unit.
    dof
        Degrees of freedom ν of the scatter, of a value as uncertain as the baseline's.
    count
        Values it was computed from, n.
    estimator
        paule-mandel, moving-range or standard-deviation.
    u_typical
        paule-mandel: own uncertainty of a typical value of the baseline, u_typ; else 0.
    """

    centre: float
    scatter: float
    dof: float
    count: int
    estimator: Estimator = "paule-mandel"
    u_typical: float = 0.0

    @property
    def u_centre(self) -> float:
        """Standard uncertainty of the centre."""
        return float(np.sqrt(self._typical / self.count))

    def variance(self, u: ArrayLike) -> Array:
        """V of values with the own uncertainties `u`, (…)."""
        return np.asarray(self.scatter**2 + self.known(u))

    def known(self, u: ArrayLike) -> Array:
        """Part of V that is known, (…): u², and 0 where the estimator ignores it.

        A value of which no u is known, 0, is taken for a typical one.
        """
        own = np.asarray(u, np.float64)
        if self.estimator != "paule-mandel":
            return np.zeros_like(own)
        return np.square(np.where(own > 0.0, own, self.u_typical))

    def half_width(self, u: ArrayLike, limits: Limits, width: float = WIDTH) -> Array:
        """Distance of the limits from the centre, (n,), for values with the own uncertainties `u`."""
        if limits == "three-sigma":
            return np.asarray(width * np.sqrt(self.variance(u)))
        return self.prediction().bound(width, *self._of_a_value(u))

    def standardised(self, values: ArrayLike, u: ArrayLike, limits: Limits) -> Array:
        """Standard normal z of values in control, (n,): beyond ±w exactly outside the limits of the width w."""
        apart = np.asarray(values, np.float64) - self.centre
        if limits == "three-sigma":
            return np.asarray(apart / np.sqrt(self.variance(u)))
        return self.prediction().standardised(apart, *self._of_a_value(u))

    def prediction(self) -> Prediction:
        """What the baseline leaves possible for τ²."""
        # MR̄/d₂ is right on average as a standard deviation, a prediction wants it to be as a variance.
        unbias = c4(self.dof) if self.estimator == "moving-range" else 1.0
        return Prediction.of(self._typical * unbias**2, self.dof, self.u_typical**2)

    def _of_a_value(self, u: ArrayLike) -> tuple[float, Array]:
        """How often the difference of a value from the centre contains τ², and its known variance."""
        return 1.0 + 1.0 / self.count, self.known(u) + self.u_typical**2 / self.count

    @property
    def _typical(self) -> float:
        return self.scatter**2 + self.u_typical**2


def freeze(history: History, estimator: Estimator) -> Baseline:
    """Estimate the baseline from its values.

    Parameters
    ----------
    history
        The values chosen: in control, of one state of the thing.
    estimator
        paule-mandel where the values know their u; the others are the textbook's and ignore u.

    Raises
    ------
    InputError
        When there are fewer than two values, or nothing scatters.
    """
    if estimator not in get_args(Estimator):
        raise InputError(Message(_UNKNOWN.code, _UNKNOWN.template, {"estimator": estimator}))
    count = len(history)
    if count < 2:
        raise InputError(Message(_TOO_FEW.code, _TOO_FEW.template, {"count": count}))
    if estimator == "paule-mandel":
        return _weighted(history)
    values = history.value
    ranges = np.abs(np.diff(values))
    moving = estimator == "moving-range"
    scatter = float(ranges.mean() / D2 if moving else values.std(ddof=1))
    if not scatter > np.finfo(np.float64).eps * float(np.abs(values).max()):
        raise InputError(_NO_SCATTER)
    dof = moving_range_dof(count) if moving else count - 1.0
    return Baseline(float(values.mean()), scatter, dof, count, estimator)


def _weighted(history: History) -> Baseline:
    u = history.u
    if u.max() > 0.0 and not u.min() > 0.0:
        u = np.where(u > 0.0, u, np.sqrt(np.mean(np.square(u[u > 0.0]))))
    tau2 = paule_mandel(history.value, u)
    variance = tau2 + u**2
    if not variance.min() > 0.0:
        raise InputError(_NO_SCATTER)
    count, weight = len(history), 1.0 / variance
    total = float(weight.sum())
    typical = count / total
    slope = total - float(weight @ weight) / total
    return Baseline(
        centre=float(weight @ history.value) / total,
        scatter=float(np.sqrt(tau2)),
        dof=(typical * slope) ** 2 / (count - 1.0),
        count=count,
        estimator="paule-mandel",
        u_typical=float(np.sqrt(max(0.0, typical - tau2))),
    )


def c4(dof: float) -> float:
    """Expectation of a standard deviation with `dof` degrees of freedom over σ (NIST e-Handbook, 6.3.2)."""
    return float(np.exp(special.gammaln((dof + 1) / 2) - special.gammaln(dof / 2)) * np.sqrt(2 / dof))


def moving_range_dof(count: int) -> float:
    """Degrees of freedom of the mean of `count` − 1 moving ranges of two, when it is taken for a multiple of χ.

    The χ of the same relative variance (P. B. Patnaik, Biometrika 37, 1950, 78-87, of ranges) has too heavy a tail: as
    long as n is small the mean is as seldom near 0 as n − 1 degrees of freedom make it. The second term was
    fitted to millions of simulated baselines: the rate outside 3σ prediction limits is then right within 2 % for
    every n; exact for n = 2.
    """
    n = count - 1
    # Variance of |x₂ − x₁| and its covariance with |x₃ − x₂|, differences that correlate by −1/2; σ = 1.
    squared_mean = 4.0 / np.pi
    variance = 2.0 - squared_mean
    covariance = (4.0 / np.pi) * (np.sqrt(0.75) + np.arcsin(0.5) / 2.0) - squared_mean
    relative = (n * variance + 2.0 * (n - 1) * covariance) / n**2 / squared_mean
    patnaik = optimize.brentq(lambda dof: 1.0 / c4(dof) ** 2 - 1.0 - relative, 0.5, 2.0 * count)
    return float(patnaik + 0.8 * (1.0 - (2.0 / count) ** 1.5))


_UNKNOWN: Final = Message("baseline-estimator", "There is no estimator of a baseline called %(estimator)s.")
_TOO_FEW: Final = Message("baseline-too-few", "A baseline needs at least two values, not %(count)d.")
_NO_SCATTER: Final = Message(
    "baseline-no-scatter",
    "The values chosen for the baseline do not scatter, and none has an uncertainty: no limit follows from them.",
)
