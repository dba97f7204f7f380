"""Noise coefficients of a record: quantisation Q, angle random walk N, bias instability B, rate random walk K.

The model is that of IEEE Std 952-1997, annex C, for a rate (here the current that stands for it), by
its spectrum S(f) (two-sided) and its Allan variance:

    quantisation        (2πf)²·Q²·τ₀     3·Q²/τ²
    angle random walk   N²               N²/τ
    bias instability    B²/(2πf)         (2·ln 2/π)·B²
    rate random walk    K²/(2πf)²        K²·τ/3

It is linear in the squares c = (Q², N², B², K²), none of which is negative. Allan variances at different τ
are correlated and have few degrees of freedom where B and K show, so a weighted fit to them gives
uncertainties that do not hold. The fit is therefore made where the data are independent: to the squares
d_j² of the record's cosine transform (`solver.signals.noise`), whose expectation is S(f_j)/τ₀ at f_j = j/(2T). For
white noise and random walk they are exactly uncorrelated (the cosines are the eigenvectors of both
covariances), for the others nearly; each is χ² with one degree of freedom. Averaged in bands, a band of ν
ordinates has the mean D ~ S·χ²/ν, and maximum likelihood is non-negative least squares of D on c with the
weights ν/(2·S²), repeated with the S of the last round (iteratively reweighted). The Allan variances
are what the found coefficients are checked against.

Intervals are those of the likelihood: the set of values of one coefficient for which twice the log
likelihood, at the best of the others, is within a quantile of χ² with one degree of freedom of the
largest. A coefficient counts as seen when zero is outside at the 1 % level; else the upper end of its
95 % interval is a limit: "not more than that, in this record".

Fast noise often follows none of these laws: a servo loop or a filter cuts it off. Bands are left out at the
upper end until the rest fits (the sum of deviances with p above 1 %).
"""

from collections.abc import Callable
from dataclasses import dataclass
from itertools import combinations
from typing import Final, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import special

from solver.errors import InputError, Message
from solver.signals.noise import Array, checked, checked_interval, cosine_powers, is_constant

Name = Literal["quantisation", "angle_random_walk", "bias_instability", "rate_random_walk"]
NAMES: Final[tuple[Name, ...]] = (
    "quantisation", "angle_random_walk", "bias_instability", "rate_random_walk",
)  # fmt: skip
FEWEST: Final = 256
_SLOWEST_ALONE: Final = 16
_BANDS_PER_OCTAVE: Final = 4
_FEWEST_BANDS: Final = 20
_SEEN: Final = 5.412
"""Quantile of ½·χ²₀ + ½·χ²₁ at 99 %: a coefficient that is zero exceeds it once in a hundred records."""
_LEVEL: Final = 3.841
"""Quantile of χ²₁ at 95 %."""
_MISFIT: Final = 0.01
_ROUNDS: Final = 60
_SECANTS: Final = 20
_TINY: Final = 1e-9
_SUBSETS: Final = {
    n: [np.array(chosen) for size in range(n, 0, -1) for chosen in combinations(range(n), size)]
    for n in (3, 4)
}
_ENOUGH: Final = 1e-3
_NEAR: Final = 0.02
"""Of the log likelihood, twice: what matters of a quantile of 2.7."""


@dataclass(frozen=True, slots=True)
class Coefficient:
    """One coefficient.

    Attributes
    ----------
    value
        In the unit of the samples times s, √s, 1 and 1/√s for Q, N, B, K; None when it is not seen.
    standard_uncertainty
        To first order; None when it is not seen.
    low, high
        95 % interval; when it is not seen, 0 and the limit.
    """

    value: float | None
    standard_uncertainty: float | None
    low: float
    high: float

    @property
    def seen(self) -> bool:
        """Whether the record shows it."""
        return self.value is not None

    def times(self, factor: float) -> "Coefficient":
        """The same in another unit of the samples."""
        if self.value is None or self.standard_uncertainty is None:
            return Coefficient(None, None, 0.0, factor * self.high)
        return Coefficient(
            factor * self.value, factor * self.standard_uncertainty, factor * self.low, factor * self.high
        )


@dataclass(frozen=True, slots=True)
class NoiseCoefficients:
    """What a record's noise is made of.

    Attributes
    ----------
    quantisation, angle_random_walk, bias_instability, rate_random_walk
        Q, N, B, K.
    highest_frequency
        Up to which the record follows the model, Hz; half the sampling rate when all of it does.
    bands
        Fitted.
    p_value
        Of the fit: below 1 % when the record follows the model at no frequency.
    """

    quantisation: Coefficient
    angle_random_walk: Coefficient
    bias_instability: Coefficient
    rate_random_walk: Coefficient
    highest_frequency: float
    bands: int
    p_value: float

    @property
    def fits(self) -> bool:
        """Whether the record follows the model as far as it was fitted."""
        return self.p_value >= _MISFIT


