"""Allan deviation of a sampled quantity, with confidence intervals.

With averages ȳ over m samples each, the Allan variance at the averaging time τ = m·τ₀ is half the
mean square of the difference of two adjacent averages. In the running sum x of the samples that is
the second difference at the distance m:

    σ²(τ) = ⟨(x[i+2m] − 2·x[i+m] + x[i])²⟩ / (2·m²)

taken over all i (overlapping) or every m-th (plain): W. J. Riley, Handbook of Frequency Stability
Analysis, NIST SP 1065, eq. (6), (7) and (11), pp. 14-16; IEEE Std 952-1997, annex C. "Frequency" there
is any sampled rate, here a current; the interval between samples is τ₀.

Of N samples M second differences are averaged, but they are correlated: the variance is distributed
like χ² with fewer, "equivalent", degrees of freedom. Their number follows from the autocovariance R
of the second differences of the noise at hand:

    edf = M·R(0)² / Σ_k (1 − |k|/M)·R(k)²        (|k| < M)

which is the definition that the usual approximations stand for (C. A. Greenhall, W. J. Riley,
Uncertainty of stability variances based on finite differences, 35th PTTI, 2003); the interval is then
edf·σ²/χ², SP 1065, eq. (45). The noise is told by its lag-1 autocorrelation (`solver.signals.noise_type`).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import special

from solver.errors import InputError, Message
from solver.signals.noise import checked_interval
from solver.signals.noise_type import FEWEST_TO_IDENTIFY, noise_exponent

Array = NDArray[np.float64]

_FEWEST: Final = 3
LEVEL: Final = 0.95


@dataclass(frozen=True, slots=True)
class AllanDeviation:
    """Allan deviation by averaging time; every array has one entry per averaging factor.

    Attributes
    ----------
    factors : (f,) int array
        Samples in an average.
    tau : (f,) array
        Averaging time, s.
    deviation, low, high : (f,) array
        σ(τ) and the ends of its confidence interval, in the unit of the samples.
    edf : (f,) array
        Equivalent degrees of freedom of σ²(τ).
    exponent : (f,) int array
        α of the noise that dominates at τ, its spectrum going with f^α: 2 quantisation, 1, 0 white
        (angle random walk), −1 flicker (bias instability), −2 random walk (of rate).
    terms : (f,) int array
        Second differences averaged.
    level
        Of the confidence interval.
    duration
        Of the record, s.
    """

    factors: NDArray[np.int64]
    tau: Array
    deviation: Array
    low: Array
    high: Array
    edf: Array
    exponent: NDArray[np.int64]
    terms: NDArray[np.int64]
    level: float
    duration: float


def octave_factors(n: int) -> NDArray[np.int64]:
    """Averaging factors 1, 2, 4, … up to half of n samples, as far as two averages reach."""
    return np.int64(2) ** np.arange(max(1, (n // 2).bit_length()), dtype=np.int64)


def decade_factors(n: int) -> NDArray[np.int64]:
    """Averaging factors 1, 2, 5, 10, 20, … up to half of n samples."""
    decades = range(len(str(n)))
    every = np.array([step * 10**decade for decade in decades for step in (1, 2, 5)], dtype=np.int64)
    return every[every <= max(1, n // 2)]


def allan_deviation(samples: ArrayLike, factors: Sequence[int], *, overlapping: bool = True) -> Array:
    """Allan deviation at the averaging factors, in the unit of the samples, (f,).

    Parameters
    ----------
    samples : (n,) array_like
        Evenly sampled values (of a rate or current, not of phase).
    factors
        Samples in an average; at most n // 2.
    overlapping
        Average over every second difference; else over those that begin m samples apart (SP 1065's
        "original" estimator).

    Raises
    ------
    InputError
        With fewer than three samples, one that is not finite, or a factor that does not fit.
    """
    phase = _phase(_values(samples))
    return deviation_of_phase(phase, factors, overlapping=overlapping)


def deviation_of_phase(phase: Array, factors: Sequence[int], *, overlapping: bool = True) -> Array:
    """Allan deviation of the rate of a phase in units of its sampling interval, (f,).

    Parameters
    ----------
    phase : (n + 1,) array
        Running sum of the samples, its first value the beginning of the first sample.
    factors, overlapping
        As in `allan_deviation`.
    """
    return np.array([_deviation(phase, int(factor), overlapping)[0] for factor in factors])


def allan(
    samples: ArrayLike,
    interval: float,
    factors: Sequence[int] | NDArray[np.int64] | None = None,
    *,
    overlapping: bool = True,
    level: float = LEVEL,
) -> AllanDeviation:
    """Allan deviation of a record with confidence intervals.

    Parameters
    ----------
    samples : (n,) array_like
        Evenly sampled values.
    interval
        Between samples, s.
    factors
        Averaging factors; octaves up to half the record unless given.
    overlapping
        As in `allan_deviation`.
    level
        Of the confidence interval.

    Raises
    ------
    InputError
        As `allan_deviation`; also when the interval is not positive.
    """
    values = _values(samples)
    checked_interval(interval)
    n = len(values)
    chosen = octave_factors(n) if factors is None else np.asarray(factors, dtype=np.int64)
    phase = _phase(values)
    found = [_deviation(phase, int(factor), overlapping) for factor in chosen]
    deviation = np.array([value for value, _ in found])
    terms = np.array([count for _, count in found], dtype=np.int64)
    exponent = _exponents(values, chosen)
    stride = np.ones_like(chosen) if overlapping else chosen
    edf = np.array(
        [
            equivalent_dof(int(m), int(count), int(alpha), int(step))
            for m, count, alpha, step in zip(chosen, terms, exponent, stride, strict=True)
        ]
    )
    tail = (1.0 - level) / 2.0
    low = deviation * np.sqrt(edf / special.chdtri(edf, tail))
    high = deviation * np.sqrt(edf / special.chdtri(edf, 1.0 - tail))
    return AllanDeviation(
        chosen,
        chosen.astype(np.float64) * interval,
        deviation,
        low,
        high,
        edf,
        exponent,
        terms,
        level,
        n * interval,
    )


def equivalent_dof(factor: int, terms: int, exponent: int, stride: int = 1) -> float:
    """Equivalent degrees of freedom of an Allan variance.

    Parameters
    ----------
    factor
        Samples in an average, m.
    terms
        Second differences averaged.
    exponent
        α of the noise, −2 … 2.
    stride
        Samples from one second difference to the next: 1 overlapping, m plain.
    """
    lags = np.arange(terms, dtype=np.float64)
    # Beyond 2m the second differences of white noise and its sum share no sample; flicker's fade as k⁻².
    if exponent in (2, 0, -2):
        lags = lags[lags * stride <= 2 * factor + 1]
    covariance = _of_second_differences(lags * stride, float(factor), exponent)
    weights = np.where(lags == 0.0, 1.0, 2.0) * (1.0 - lags / terms)
    return float(terms / np.sum(weights * (covariance / covariance[0]) ** 2))


def _of_second_differences(lag: Array, m: float, exponent: int) -> Array:
    """Autocovariance of x[i+2m] − 2·x[i+m] + x[i] up to a factor, at each lag."""

    def s(t: Array) -> Array:
        return _generalised_autocovariance(np.abs(t), exponent)

    return 6.0 * s(lag) - 4.0 * (s(lag + m) + s(lag - m)) + s(lag + 2.0 * m) + s(lag - 2.0 * m)


def _generalised_autocovariance(t: Array, exponent: int) -> Array:
    """Of the running sum of noise f^α, up to a polynomial that second differences remove."""
    if exponent == 2:
        return np.where(t == 0.0, 1.0, 0.0)
    if exponent == 1:
        return -0.5 * (_squared_log(t + 1.0) + _squared_log(t - 1.0) - 2.0 * _squared_log(t))
    if exponent == 0:
        return -t
    if exponent == -1:
        return _squared_log(t)
    return t**3


def _squared_log(t: Array) -> Array:
    """t²·ln|t|."""
    return np.asarray(special.xlogy(t * t, np.abs(t)))


def _exponents(values: Array, factors: NDArray[np.int64]) -> NDArray[np.int64]:
    """The noise at each factor; where too few averages are left, as at the last one that tells it."""
    found = np.zeros(len(factors), dtype=np.int64)
    known: int | None = None
    for place, factor in sorted(enumerate(factors), key=lambda item: item[1]):
        if len(values) // factor >= FEWEST_TO_IDENTIFY:
            known = noise_exponent(values, int(factor), known)
        found[place] = known or 0
    return found


def _deviation(phase: Array, factor: int, overlapping: bool) -> tuple[float, int]:
    n = len(phase) - 1
    if not 1 <= factor <= n // 2:
        raise InputError(
            Message(
                "bad-averaging-factor",
                "An average of %(factor)d samples does not fit twice into %(n)d.",
                {"factor": factor, "n": n},
            )
        )
    stride = 1 if overlapping else factor
    second = (phase[2 * factor :] - 2.0 * phase[factor:-factor] + phase[: -2 * factor])[::stride]
    return float(np.sqrt(np.sum(second * second) / (2.0 * len(second)))) / factor, len(second)


def _phase(values: Array) -> Array:
    """Running sum of the deviations from the mean, from zero; the mean would only cost digits."""
    return np.concatenate(([0.0], np.cumsum(values - np.mean(values))))


def _values(samples: ArrayLike) -> Array:
    values = np.asarray(samples, dtype=np.float64)
    if values.ndim != 1 or len(values) < _FEWEST:
        raise InputError(
            Message("too-few-samples", "An Allan deviation needs at least three samples of one channel.")
        )
    if not np.isfinite(values).all():
        row = int(np.argmin(np.isfinite(values))) + 1
        raise InputError(Message("not-finite", "Sample %(row)d is not a finite number.", {"row": row}))
    return values
