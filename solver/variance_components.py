"""Components of variance: scatter within a group of repeats, and between groups. It knows nothing of gyros.

J groups of K observations each, y_jk = µ + a_j + e_jk with independent a_j of variance s_B² (between
the groups: day to day, switch-on to switch-on) and e_jk of variance s_W² (within). One-way analysis of
variance, balanced: JCGM 100:2008 (GUM), H.5::

    s_a² = K·Σ_j (ȳ_j − ȳ)²/(J − 1)             between, J − 1 degrees of freedom; expects s_W² + K·s_B²
    s_b² = Σ_jk (y_jk − ȳ_j)²/(J·(K − 1))        within, J·(K − 1) degrees of freedom; expects s_W²
    F = s_a²/s_b²                               follows the F distribution when s_B = 0: (H.27)
    s_W² = s_b²,   s_B² = (s_a² − s_b²)/K       not below zero
    u²(ȳ) = s_a²/(J·K)                          with J − 1 degrees of freedom: the groups scatter
    u²(ȳ) = Σ_jk (y_jk − ȳ)²/(J·K·(J·K − 1))    where they do not: all observations are alike
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy import special

from solver.errors import InputError, Message
from solver.records import Array


@dataclass(frozen=True, slots=True)
class VarianceComponents:
    """One-way analysis of variance of J groups of K observations, in the unit of the observations.

    Attributes
    ----------
    mean
        Of all observations.
    groups, repeats
        J and K.
    mean_square_between, mean_square_within
        s_a² and s_b².
    f
        Their ratio; infinite when the groups have no scatter within.
    p_value
        Probability of a ratio at least as large when nothing varies between the groups.
    variance_within, variance_between
        s_W² and s_B² of single observations and of groups.
    """

    mean: float
    groups: int
    repeats: int
    mean_square_between: float
    mean_square_within: float
    f: float
    p_value: float
    variance_within: float
    variance_between: float

    @property
    def dof_between(self) -> int:
        """J − 1."""
        return self.groups - 1

    @property
    def dof_within(self) -> int:
        """J·(K − 1)."""
        return self.groups * (self.repeats - 1)

    @property
    def u_mean(self) -> float:
        """Standard uncertainty of the mean from the scatter of the groups, with `dof_between`."""
        return float(np.sqrt(self.mean_square_between / (self.groups * self.repeats)))

    @property
    def u_mean_pooled(self) -> float:
        """Standard uncertainty of the mean where groups do not differ, with J·K − 1 degrees of freedom."""
        count = self.groups * self.repeats
        total = self.dof_between * self.mean_square_between + self.dof_within * self.mean_square_within
        return float(np.sqrt(total / (count * (count - 1))))


def variance_components(observations: ArrayLike) -> VarianceComponents:
    """Analyse a table of observations.

    Parameters
    ----------
    observations : (J, K) array_like
        A row for each group, at least two of them with two observations each.

    Raises
    ------
    InputError
        When the table is too small or a value is not finite.
    """
    table = np.asarray(observations, np.float64)
    if table.ndim != 2 or min(table.shape) < 2:
        raise InputError(_TOO_FEW)
    means = table.mean(axis=1)
    within = np.sqrt(np.sum((table - means[:, None]) ** 2, axis=1) / (table.shape[1] - 1))
    return from_summaries(means, within, table.shape[1])


def from_summaries(means: ArrayLike, standard_deviations: ArrayLike, repeats: int) -> VarianceComponents:
    """Analyse groups of which mean and standard deviation are known.

    Parameters
    ----------
    means : (J,) array_like
        Of each group.
    standard_deviations : (J,) array_like
        Of the single observations in each group.
    repeats
        Observations in each group, K.

    Raises
    ------
    InputError
        When there are fewer than two groups or repeats, or a value is not finite.
    """
    centre, spread = np.asarray(means, np.float64), np.asarray(standard_deviations, np.float64)
    groups = len(centre)
    if groups < 2 or repeats < 2 or spread.shape != centre.shape:
        raise InputError(_TOO_FEW)
    if not (np.isfinite(centre).all() and np.isfinite(spread).all()):
        raise InputError(Message("not-finite", "Components of variance need finite observations."))
    between = repeats * _variance(centre)
    within = float(np.mean(spread**2))
    dof = groups - 1, groups * (repeats - 1)
    with np.errstate(divide="ignore", invalid="ignore"):
        f = float(np.float64(between) / np.float64(within))
    return VarianceComponents(
        mean=float(np.mean(centre)),
        groups=groups,
        repeats=repeats,
        mean_square_between=between,
        mean_square_within=within,
        f=f,
        p_value=float(special.fdtrc(*dof, f)),
        variance_within=within,
        variance_between=max(0.0, (between - within) / repeats),
    )


def _variance(values: Array) -> float:
    return float(np.var(values, ddof=1))


_TOO_FEW = Message(
    "too-few-groups", "Components of variance need two groups at least, of two observations each or more."
)
