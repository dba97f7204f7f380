"""Propagation of distributions by a Monte Carlo method: JCGM 101:2008. It knows nothing of gyros.

`run` evaluates a model for draws of its inputs, block by block, and keeps of every block only what
grows no further: moments and a histogram (`solver.propagation.intervals`). Each block has its own stream of random
numbers, made from the seed and the block's number alone, and blocks are taken in their order: the
same seed gives the same bits, whatever else runs, and a longer run begins with the draws of a shorter.

Number of trials (7.2, 7.9)
    Fixed, or adaptive: blocks of M = max(10⁴, 100/(1 − p)) draws follow one another until twice the
    standard deviation of the blocks' averages of y, u(y) and both ends of the symmetric interval is within
    the numerical tolerance δ of every output's u, 7.9.4. Its standard deviations from two or three
    blocks are too vague to stop by; here at least `FEWEST_BLOCKS` are drawn.

Numerical tolerance (7.9.2)
    With u = c·10^l, c an integer of n significant digits, δ = 10^l/2. It depends on the unit: an
    angle has other digits in degrees than in radians. `unit` is the unit in which u is to be told.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import ArrayLike

from solver.errors import Message, SolverError
from solver.propagation.intervals import Histogram, Moments
from solver.propagation.uncertainty import LEVEL
from solver.records import Array

Model = Callable[[np.random.Generator, int], Array]
"""``model(rng, count)`` draws the inputs `count` times and gives the outputs, (count, p)."""

TRIALS: Final = 1_000_000
"""JCGM 101, 7.2.2: often enough for two digits of u at 95 %."""
MOST_TRIALS: Final = 10_000_000
"""Where an adaptive run gives up."""
FEWEST_BLOCKS: Final = 10
PROBABILITIES: Final[Array] = np.arange(1, 200) / 200.0
"""Where `MonteCarlo.quantiles` are taken."""


@dataclass(frozen=True, slots=True)
class Adaptive:
    """How an adaptive run ended.

    `digits` significant digits of u were asked for, which makes `tolerance` (p,) of `unit`;
    `reached` tells whether every output is within it; `error` (p,) is twice the largest standard
    deviation of y, u(y) and the interval's ends.
    """

    digits: int
    tolerance: Array
    error: Array
    reached: bool


@dataclass(frozen=True, slots=True)
class MonteCarlo:
    """Distributions of p outputs.

    Attributes
    ----------
    trials, seed : int
    level : float
        Coverage probability of the intervals.
    mean : (p,) array
    covariance : (p, p) array
    symmetric, shortest : (p, 2) array
        Coverage intervals: probabilistically symmetric and shortest.
    errors : (p, 2) array
        Standard errors of the symmetric interval's ends from the finite number of trials.
    resolution : (p, 2) array
        By how much the histogram's bins may falsify these ends, at most.
    quantiles : (p, 199) array
        At `PROBABILITIES`, 0.5 % to 99.5 %: the distribution functions, to be drawn.
    adaptive : Adaptive or None
        None when the number of trials was given.
    """

    trials: int
    seed: int
    level: float
    mean: Array
    covariance: Array
    symmetric: Array
    shortest: Array
    errors: Array
    resolution: Array
    quantiles: Array
    adaptive: Adaptive | None

    @property
    def standard_uncertainties(self) -> Array:
        """Standard deviation of each output, (p,)."""
        return np.asarray(np.sqrt(np.diagonal(self.covariance)))


def run(
    model: Model,
    *,
    trials: int | None = TRIALS,
    seed: int = 0,
    level: float = LEVEL,
    digits: int = 2,
    unit: ArrayLike = 1.0,
    tighten: float = 1.0,
    most: int = MOST_TRIALS,
    report: Callable[[float], None] | None = None,
) -> MonteCarlo:
    """Propagate distributions.

    Parameters
    ----------
    model
        See `Model`; it must not keep what it gives.
    trials
        Number of draws; None for an adaptive number.
    seed
        Not negative.
    level
        Coverage probability.
    digits, unit, tighten, most
        Of an adaptive run: significant digits of u, unit of each output (p,), what δ is divided by (5
        to validate the GUM by, 8.2), and the largest number of draws.
    report
        Called after every block with the fraction done, rising to 1. What it raises ends the run.

    Raises
    ------
    SolverError
        When the model gives a value that is not finite.
    """
    size = max(10_000, int(np.ceil(100 / (1 - level))))
    keep = _Keep(level, digits, np.asarray(unit, np.float64), tighten)
    done = 0.0
    for index, count in _blocks(trials, most, size):
        values = np.ascontiguousarray(model(_stream(seed, index), count).T)
        if not np.isfinite(values).all():
            raise SolverError(
                Message("draw-not-finite", "A draw of the inputs gives no finite result. Check the stated "
                        "uncertainties: one of them may be far too large.")
            )  # fmt: skip
        keep.add(values, blockwise=trials is None)
        reached = False
        if trials is None:
            part = keep.part_done()
            reached = part >= 1.0 and keep.blocks >= FEWEST_BLOCKS
            part = max(keep.count / most, min(part, keep.blocks / FEWEST_BLOCKS, 0.99))
        else:
            part = keep.count / trials
        done = max(done, 1.0 if reached else part)
        if report is not None:
            report(done)
        if reached:
            break
    return keep.result(seed, adaptive=trials is None)


def numerical_tolerance(u: ArrayLike, digits: int = 2, unit: ArrayLike = 1.0) -> Array:
    """δ for standard uncertainties `u` (…) with significant `digits` in `unit`: 7.9.2. 0 for u = 0."""
    size = np.asarray(u, np.float64) / np.asarray(unit, np.float64)
    with np.errstate(divide="ignore", invalid="ignore"):
        exponent = np.floor(np.log10(size)) - (digits - 1)
        exponent += np.round(size / 10.0**exponent) >= 10**digits  # 9.96 is 10 of two digits
        return np.asarray(np.where(size == 0, 0.0, 10.0**exponent / 2) * unit)


def _blocks(trials: int | None, most: int, size: int) -> Iterator[tuple[int, int]]:
    """Number and size of each block."""
    total = most if trials is None else trials
    if total < 2:
        raise ValueError("a Monte Carlo run needs at least two trials")
    for index in range(-(-total // size)):
        yield index, min(size, total - index * size)


def _stream(seed: int, index: int) -> np.random.Generator:
    return np.random.Generator(np.random.SFC64(np.random.SeedSequence(seed, spawn_key=(index,))))


class _Keep:
    """What is kept of the blocks."""

    def __init__(self, level: float, digits: int, unit: Array, tighten: float) -> None:
        self.level, self.digits, self.unit, self.tighten = level, digits, unit, tighten
        self.blocks = 0
        self._histogram: Histogram | None = None
        self._moments: Moments | None = None
        self._averages: Moments | None = None

    @property
    def count(self) -> int:
        return 0 if self._moments is None else self._moments.count

    def add(self, values: Array, *, blockwise: bool) -> None:
        if self._histogram is None or self._moments is None or self._averages is None:
            self._histogram, self._moments = Histogram(values), Moments(len(values))
            self._averages = Moments(4 * len(values))
        self.blocks += 1
        self._moments.add(values)
        if blockwise:
            self._averages.add(_of_block(values, self.level)[:, None])
        self._histogram.add(values)

    def errors(self) -> Array:
        """Twice the standard deviation of the averages over blocks, largest of y, u(y), both ends; (p,)."""
        assert self._averages is not None
        variances = np.diagonal(self._averages.covariance) / self.blocks
        return np.asarray(2 * np.sqrt(variances.reshape(4, -1).max(axis=0)))

    def tolerance(self) -> Array:
        assert self._moments is not None
        u = np.sqrt(np.diagonal(self._moments.covariance))
        return numerical_tolerance(u, self.digits, self.unit) / self.tighten

    def part_done(self) -> float:
        """Blocks done over blocks needed, whose standard deviations fall with the square root; 1 or more at the end."""
        if self.blocks < 2:
            return 0.0
        error, tolerance = self.errors(), self.tolerance()
        if (error <= tolerance).all():
            return 1.0
        with np.errstate(divide="ignore", invalid="ignore"):
            return float(np.nanmin((tolerance / error) ** 2))

    def result(self, seed: int, *, adaptive: bool) -> MonteCarlo:
        assert self._histogram is not None
        assert self._moments is not None
        symmetric = self._histogram.symmetric(self.level)
        outside = (1 - self.level) / 2
        with np.errstate(divide="ignore", invalid="ignore"):
            errors = np.sqrt(outside * (1 - outside) / self.count) / self._histogram.densities(symmetric)
        ended = None
        if adaptive:
            error, tolerance = self.errors(), self.tolerance()
            ended = Adaptive(self.digits, tolerance, error, bool((error <= tolerance).all()))
        return MonteCarlo(
            trials=self.count,
            seed=seed,
            level=self.level,
            mean=self._moments.mean,
            covariance=self._moments.covariance,
            symmetric=symmetric,
            shortest=self._histogram.shortest(self.level),
            errors=np.where(np.ptp(symmetric, axis=1, keepdims=True) > 0, errors, 0.0),
            resolution=self._histogram.resolution(symmetric),
            quantiles=self._histogram.quantiles(PROBABILITIES),
            adaptive=ended,
        )


def _of_block(values: Array, level: float) -> Array:
    """Mean, standard deviation and ends of the symmetric interval of one block, (4p,): 7.6, 7.7."""
    count = values.shape[1]
    inside = int(level * count + 0.5)
    low = (count - inside) // 2
    ends = np.partition(values, (low, low + inside - 1), axis=1)[:, [low, low + inside - 1]]
    return np.concatenate((values.mean(axis=1), values.std(axis=1, ddof=1), ends[:, 0], ends[:, 1]))
