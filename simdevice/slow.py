"""Processes that run on from record to record: bias instability and rate random walk.

Both are functions of the time since power-up. They are drawn at knots 0.25 s apart and run straight
between them; below a second a gyro's white noise hides them by orders of magnitude. A process is
drawn from power-up on from streams of its own, so its value at a time depends on seed, axis and
number of the start alone: not on how long the axis is, nor on which moments were asked for.

Bias instability is a sum of first-order Gauss–Markov processes, independent, each of variance s²,
whose time constants T are 1 s, 4 s, … 4⁹ s = 3 days. One has the two-sided power spectral density
2·s²·T/(1 + (2π·f·T)²); with r the ratio of neighbouring time constants the sum is s²/(2·f·ln r)
within the band, so that s² = B²·ln r/π makes it B²/(2π·f); with r = 4 it ripples by 0.3 % about
that. The fastest process has 4/3 of the variance: at low frequencies that is what all faster ones
would add. The Allan deviation is 0.664·B within 1 % for averaging times from 8 s to 2·10⁴ s, and falls
outside of them. The whole variance is 31/3·s² = 4.56·B² at any time.
"""

from functools import lru_cache
from threading import Lock
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg.blas import dtbsv

from simdevice.noise import RateNoise
from simdevice.streams import Part, stream

Array = NDArray[np.float64]

KNOT: Final = 0.25
"""Time between knots, s."""
RATIO: Final = 4.0
TIME_CONSTANTS: Final = tuple(RATIO**number for number in range(10))
"""Of the Gauss–Markov processes that make the flicker noise, s."""
_BLOCK: Final = 4096
"""Knots that are drawn together: part of the numbers, never to be changed."""
_BLOCKS_KEPT: Final = 16


class _Process(NamedTuple):
    """x[i] = kept·x[i−1] + step·w[i] with x[0] = first·w[0] and standard normal w."""

    kept: float
    step: float
    first: float


def _gauss_markov(time_constant: float) -> _Process:
    faster = RATIO / (RATIO - 1) if time_constant == TIME_CONSTANTS[0] else 1.0
    std = float(np.sqrt(faster * np.log(RATIO) / np.pi))
    step = std * float(np.sqrt(-np.expm1(-2 * KNOT / time_constant)))
    return _Process(float(np.exp(-KNOT / time_constant)), step, std)


_UNITS: Final = {
    Part.FLICKER: tuple(_gauss_markov(time_constant) for time_constant in TIME_CONSTANTS),
    Part.RATE_RANDOM_WALK: (_Process(1.0, float(np.sqrt(KNOT)), 0.0),),
}
"""What B = 1 and K = 1 are sums of."""


def wander(noise: RateNoise, seed: int, start: int, t: Array) -> Array:
    """Bias instability and rate random walk at some moments.

    Parameters
    ----------
    noise
        Coefficients B and K.
    seed, start
        Of the session, and the number of the power-up.
    t : (n,) array
        Since power-up, s, not negative, in any order.

    Returns
    -------
    (2, n) array
        Of the measured rates x and y, rad/s.
    """
    place = np.asarray(t, dtype=np.float64) / KNOT
    if not len(place):
        return np.zeros((2, 0))
    if not place.min() >= 0:
        raise ValueError("There is no noise before power-up: give times that are not negative.")
    before = place.astype(np.int64)
    beyond = place - before
    first, last = int(before.min()), int(before.max()) + 2
    before -= first
    rates = np.empty((2, len(place)))
    for axis in range(2):
        knots = np.zeros(last - first)
        for part, coefficient in (
            (Part.FLICKER, noise.bias_instability),
            (Part.RATE_RANDOM_WALK, noise.rate_random_walk),
        ):
            if coefficient:
                knots += coefficient * _axis(part, seed, axis, start).between(first, last)
        rates[axis] = knots[before] + beyond * np.diff(knots)[before]
    return rates


class _Axis:
    """One unit noise of one axis from power-up on, in blocks of which each begins where the last ended.

    What is remembered is a pure function of the arguments: the blocks' first values, and the knots
    of the blocks asked for last, since the records of a session ask for the same ones.
    """

    def __init__(self, part: Part, seed: int, axis: int, start: int) -> None:
        self._processes = _UNITS[part]
        self._key = (seed, part, axis, start)
        self._lock = Lock()
        self._firsts: list[tuple[float, ...]] = [()]  # of every block but the very first, which has none
        self._recent: dict[int, Array] = {}

    def between(self, first: int, last: int) -> Array:
        """Knots number `first` to `last` - 1."""
        blocks = range(first // _BLOCK, (last - 1) // _BLOCK + 1)
        knots = np.concatenate([self.knots(block)[:-1] for block in blocks])
        return knots[first - blocks[0] * _BLOCK : last - blocks[0] * _BLOCK]

    def knots(self, block: int) -> Array:
        """The knots of a block and the first of the next, (_BLOCK + 1,)."""
        with self._lock:
            if block not in self._recent:
                for number in range(min(len(self._firsts) - 1, block), block + 1):
                    knots = self._drawn(number)
                self._recent[block] = knots
                while len(self._recent) > _BLOCKS_KEPT:
                    del self._recent[next(iter(self._recent))]
            return self._recent[block]

    def _drawn(self, block: int) -> Array:
        """A block's knots; notes where the next begins."""
        seed, part, axis, start = self._key
        total = np.zeros(_BLOCK + 1)
        lasts = []
        for number, process in enumerate(self._processes):
            drive = stream(seed, part, axis, number, start, block).standard_normal(_BLOCK + 1)
            # The first number counts in the first block only: later ones go on from their first value.
            drive[0] = process.first * drive[0] if block == 0 else self._firsts[block][number]
            drive[1:] *= process.step
            values = _first_order(process.kept, drive)
            total += values
            lasts.append(float(values[-1]))
        if len(self._firsts) == block + 1:
            self._firsts.append(tuple(lasts))
        return total


@lru_cache(maxsize=16)
def _axis(part: Part, seed: int, axis: int, start: int) -> _Axis:
    return _Axis(part, seed, axis, start)


def _first_order(kept: float, drive: Array) -> Array:
    """Solve x[i] = kept·x[i−1] + drive[i], x[−1] = 0: a triangular system of two diagonals, row by row."""
    matrix = np.empty((2, len(drive)), order="F")
    matrix[0], matrix[1] = 1.0, -kept
    return np.asarray(dtbsv(1, matrix, drive, lower=1, diag=1))
