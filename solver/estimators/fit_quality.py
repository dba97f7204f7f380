"""How well an estimate fits: standardised residuals, χ², outliers.

For any estimator ``q = H·right_side`` that is exact for exact data, the residuals are ``S·ε`` with
S = I − design·H and ε the rates' noise of covariance R, so their covariance is S·R·Sᵀ. This holds
for least squares and for the paper's method alike.

Outlier test
    A residual over its own standard uncertainty is compared with the normal distribution, or, when
    the uncertainty comes from the residuals themselves, its deleted form with Student's (Baarda's
    data snooping; Cook & Weisberg 1982, Residuals and Influence in Regression, sec. 2.2), both
    two-sided at 1 % over all residuals together (Bonferroni). The largest is marked, its influence
    removed from the others, and the test repeated, so that one blunder does not mark its neighbours.
"""

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy import special

from solver.records import Array

FALSE_ALARM: Final = 0.01
"""Probability that the outlier test marks anything in a session of good data."""
_NONE_LEFT: Final = 1e-9
_OF_A_MEDIAN: Final = 0.37
"""Efficiency of the median deviation: its standard deviation is that of a mean square of so many fewer values."""


@dataclass(frozen=True, slots=True)
class Scatter:
    """Residuals judged: `standardised` (m,), `outliers` (m,)."""

    standardised: Array
    outliers: NDArray[np.bool_]


def judge(
    residuals: Array, sensitivity: Array, noise: Array, dof: int | None, *, apart: bool = False
) -> Scatter:
    """Standardise the residuals and mark outliers.

    Parameters
    ----------
    residuals : (m,) array
    sensitivity : (m, m) array
        S, by which the rates' noise becomes residuals.
    noise : (m, m) array
        R, covariance of the rates' noise.
    dof
        Degrees of freedom of `noise` when it is estimated from these residuals; None when given.
    apart
        Whether `noise` is estimated in a way that blunders have no part in (a median): residuals are
        then compared with Student's distribution as they are.
    """
    standardised = _standardise(residuals, sensitivity, noise)
    outliers = np.zeros(len(residuals), dtype=np.bool_)
    current, rest, influence = standardised, residuals, sensitivity
    while True:
        size = np.nan_to_num(np.abs(current))
        worst = int(np.argmax(size))
        left = len(residuals) - int(outliers.sum())
        freedom = None if dof is None else dof - int(outliers.sum())
        if not _stands_out(float(size[worst]), left, dof if apart else freedom, apart=apart):
            return Scatter(standardised, outliers)
        outliers[worst] = True
        weight = influence[worst, worst]
        if not apart and freedom is not None and freedom > 1:
            noise = noise * (max(0.0, freedom - size[worst] ** 2) / (freedom - 1))
        rest = rest - influence[:, worst] * (rest[worst] / weight)
        influence = influence - np.outer(influence[:, worst], influence[worst]) / weight
        current = _standardise(rest, influence, noise)
        current[outliers] = np.nan


def _standardise(residuals: Array, sensitivity: Array, noise: Array) -> Array:
    variance = np.sum((sensitivity @ noise) * sensitivity, axis=1)
    known = variance > _NONE_LEFT * np.diagonal(noise)
    out = np.full(len(residuals), np.nan)
    np.divide(residuals, np.sqrt(np.maximum(variance, 0.0)), out=out, where=known)
    return out


def _stands_out(size: float, count: int, dof: int | None, *, apart: bool) -> bool:
    """Whether the largest of `count` standardised residuals is too large for chance."""
    level = FALSE_ALARM / (2 * max(1, count))
    if dof is None:
        return bool(size > -special.ndtri(level))
    if dof < 2:
        return False
    if apart:
        return bool(size > -special.stdtrit(_OF_A_MEDIAN * dof, level))
    room = dof - size**2
    if room <= 0:
        return True
    deleted = size * np.sqrt((dof - 1) / room)
    return bool(deleted > -special.stdtrit(dof - 1, level))
