"""Processes that run on from record to record: bias instability and rate random walk.

Both are functions of the time since power-up. They are drawn at knots 0.25 s apart and run straight
between them; below a second a gyro's white noise hides them by orders of magnitude. A process is
drawn from power-up on from streams of its own, so its value at a time depends on seed, axis and
number of the start alone: not on how long the axis is, nor on which moments were asked for.

Bias instability is a sum of first-order Gauss–Markov processes, independent, each of variance s²,
whose time constants are 1 s, 4 s, … 4⁹ s = 3 days. One has the two-sided power spectral density
2·s²·T/(1 + (2π·f·T)²); with r the ratio of neighbouring time constants the sum is s²/(2·f·ln r)
within the band, so that s² = B²·ln r/π makes it B²/(2π·f). With r = 4 the sum ripples by 0.3 %
about that. Up to the band's ends, periods of 6 s and 19 days, the density is good; the whole variance
is n·s² = 4.4·B².
"""

from functools import lru_cache
from typing import Final

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
_FEWEST_KNOTS: Final = 4096


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
    before = np.floor(place).astype(np.int64)
    if len(before) and before.min() < 0:
        raise ValueError("There is no noise before power-up: give times that are not negative.")
    beyond = place - before
    count = _FEWEST_KNOTS
    while len(before) and before.max() + 2 > count:
        count *= 2
    rates = np.zeros((2, len(place)))
    for axis, rate in enumerate(rates):
        for coefficient, unit in (
            (noise.bias_instability, _flicker),
            (noise.rate_random_walk, _walk),
        ):
            if coefficient:
                knots = unit(seed, axis, start, count)
                rate += coefficient * (knots[before] + beyond * (knots[before + 1] - knots[before]))
    return rates


# Remembered because the records of a session ask for the same knots; what is remembered is a pure
# function of its arguments.
@lru_cache(maxsize=16)
def _flicker(seed: int, axis: int, start: int, count: int) -> Array:
    """Flicker noise of B = 1 at the first `count` knots, stationary from power-up on."""
    std = np.sqrt(np.log(RATIO) / np.pi)
    total = np.zeros(count)
    for number, time_constant in enumerate(TIME_CONSTANTS):
        drive = stream(seed, Part.FLICKER, axis, number, start).standard_normal(count)
        drive[1:] *= np.sqrt(-np.expm1(-2 * KNOT / time_constant))
        total += std * _first_order(np.exp(-KNOT / time_constant), drive)
    total.flags.writeable = False
    return total


def _first_order(kept: float, drive: Array) -> Array:
    """Solve x[i] = kept·x[i−1] + drive[i], x[−1] = 0: a triangular system of two diagonals, row by row."""
    matrix = np.empty((2, len(drive)), order="F")
    matrix[0], matrix[1] = 1.0, -kept
    return np.asarray(dtbsv(1, matrix, drive, lower=1, diag=1))


@lru_cache(maxsize=16)
def _walk(seed: int, axis: int, start: int, count: int) -> Array:
    """Random walk of K = 1 at the first `count` knots, 0 at power-up."""
    steps = np.sqrt(KNOT) * stream(seed, Part.RATE_RANDOM_WALK, axis, start).standard_normal(count)
    steps[0] = 0.0
    walk = np.cumsum(steps)
    walk.flags.writeable = False
    return walk
