"""First-order propagation of uncertainty: the GUM, JCGM 100:2008. It knows nothing of gyros.

With the outputs' derivatives by the inputs, C (p, s), and the inputs' covariance Σ (s, s)::

    covariance = C·Σ·Cᵀ                         GUM, eqs. (13) and (16), for several outputs H.2.3
    yᵢ = cᵢ·uᵢ                                  component of input i, 5.1.3
    sᵢ = cᵢ·(Σ·cᵀ)ᵢ = yᵢ² + Σⱼ rᵢⱼ·yᵢ·yⱼ        its part of the variance, with half of each cross term

The parts sum to the variance u². Without correlations sᵢ = yᵢ²; with them a part may be negative.

Effective degrees of freedom
    The Welch-Satterthwaite formula, GUM, eq. (G.2b), holds for independent inputs. Inputs that are
    correlated because they were evaluated from the same observations are first combined to a single
    component, which has the degrees of freedom of those observations; the formula then runs over
    these groups, which are independent (R. Willink, A generalization of the Welch-Satterthwaite
    formula for use with correlated uncertainty components, Metrologia 44, 2007, 340-349)::

        ν_eff = u⁴ / Σ_g (s_g²/ν_g),   s_g = sum of sᵢ over the group g

    Unless told otherwise, inputs that are linked by correlations make one group, and its ν is the
    smallest among its members: for simultaneous observations (as in GUM H.2) all are equal and the
    formula is exact; correlated inputs with different ν are taken for no better known than the worst
    of them. An input of infinite ν that is not correlated adds nothing to the sum.

Expanded uncertainty
    U = k·u with k the quantile of Student's t for ν_eff, G.3 and G.4, not truncated to an integer
    (G.4.1 allows to interpolate), of the normal distribution for infinite ν_eff.
"""

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import special

from solver.records import Array

LEVEL: Final = 0.95
"""Level of confidence of an expanded uncertainty when none is asked for."""


@dataclass(frozen=True, slots=True)
class Propagated:
    """Uncertainty of p outputs from s inputs.

    Attributes
    ----------
    covariance : (p, p) array
        Combined covariance of the outputs.
    components : (p, s) array
        cᵢ·uᵢ with its sign.
    parts : (p, s) array
        Part of each output's variance that each input gives, half of each cross term with it. Every
        row sums to the variance.
    dof : (p,) array
        Effective degrees of freedom, maybe infinite; NaN for an output without uncertainty.
    """

    covariance: Array
    components: Array
    parts: Array
    dof: Array

    @property
    def standard_uncertainties(self) -> Array:
        """Standard uncertainty of each output, (p,)."""
        return np.asarray(np.sqrt(np.diagonal(self.covariance)))

    @property
    def correlation(self) -> Array:
        """Correlation coefficients of the outputs, (p, p); NaN for an output without uncertainty."""
        u = self.standard_uncertainties
        with np.errstate(invalid="ignore", divide="ignore"):
            return np.asarray(self.covariance / np.outer(u, u))

    def coverage_factors(self, level: float = LEVEL) -> Array:
        """Coverage factor k of each output at a level of confidence, (p,)."""
        return coverage_factor(self.dof, level)

    def expanded(self, level: float = LEVEL) -> Array:
        """U = k·u of each output, (p,)."""
        return self.coverage_factors(level) * self.standard_uncertainties


def propagate(
    sensitivity: ArrayLike,
    covariance: ArrayLike,
    dof: ArrayLike | None = None,
    groups: ArrayLike | None = None,
) -> Propagated:
    """Propagate the inputs' covariance to the outputs.

    Parameters
    ----------
    sensitivity : (p, s) or (s,) array
        C: derivative of each output by each input; (s,) is a single output.
    covariance : (s, s) array
        Of the inputs.
    dof : (s,) array, optional
        Degrees of freedom of each input's standard uncertainty; infinite when not given.
    groups : (s,) int array, optional
        Equal numbers mark inputs that were evaluated together. When not given, inputs that are
        linked by correlations.

    Returns
    -------
    Propagated
        NaN in the sensitivity of an output makes that output's uncertainty NaN, nobody else's.
    """
    derivatives = np.atleast_2d(np.asarray(sensitivity, np.float64))
    of_inputs = np.asarray(covariance, np.float64)
    count = derivatives.shape[1]
    freedom = np.full(count, np.inf) if dof is None else np.asarray(dof, np.float64)
    together = linked(of_inputs) if groups is None else np.asarray(groups)
    spread = derivatives @ of_inputs
    combined = spread @ derivatives.T
    parts = derivatives * spread
    return Propagated(
        covariance=(combined + combined.T) / 2,
        components=derivatives * np.sqrt(np.diagonal(of_inputs)),
        parts=parts,
        dof=effective_dof(parts, freedom, together),
    )


def effective_dof(parts: Array, dof: Array, groups: ArrayLike) -> Array:
    """Effective degrees of freedom, (p,), of variances that consist of `parts` (p, s).

    Parameters
    ----------
    parts : (p, s) array
        What each input contributes to the variance of each output.
    dof : (s,) array
        Degrees of freedom of each input.
    groups : (s,) int array
        Equal numbers mark inputs that were evaluated together: GUM, eq. (G.2b), over groups.
    """
    _, group = np.unique(np.asarray(groups), return_inverse=True)
    count = int(group.max(initial=-1)) + 1
    of_group = np.full(count, np.inf)
    np.minimum.at(of_group, group, dof)
    member = group == np.arange(count)[:, None]
    grouped = parts @ member.T
    total = grouped.sum(axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(total**2 / (grouped**2 / of_group).sum(axis=1))


def linked(covariance: Array) -> NDArray[np.int64]:
    """Number the groups of inputs that correlations link, directly or through others, (s,)."""
    count = len(covariance)
    neighbours = (covariance != 0) | np.eye(count, dtype=np.bool_)
    label = np.arange(count)
    while True:
        smallest = np.where(neighbours, label, count).min(axis=1, initial=count)
        if np.array_equal(smallest, label):
            return np.asarray(label, np.int64)
        label = smallest


def coverage_factor(dof: ArrayLike, level: float = LEVEL) -> Array:
    """Quantile k of Student's t with `dof` (…) degrees of freedom: P(|t| ≤ k) = `level`. GUM, G.3.

    Degrees of freedom below 1, for which an interval would mean nothing, and NaN give NaN.
    """
    freedom = np.asarray(dof, np.float64)
    finite = np.where(np.isfinite(freedom) & (freedom >= 1), freedom, 1.0)
    k = np.where(
        np.isposinf(freedom), special.ndtri((1 + level) / 2), special.stdtrit(finite, (1 + level) / 2)
    )
    return np.asarray(np.where(freedom >= 1, k, np.nan))