@dataclass(frozen=True, slots=True)
class _Bands:
    """Means of squares by band, (b,), their degrees of freedom, and the spectra of c = 1, (b, 4)."""

    mean: Array
    dof: Array
    shapes: Array
    last: Array


def noise_coefficients(
    samples: ArrayLike, interval: float, *, without_drift: bool = False
) -> NoiseCoefficients | None:
    """Noise coefficients of a record; None when all samples are equal.

    Parameters
    ----------
    samples : (n,) array_like
        At least 256 evenly sampled values.
    interval
        Between samples, s.
    without_drift
        Leave out every other of the slow cosines, those that a steady drift contributes to: then it
        does not look like bias instability or rate random walk.

    Raises
    ------
    InputError
        With too few samples, one that is not finite, or an interval that is not positive.
    """
    values = checked(samples)
    if len(values) < FEWEST:
        raise InputError(
            Message("too-few-samples", "Noise coefficients need at least %(n)d samples.", {"n": FEWEST})
        )
    checked_interval(interval)
    if is_constant(values):
        return None
    values = values[-_smooth(len(values)) :]
    unit = float(np.std(values))  # Squares of squares of amperes would leave the range of numbers.
    bands = _bands(cosine_powers(values / unit), interval, without_drift)
    count, found, p_value = _as_far_as_it_fits(bands)
    used = _Bands(bands.mean[:count], bands.dof[:count], bands.shapes[:count], bands.last[:count])
    coefficients = {name: _coefficient(used, found, place).times(unit) for place, name in enumerate(NAMES)}
    highest = float(used.last[-1]) / (2.0 * len(values) * interval)
    return NoiseCoefficients(**coefficients, highest_frequency=highest, bands=count, p_value=p_value)


def allan_variance(squares: Array, tau: Array) -> Array:
    """σ²(τ) of the model for c = (Q², N², B², K²), (t,): IEEE Std 952-1997, annex C."""
    flat = np.full_like(tau, 2.0 * np.log(2.0) / np.pi)
    return np.asarray(np.column_stack((3.0 / tau**2, 1.0 / tau, flat, tau / 3.0)) @ squares)


def _smooth(n: int) -> int:
    """Largest number of samples up to n whose prime factors are 2, 3 and 5: a fast transform."""
    found = 1
    for twos in range(n.bit_length()):
        for threes in range(n.bit_length()):
            five = 2**twos * 3**threes
            if five > n:
                break
            while five * 5 <= n:
                five *= 5
            found = max(found, five)
    return found


def _bands(powers: Array, interval: float, without_drift: bool) -> _Bands:
    """Slow cosines one by one, then four bands to the octave."""
    n = len(powers) + 1
    j = np.arange(1.0, n)
    sine = 2.0 * np.sin(0.5 * np.pi * j / n)  # 2πf·τ₀ of a difference instead of a derivative.
    shapes = np.column_stack(
        (sine**2 / interval**2, np.full(n - 1, 1.0 / interval), 1.0 / sine, interval / sine**2)
    )
    edges = _SLOWEST_ALONE * 2.0 ** (np.arange(0, 200) / _BANDS_PER_OCTAVE)
    starts = np.unique(np.concatenate((np.arange(_SLOWEST_ALONE), edges[edges < n - 1].astype(np.int64))))
    kept = np.ones(n - 1)
    if without_drift:
        kept[: 4 * _SLOWEST_ALONE : 2] = 0.0
    dof = np.add.reduceat(kept, starts)
    some = dof > 0.0
    mean = np.add.reduceat(powers * kept, starts)[some] / dof[some]
    shape = np.add.reduceat(shapes * kept[:, None], starts, axis=0)[some] / dof[some, None]
    return _Bands(mean, dof[some], shape, np.append(starts[1:], n)[some])


def _as_far_as_it_fits(bands: _Bands) -> tuple[int, Array, float]:
    """Bands used, c, and the p-value of the deviance; an octave less each time that it does not fit."""
    count = len(bands.mean)
    while True:
        part = _Bands(bands.mean[:count], bands.dof[:count], bands.shapes[:count], bands.last[:count])
        squares = _most_likely(part)
        p_value = _goodness(part, squares)
        shorter = count - _BANDS_PER_OCTAVE // 2
        if p_value >= _MISFIT or shorter < _FEWEST_BANDS:
            return count, squares, p_value
        count = shorter


def _goodness(bands: _Bands, squares: Array) -> float:
    """Of the deviance; each band's is scaled to the expectation one (Bartlett's correction of χ²)."""
    ratio = bands.mean / (bands.shapes @ squares)
    deviance = bands.dof * (ratio - 1.0 - np.log(ratio))
    half = 0.5 * bands.dof
    expected = bands.dof * (np.log(half) - special.digamma(half))
    total = float(np.sum(deviance / expected))
    return float(special.chdtrc(max(1, len(ratio) - int(np.sum(squares > 0.0))), total))


