"""Which quantities go together: correlations over the gyros of a type, or over the sessions of one gyro.

For each pair, over the n cases in which both are known and with f degrees of freedom lost beforehand (a course
removed from each)::

    r = Pearson's coefficient
    tanh[artanh r ± z/√(n − f − 3)]      R. A. Fisher, Metron 1 (4), 1921, 3-32: interval, n − f > 3
    p: t = r·√(ν/(1 − r²)) with ν = n − f − 2, Student's t                    r = 0
       or |artanh r − artanh ρ|·√(n − f − 3), normal                           r = ρ expected

and p adjusted for all pairs together by Holm's procedure. An expected ρ is what the parameters' own covariance
makes: the errors of a fit are correlated, so that the parameters of repeated sessions are, whatever the gyro does.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import special

from solver.errors import InputError, Message
from solver.estimators.model_comparison import holm
from solver.records import Array


@dataclass(frozen=True, slots=True)
class Correlations:
    """Of each pair of p quantities; every array is (p, p) and symmetric, NaN where there are too few cases.

    Attributes
    ----------
    r, low, high : array
        Coefficient and ends of its interval.
    p_value, p_holm : array
        For the pair by itself, and adjusted for all pairs; NaN on the diagonal.
    count : int array
        Cases in which both are known.
    """

    r: Array
    low: Array
    high: Array
    p_value: Array
    p_holm: Array
    count: NDArray[np.int64]


def correlations(
    columns: ArrayLike, *, expected: ArrayLike | None = None, lost: int = 0, level: float = 0.95
) -> Correlations:
    """Correlate quantities pair by pair.

    Parameters
    ----------
    columns : (n, p) array_like
        A row for each gyro or session; NaN where a value is missing.
    expected : (p, p) array_like, optional
        ρ to test against instead of 0.
    lost : int
        f, degrees of freedom that removing a course has cost each column.
    level : float
        Probability of the intervals.

    Raises
    ------
    InputError
        When shapes do not fit, or an expected correlation is not within ±1.
    """
    table = np.asarray(columns, np.float64)
    if table.ndim != 2:
        raise InputError(_SHAPE)
    size = table.shape[1]
    null = np.zeros((size, size)) if expected is None else np.asarray(expected, np.float64)
    if null.shape != (size, size) or (np.abs(null[~np.eye(size, dtype=bool)]) >= 1.0).any():
        raise InputError(_SHAPE)
    r, low, high, p_value, p_holm = (np.full((size, size), np.nan) for _ in range(5))
    count = np.zeros((size, size), np.int64)
    pairs = []
    for i in range(size):
        for j in range(i + 1):
            both = np.isfinite(table[:, i]) & np.isfinite(table[:, j])
            count[i, j] = count[j, i] = both.sum()
            r[i, j] = r[j, i] = _coefficient(table[both, i], table[both, j])
            if i == j or not np.isfinite(r[i, j]):
                continue
            ends = _interval(r[i, j], int(both.sum()) - lost, level)
            low[i, j], high[i, j] = low[j, i], high[j, i] = ends
            p_value[i, j] = p_value[j, i] = _p(r[i, j], float(null[i, j]), int(both.sum()) - lost)
            if np.isfinite(p_value[i, j]):
                pairs.append((i, j))
    adjusted = holm([float(p_value[pair]) for pair in pairs])
    for (i, j), p in zip(pairs, adjusted, strict=True):
        p_holm[i, j] = p_holm[j, i] = p
    return Correlations(r, low, high, p_value, p_holm, count)


def _coefficient(x: Array, y: Array) -> float:
    if len(x) < 2:
        return float("nan")
    dx, dy = x - x.mean(), y - y.mean()
    square = float(dx @ dx) * float(dy @ dy)
    return float(np.clip(dx @ dy / square**0.5, -1.0, 1.0)) if square > 0.0 else float("nan")


def _interval(r: float, cases: int, level: float) -> tuple[float, float]:
    if cases <= 3:
        return float("nan"), float("nan")
    half = special.ndtri((1.0 + level) / 2.0) / (cases - 3) ** 0.5
    with np.errstate(divide="ignore"):
        middle = np.arctanh(r)
    return float(np.tanh(middle - half)), float(np.tanh(middle + half))


def _p(r: float, rho: float, cases: int) -> float:
    if cases < 3 or (rho != 0.0 and cases <= 3):
        return float("nan")
    if abs(r) >= 1.0:
        return 0.0
    if rho == 0.0:
        t = abs(r) * ((cases - 2) / (1.0 - r * r)) ** 0.5
        return 2.0 * float(special.stdtr(cases - 2, -t))
    return 2.0 * float(special.ndtr(-abs(np.arctanh(r) - np.arctanh(rho)) * (cases - 3) ** 0.5))


_SHAPE = Message(
    "correlation-shape",
    "Correlations need a table of cases by quantities, and expected ones between -1 and 1 for each pair.",
)
