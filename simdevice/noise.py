"""Noise of the gyro's rate, by the coefficients of IEEE gyro standards."""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True, slots=True)
class RateNoise:
    """Noise coefficients of the measured rate, the same for both axes, independent between them.

    Attributes
    ----------
    angle_random_walk
        N, rad/√s: white rate noise whose integral wanders by N·√t, and whose mean over τ seconds
        has the standard (and Allan) deviation N/√τ.
    """

    angle_random_walk: float = 0.0

    def __post_init__(self) -> None:
        if not (np.isfinite(self.angle_random_walk) and self.angle_random_walk >= 0):
            raise ValueError("The angle random walk must be a finite number that is not negative.")

    def sample_std(self, rate: float) -> float:
        """Standard deviation, rad/s, of one of `rate` samples per second: a mean over 1/rate seconds."""
        return self.angle_random_walk * float(np.sqrt(rate))
