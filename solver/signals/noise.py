"""Noise of a sampled current: what its mean is worth.

The uncertainty of a mean is set by the slowest fluctuations of the record, those whose period is
comparable with its length. They are what the record's products with the slow cosines

    d_j = √(2/n)·Σ_i x_i·cos(π·j·(i + ½)/n),    j = 1 … J

measure: each d_j² has the expectation n·u² as long as the spectrum is flat up to the frequency of the
last one, J/(2T) in a record of the length T, and they are nearly independent. So u² is the mean of
d_j²/n, with J degrees of freedom, and (mean − truth)/u follows Student's distribution with them
(U. K. Müller, J. Econometrics 141 (2007) 1331; E. Lazarus et al., J. Bus. Econ. Stat. 36 (2018) 541).
Mains hum and other fast periodic parts, which upset sums of autocorrelations, do not enter at all.

How many cosines: no more than 96, nor than a fifth of the autocorrelation times in the record; these
are counted in means over a part of the record (480 parts), lest much white noise hide a little that is
slow. While the slower ones carry more power than the faster beyond the 95 % quantile of F, there
are fewer, and then fewer by 0.6 once more: where an excess is just seen, some unseen is left.

`tests/benchmarks/mean_coverage.py` prints how often 95 % intervals hold for many kinds of noise.
"""

from typing import Final, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import special

from solver.errors import InputError, Message
from solver.signals.autocorrelation import autocorrelation, integrated_time

Array = NDArray[np.float64]

_FEWEST_FOR_COSINES: Final = 64
_PARTS: Final = 480
_FEWEST_PARTS: Final = 4800
_MOST: Final = 96
_FEWEST: Final = 6
_PER_TIME: Final = 0.2
_UNUSUAL: Final = 0.95
_STEP: Final = 1.5
_FEWER: Final = 0.6
_BATCH_SHARE: Final = 0.5


class Mean(NamedTuple):
    """A mean and its standard uncertainty, in the unit of the samples.

    `dof` are the degrees of freedom of the uncertainty, and `n_eff` is the number of independent
    samples whose mean would be as uncertain, at most the number of samples. Samples that are all
    equal say nothing of their noise: u and dof are then 0 and n_eff is 1, unless a floor is given.
    """

    value: float
    standard_uncertainty: float
    dof: float
    n_eff: float


def mean_with_uncertainty(samples: ArrayLike, floor: float = 0.0) -> Mean:
    """Mean of evenly sampled, possibly autocorrelated values, with its standard uncertainty.

    By the slow cosines of the module's text; fewer than 64 samples are taken as independent.

    Parameters
    ----------
    samples : (n,) array_like
        At least two finite values.
    floor
        Standard uncertainty that averaging does not reduce (bias instability), in the unit of the
        samples; added in quadrature, taken as known exactly (JCGM 100, G.4.1). `n_eff` is without it.

    Raises
    ------
    InputError
        When there are fewer than two samples or one is not finite, or the floor is negative.
    """
    values = checked(samples)
    if not 0.0 <= floor < np.inf:
        raise InputError(
            Message("bad-floor", "The floor of the uncertainty must be a number not below zero.")
        )
    mean, n = float(np.mean(values)), len(values)
    if is_constant(values):
        return Mean(mean, floor, np.inf if floor else 0.0, 1.0)
    variance = float(np.var(values, ddof=1))
    if n < _FEWEST_FOR_COSINES:
        u, dof = (variance / n) ** 0.5, n - 1.0
    else:
        slow = slow_cosines(values)
        u, dof = float(np.mean(slow) / n) ** 0.5, float(len(slow))
    n_eff = min(float(n), variance / u**2)
    total = float(np.hypot(u, floor))
    return Mean(mean, total, dof * (total / u) ** 4, n_eff)