def _minus_two_log_likelihood(bands: _Bands, squares: Array) -> float:
    spectrum = bands.shapes @ squares
    if not spectrum.all():
        return float(np.inf)
    return float(np.sum(bands.dof * (np.log(spectrum) + bands.mean / spectrum)))


def _most_likely(bands: _Bands, start: Array | None = None, fixed: tuple[int, float] | None = None) -> Array:
    """The most likely c, none negative; one of them may be `fixed` at a value."""
    free = np.array([place for place in range(4) if fixed is None or place != fixed[0]])
    shapes = bands.shapes[:, free]
    given = bands.shapes[:, fixed[0]] * fixed[1] if fixed else np.zeros(len(bands.mean))
    squares = np.zeros(4) if start is None else start.copy()
    if fixed:
        squares[fixed[0]] = fixed[1]
    spectrum = bands.shapes @ squares
    lowest = _minus_two_log_likelihood(bands, squares)
    if lowest == np.inf:
        spectrum = np.maximum(bands.mean, 1e-9 * np.max(bands.mean))
    for _ in range(_ROUNDS):
        weight = np.sqrt(bands.dof) / spectrum
        likely = np.flatnonzero(squares[free])
        aim = squares.copy()
        aim[free] = _non_negative(shapes * weight[:, None], (bands.mean - given) * weight, likely)
        now = _minus_two_log_likelihood(bands, aim)
        while now > lowest + _ENOUGH:  # Too long a step: half of it, which is non-negative too.
            aim = 0.5 * (aim + squares)
            now = _minus_two_log_likelihood(bands, aim)
        gained, lowest, squares = lowest - now, now, aim
        spectrum = bands.shapes @ squares
        if gained < _ENOUGH:
            break
    return squares


def _non_negative(matrix: Array, right: Array, likely: NDArray[np.int64]) -> Array:
    """Least squares with no negative unknown, of at most four; tried first: those that are `likely` not zero."""
    scale = np.sqrt(np.sum(matrix * matrix, axis=0))
    scaled = matrix / scale
    normal, moment = scaled.T @ scaled, scaled.T @ right
    for some in (likely, *_SUBSETS[len(moment)]):
        if not len(some):
            continue
        found = np.zeros(len(moment))
        found[some] = np.linalg.solve(normal[some[:, None], some], moment[some])
        # Optimal (Karush, Kuhn, Tucker) when no unknown left at zero would lessen the sum by growing.
        if (found >= 0.0).all() and (moment - normal @ found <= _TINY * np.abs(moment)).all():
            return np.asarray(found / scale)
    return np.zeros(len(moment))


def _coefficient(bands: _Bands, found: Array, place: int) -> Coefficient:
    lowest = _minus_two_log_likelihood(bands, found)

    others = found

    def rise(square: float) -> float:
        nonlocal others
        others = _most_likely(bands, others, (place, square))
        return max(0.0, _minus_two_log_likelihood(bands, others) - lowest)

    square = float(found[place])
    if square == 0.0 or rise(0.0) < _SEEN:
        return Coefficient(None, None, 0.0, _end(rise, square, _LEVEL, _step(bands, found, place)) ** 0.5)
    width = _step(bands, found, place)
    high = _end(rise, square, _LEVEL, width)
    low = _end(rise, square, _LEVEL, -width)
    return Coefficient(square**0.5, 0.5 * width / square**0.5, low**0.5, high**0.5)


def _step(bands: _Bands, found: Array, place: int) -> float:
    """Standard uncertainty of one square by Fisher's information, of the unknowns that are not zero."""
    weight = np.sqrt(0.5 * bands.dof) / (bands.shapes @ found)
    some = [other for other in range(4) if found[other] > 0.0 or other == place]
    scaled = bands.shapes[:, some] * weight[:, None]
    size = np.sqrt(np.sum(scaled * scaled, axis=0))
    covariance = np.linalg.inv((scaled / size).T @ (scaled / size))
    here = some.index(place)
    return float(np.sqrt(covariance[here, here])) / float(size[here])


def _end(rise: Callable[[float], float], square: float, level: float, step: float) -> float:
    """Where twice the log likelihood has fallen by `level`, on the side of `step` from the best square."""
    inner, at_inner = square, 0.0
    outer = max(square + step * level**0.5, 0.0)
    at_outer = rise(outer)
    while at_outer < level:
        inner, at_inner = outer, at_outer
        outer = 0.5 * outer if step < 0.0 else square + 2.0 * (outer - square)
        at_outer = rise(outer)
    place = outer
    for _ in range(_SECANTS):
        # The root of the likelihood's fall is nearly a line: its secant finds the end in a few steps.
        share = float((np.sqrt(level) - np.sqrt(at_inner)) / (np.sqrt(at_outer) - np.sqrt(at_inner)))
        place = inner + min(max(share, 0.05), 0.95) * (outer - inner)
        height = rise(place)
        if abs(height - level) < _NEAR:
            break
        if height < level:
            inner, at_inner = place, height
        else:
            outer, at_outer = place, height
    return float(place)
