"""Two results of the same quantities, in units of their uncertainty: two sessions, or two gyros.

    d = x_a − x_b,   u²(d) = u_a² + u_b² − 2·u(x_a, x_b)                   JCGM 100:2008, eq. (16)
    U(d) = t(ν)·u(d),   ν = u⁴(d)/(u_a⁴/ν_a + u_b⁴/ν_b)                    JCGM 100:2008, G.4.1
    E_n = d/√(U_a² + U_b² − 2·k_a·k_b·u(x_a, x_b))                         ISO 13528:2022, 9.7
    p = probability of a larger |d| if both had the same value, Student's t with ν

u(x_a, x_b) is the covariance of what both have in common: the same certificate of the stand, the same ammeter. It is
the caller's to give, and taken as known. ISO 13528 has E_n for independent results, without
the covariance; |E_n| ≤ 1 says that both agree.

Several parameters at once, with C the covariance of their differences::

    χ² = dᵀ·C⁺·d with rank(C) degrees of freedom        P. C. Mahalanobis, Proc. Natl. Inst. Sci. India 2, 1936, 49-55

which counts correlated parameters for what they tell together. A difference where C knows of no scatter cannot be
due to it: χ² is infinite.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import ArrayLike
from scipy import special

from solver.errors import InputError, Message
from solver.records import Array

COVERAGE_FACTOR: Final = 2.0
_ROUNDING: Final = 1e-12


@dataclass(frozen=True, slots=True)
class Difference:
    """What two results of one quantity differ by.

    Attributes
    ----------
    value : float
        x_a − x_b.
    u, expanded, coverage_factor : float
        u(d), U(d) and t(ν), for the probability asked for.
    dof : float or None
        ν; None without limit.
    in_expanded : float
        d/U(d): beyond ±1 it is significant.
    e_n : float
        By the expanded uncertainties of the two.
    p_value : float
    """

    value: float
    u: float
    expanded: float
    coverage_factor: float
    dof: float | None
    in_expanded: float
    e_n: float
    p_value: float


@dataclass(frozen=True, slots=True)
class JointDifference:
    """What two results of several quantities differ by.

    Attributes
    ----------
    single : tuple of Difference
        Of each quantity by itself.
    covariance : (p, p) array
        C, of the differences.
    chi2, p_value : float
    dof : int
        Rank of C.
    """

    single: tuple[Difference, ...]
    covariance: Array
    chi2: float
    dof: int
    p_value: float


def compare(
    value_a: float,
    u_a: float,
    value_b: float,
    u_b: float,
    *,
    covariance: float = 0.0,
    dof: tuple[float | None, float | None] = (None, None),
    coverage_factors: tuple[float, float] = (COVERAGE_FACTOR, COVERAGE_FACTOR),
    probability: float = 0.95,
) -> Difference:
    """Compare two results of one quantity.

    Parameters
    ----------
    value_a, u_a, value_b, u_b : float
        Values and standard uncertainties, in one unit.
    covariance : float
        Of what both share, in the unit's square.
    dof : pair of float or None
        ν_a and ν_b; None without limit.
    coverage_factors : pair of float
        k_a and k_b of the stated expanded uncertainties, for E_n.
    probability : float
        Of U(d).

    Raises
    ------
    InputError
        When an uncertainty is not positive or the covariance is more than the two uncertainties allow.
    """
    square = u_a**2 + u_b**2 - 2.0 * covariance
    k_a, k_b = coverage_factors
    stated = (k_a * u_a) ** 2 + (k_b * u_b) ** 2 - 2.0 * k_a * k_b * covariance
    if not (u_a >= 0.0 and u_b >= 0.0 and abs(covariance) <= u_a * u_b * (1.0 + _ROUNDING)):
        raise InputError(_COVARIANCE)
    if not (square > _ROUNDING * (u_a**2 + u_b**2) and stated > 0.0):
        raise InputError(_NO_UNCERTAINTY)
    difference, u = value_a - value_b, square**0.5
    spread = sum(own**4 / n for own, n in zip((u_a, u_b), dof, strict=True) if n is not None)
    freedom = square**2 / spread if spread > 0.0 else None
    factor = _student(freedom, 1.0 - (1.0 - probability) / 2.0)
    return Difference(
        value=difference,
        u=u,
        expanded=factor * u,
        coverage_factor=factor,
        dof=freedom,
        in_expanded=difference / (factor * u),
        e_n=difference / stated**0.5,
        p_value=_two_sided(difference / u, freedom),
    )


def compare_jointly(
    values_a: ArrayLike,
    covariance_a: ArrayLike,
    values_b: ArrayLike,
    covariance_b: ArrayLike,
    *,
    shared: ArrayLike | None = None,
    dof: tuple[Sequence[float | None], Sequence[float | None]] | None = None,
    coverage_factors: tuple[ArrayLike, ArrayLike] | None = None,
    probability: float = 0.95,
) -> JointDifference:
    """Compare two results of several quantities.

    Parameters
    ----------
    values_a, values_b : (p,) array_like
    covariance_a, covariance_b : (p, p) array_like
    shared : (p, p) array_like, optional
        Covariance of what both have in common, element [i, j] between quantity i of a and j of b.
    dof : pair of sequences of float or None, optional
        ν of each quantity, of a and of b.
    coverage_factors : pair of (p,) array_like, optional
        k of each quantity, of a and of b.
    probability : float
        Of each U(d).

    Raises
    ------
    InputError
        When shapes differ, or as `compare`.
    """
    a, b = np.asarray(values_a, np.float64), np.asarray(values_b, np.float64)
    cov_a, cov_b = np.asarray(covariance_a, np.float64), np.asarray(covariance_b, np.float64)
    common = np.zeros_like(cov_a) if shared is None else np.asarray(shared, np.float64)
    count = len(a)
    if a.ndim != 1 or b.shape != a.shape or any(c.shape != (count, count) for c in (cov_a, cov_b, common)):
        raise InputError(_SHAPES)
    factors = np.full((2, count), COVERAGE_FACTOR) if coverage_factors is None else np.array(coverage_factors)
    freedoms = ((None,) * count,) * 2 if dof is None else dof
    single = tuple(
        compare(
            float(a[i]),
            float(cov_a[i, i]) ** 0.5,
            float(b[i]),
            float(cov_b[i, i]) ** 0.5,
            covariance=float(common[i, i]),
            dof=(freedoms[0][i], freedoms[1][i]),
            coverage_factors=(float(factors[0, i]), float(factors[1, i])),
            probability=probability,
        )
        for i in range(count)
    )
    covariance = cov_a + cov_b - common - common.T
    chi2, rank = _mahalanobis(a - b, covariance)
    return JointDifference(single, covariance, chi2, rank, float(special.chdtrc(rank, chi2)))


def _mahalanobis(difference: Array, covariance: Array) -> tuple[float, int]:
    scale = np.sqrt(np.diagonal(covariance))
    eigenvalues, vectors = np.linalg.eigh(covariance / np.outer(scale, scale))
    along = vectors.T @ (difference / scale)
    seen = eigenvalues > _ROUNDING * len(scale) * eigenvalues[-1]
    # the larger of rounding of the differences and of the eigenvectors
    if np.any(np.abs(along[~seen]) > 1e-6 * np.linalg.norm(along)):
        return np.inf, int(seen.sum())
    return float(np.sum(along[seen] ** 2 / eigenvalues[seen])), int(seen.sum())


def _student(dof: float | None, probability: float) -> float:
    return float(special.ndtri(probability) if dof is None else special.stdtrit(dof, probability))


def _two_sided(ratio: float, dof: float | None) -> float:
    below = special.ndtr(-abs(ratio)) if dof is None else special.stdtr(dof, -abs(ratio))
    return 2.0 * float(below)


_SHAPES = Message(
    "comparison-shapes", "Two results to be compared need the same quantities, each with its full covariance."
)
_COVARIANCE = Message(
    "comparison-covariance", "What two results share cannot be more than the uncertainty of either of them."
)
_NO_UNCERTAINTY = Message(
    "comparison-no-uncertainty", "Two results without any uncertainty between them cannot be compared."
)
