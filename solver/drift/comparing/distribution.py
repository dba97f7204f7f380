"""How a quantity is distributed over the gyros of a type, and where each of them stands.

    mean, standard deviation, quantiles of order p: linear between order statistics, at 1 + (n − 1)·p
    between-gyro sd   of the gyros beyond their uncertainties, Paule-Mandel: `solver.drift.scatter`
    robust x*, s*     Algorithm A, ISO 13528:2022, C.3:  x_i pulled in to x* ± 1.5·s*, then x* their mean and s* their
                      standard deviation times 1.134 = 1/√β, until both stay; β = θ + δ²·(1 − θ) − 2·δ·φ(δ), δ = 1.5,
                      θ = 2·Φ(δ) − 1, which makes it right for normal values (Huber's proposal 2)
    z_i = (x_i − x*)/s*

Normality by Anderson and Darling's test with mean and variance estimated, for eight values or more::

    A² = −n − Σ (2·i − 1)/n·[ln Φ(y_i) + ln(1 − Φ(y_{n+1−i}))],   A*² = A²·(1 + 0.75/n + 2.25/n²)

with p from A*² by R. B. D'Agostino, M. A. Stephens, Goodness-of-Fit Techniques, 1986, table 4.9.
"""

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import special

from solver.drift.scatter import paule_mandel
from solver.errors import InputError, Message
from solver.records import Array

QUANTILES: Final = (0.05, 0.25, 0.5, 0.75, 0.95)
FEWEST_FOR_NORMALITY: Final = 8
_TUNING: Final = 1.5
_THETA: Final = float(2.0 * special.ndtr(_TUNING) - 1.0)
_BETA: Final = float(
    _THETA + _TUNING**2 * (1.0 - _THETA) - 2.0 * _TUNING * np.exp(-(_TUNING**2) / 2.0) / np.sqrt(2.0 * np.pi)
)
_NORMAL_QUARTILE: Final = float(special.ndtri(0.75))
_MOST_ROUNDS: Final = 500
_AGREEMENT: Final = 1e-12


@dataclass(frozen=True, slots=True)
class Distribution:
    """Of one quantity over a type's gyros.

    Attributes
    ----------
    count : int
    mean, sd : float
        Plain; `sd` is 0 for a single value.
    between : float
        Standard deviation of the gyros beyond the uncertainties of their values.
    robust_mean, robust_sd : float
        x* and s*.
    quantiles : (5,) array
        At `QUANTILES`.
    z : (n,) array
        Of each value, by the robust ones; NaN where s* is 0.
    rank : (n,) array of int
        Of each value, 1 the smallest; equal values share the smallest rank.
    anderson_darling, p_normal : float or None
        A*² and its p; None for too few or for equal values.
    """

    count: int
    mean: float
    sd: float
    between: float
    robust_mean: float
    robust_sd: float
    quantiles: Array
    z: Array
    rank: NDArray[np.int64]
    anderson_darling: float | None
    p_normal: float | None


def distribution(values: ArrayLike, u: ArrayLike | None = None) -> Distribution:
    """Describe the values of a type's gyros, one of each.

    Parameters
    ----------
    values : (n,) array_like
    u : (n,) array_like, optional
        Standard uncertainties of each value; without them the scatter is all the gyros'.

    Raises
    ------
    InputError
        When there is no value or a number is not finite.
    """
    x = np.asarray(values, np.float64)
    if x.ndim != 1 or len(x) == 0 or not np.isfinite(x).all():
        raise InputError(_VALUES)
    count = len(x)
    sd = float(x.std(ddof=1)) if count > 1 else 0.0
    known = np.zeros(count) if u is None else np.asarray(u, np.float64)
    centre, width = algorithm_a(x)
    with np.errstate(divide="ignore", invalid="ignore"):
        z = np.where(width > 0.0, (x - centre) / np.float64(width), np.nan)
    squared, p_value = anderson_darling(x)
    return Distribution(
        count=count,
        mean=float(x.mean()),
        sd=sd,
        between=paule_mandel(x, known) ** 0.5,
        robust_mean=centre,
        robust_sd=width,
        quantiles=np.quantile(x, QUANTILES),
        z=z,
        rank=np.searchsorted(np.sort(x), x).astype(np.int64) + 1,
        anderson_darling=squared,
        p_normal=p_value,
    )


def algorithm_a(values: Array) -> tuple[float, float]:
    """Robust mean and standard deviation of ISO 13528:2022, C.3."""
    centre = float(np.median(values))
    width = float(np.median(np.abs(values - centre))) / _NORMAL_QUARTILE
    if width == 0.0 and len(values) > 1:  # more than half are equal: begin with all
        width = float(values.std(ddof=1))
    for _ in range(_MOST_ROUNDS):
        pulled = np.clip(values, centre - _TUNING * width, centre + _TUNING * width)
        before = centre, width
        centre = float(pulled.mean())
        width = float(pulled.std(ddof=1)) / _BETA**0.5 if len(values) > 1 else 0.0
        if max(abs(centre - before[0]), abs(width - before[1])) <= _AGREEMENT * before[1]:
            break
    return centre, width


def anderson_darling(values: Array) -> tuple[float | None, float | None]:
    """A*² and p of normality with mean and variance estimated; None for too few values or equal ones."""
    count = len(values)
    sd = float(values.std(ddof=1)) if count > 1 else 0.0
    if count < FEWEST_FOR_NORMALITY or sd == 0.0:
        return None, None
    y = (np.sort(values) - values.mean()) / sd
    weights = (2.0 * np.arange(1, count + 1) - 1.0) / count
    squared = -count - float(np.sum(weights * (special.log_ndtr(y) + special.log_ndtr(-y[::-1]))))
    adjusted = squared * (1.0 + 0.75 / count + 2.25 / count**2)
    return adjusted, anderson_darling_p(adjusted)


def anderson_darling_p(a: float) -> float:
    """P of A*²: D'Agostino & Stephens, table 4.9; its last line holds to about 13, beyond it p is below 1e-30."""
    if a < 0.2:
        return 1.0 - float(np.exp(-13.436 + 101.14 * a - 223.73 * a * a))
    if a < 0.34:
        return 1.0 - float(np.exp(-8.318 + 42.796 * a - 59.938 * a * a))
    if a < 0.6:
        return float(np.exp(0.9177 - 4.279 * a - 1.38 * a * a))
    a = min(a, 13.0)
    return float(np.exp(1.2937 - 5.709 * a + 0.0186 * a * a))


_VALUES = Message("distribution-values", "A type's distribution needs finite values of one gyro at least.")
