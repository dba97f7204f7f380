"""Noise of the gyro's rate, by the coefficients of IEEE gyro standards (IEEE 952, annex C)."""

from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from simdevice.streams import Part, stream

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class RateNoise:
    """Noise coefficients of the measured rate, the same for both axes, independent between them.

    Attributes
    ----------
    angle_random_walk
        N, rad/√s: white rate noise whose integral wanders by N·√t, and whose mean over τ seconds
        has the standard (and Allan) deviation N/√τ.
    bias_instability
        B, rad/s: the flicker coefficient of a power spectral density B²/(2π·f) (two-sided). Its
        Allan deviation is √(2·ln 2/π)·B = 0.664·B at every averaging time (`simdevice.slow`).
    rate_random_walk
        K, rad/s/√s: the rate itself wanders by K·√t; Allan deviation K·√(τ/3).
    turn_on
        Standard deviation of each bias from power-up to power-up, rad/s.
    """

    angle_random_walk: float = 0.0
    bias_instability: float = 0.0
    rate_random_walk: float = 0.0
    turn_on: float = 0.0

    def __post_init__(self) -> None:
        for item in fields(self):
            value = getattr(self, item.name)
            if not (np.isfinite(value) and value >= 0):
                raise ValueError(
                    f"The {item.name.replace('_', ' ')} must be a finite number that is not negative."
                )

    def sample_std(self, rate: float) -> float:
        """Standard deviation, rad/s, of one of `rate` samples per second: a mean over 1/rate seconds."""
        return self.angle_random_walk * float(np.sqrt(rate))

    def turn_on_offsets(self, seed: int, start: int) -> Array:
        """What the start of that number adds to w0x and w0y, (2,), rad/s."""
        if not self.turn_on:
            return np.zeros(2)
        return self.turn_on * stream(seed, Part.TURN_ON, start).standard_normal(2)

    @property
    def wanders(self) -> bool:
        """Whether it has a part that is slow."""
        return bool(self.bias_instability or self.rate_random_walk)