def batch_means(samples: ArrayLike, batches: int | None = None) -> Mean:
    """Mean and its uncertainty by the scatter of the means of equal parts: the cross-check.

    The method of batch means (A. M. Law, Simulation Modeling and Analysis, ch. 9): good when a batch
    is much longer than the autocorrelation time.

    Parameters
    ----------
    samples : (n,) array_like
        At least four finite values.
    batches
        Their number, from 2 to n; unless given, half of the slow cosines of `mean_with_uncertainty`,
        so that a batch is at least ten autocorrelation times long.
    """
    values = checked(samples)
    mean, n = float(np.mean(values)), len(values)
    if is_constant(values):
        return Mean(mean, 0.0, 0.0, 1.0)
    if batches is None:
        batches = (
            n if n < _FEWEST_FOR_COSINES else max(_FEWEST, int(_BATCH_SHARE * len(slow_cosines(values))))
        )
    if not 2 <= batches <= n:
        raise InputError(
            Message(
                "bad-batches", "%(n)d samples do not make %(batches)d batches.", {"n": n, "batches": batches}
            )
        )
    u = float(np.std(_means(values - mean, batches), ddof=1)) / batches**0.5
    n_eff = min(float(n), float(np.var(values, ddof=1)) / u**2) if u else float(n)
    return Mean(mean, u, batches - 1.0, n_eff)


def mean_by_correlation(samples: ArrayLike) -> Mean:
    """Mean and its uncertainty by the integrated autocorrelation time: the other cross-check.

    s²·τ/n with τ from `solver.signals.autocorrelation`: exact for noise with one correlation time, too small
    where white noise hides a slow part.
    """
    values = checked(samples)
    mean, n = float(np.mean(values)), len(values)
    if is_constant(values):
        return Mean(mean, 0.0, 0.0, 1.0)
    time = integrated_time(autocorrelation(values))
    u = float(np.sqrt(np.var(values) * time.samples / n))
    return Mean(mean, u, time.dof, min(float(n), n / time.samples))


def checked(samples: ArrayLike) -> Array:
    """The samples as an array of at least two finite numbers."""
    values = np.asarray(samples, dtype=np.float64)
    if values.ndim != 1 or len(values) < 2:
        raise InputError(
            Message("too-few-samples", "A mean with its uncertainty needs at least two samples.")
        )
    if not np.isfinite(values).all():
        row = int(np.argmin(np.isfinite(values))) + 1
        raise InputError(Message("not-finite", "Sample %(row)d is not a finite number.", {"row": row}))
    return values


def checked_interval(interval: float) -> float:
    """The time between samples, which must be positive."""
    if not interval > 0.0:
        raise InputError(Message("bad-interval", "The time between samples must be greater than zero."))
    return interval


def is_constant(values: Array) -> bool:
    """Whether all samples are equal."""
    return bool(np.min(values) == np.max(values))


def cosine_powers(values: Array) -> Array:
    """d_j² for j = 1 … n − 1, (n − 1,): squares of the orthonormal cosine transform (DCT-II)."""
    n = len(values)
    centred = values - np.mean(values)
    spectrum = np.fft.rfft(np.concatenate((centred, centred[::-1])))[1:n]
    turned = spectrum * np.exp(-0.5j * np.pi / n * np.arange(1, n))
    return np.asarray(turned.real**2 / (2.0 * n))


def slow_cosines(values: Array, first: int = 0) -> Array:
    """The squares d_j² of the slowest cosines of one power, (J,), of at least 64 samples.

    They are computed from means over short parts of a long record: J is small. `first` of them, the
    slowest, are left out.
    """
    n = len(values)
    length = max(1, n // _FEWEST_PARTS)
    powers = length * cosine_powers(_means(values, n // length))[first:]
    parts = min(n, _PARTS)
    means = _means(values, parts)
    time = 1.0 if is_constant(means) else integrated_time(autocorrelation(means)).samples
    most = np.clip(_PER_TIME * parts / max(time, 1.0), _FEWEST, min(_MOST, parts // 5))
    return powers[: flat_part(powers, int(most))]


def _means(values: Array, parts: int) -> Array:
    """Of equal parts; what fills none is left out at the start, where transients are."""
    length = len(values) // parts
    return np.asarray(np.mean(values[-parts * length :].reshape(parts, length), axis=1))


def flat_part(powers: Array, most: int) -> int:
    """How many of the first powers, at most `most`, are equal as far as can be seen."""
    sums = np.cumsum(powers[:most])
    count = most
    while count > _FEWEST and _slower_are_stronger(sums, count):
        count = max(_FEWEST, int(count / _STEP))
    return count if count == most else max(_FEWEST, int(_FEWER * count))


def _slower_are_stronger(sums: Array, count: int) -> bool:
    for share in (2, 4, 8, 16):
        few = count // share
        if few < 2:
            return False
        rest = count - few
        ratio = (sums[few - 1] / few) / ((sums[count - 1] - sums[few - 1]) / rest)
        if ratio > special.fdtri(few, rest, _UNUSUAL):
            return True
    return False
