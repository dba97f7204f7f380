"""What instruments and surroundings add to the current: mains, ripple of the rotor, a clock that jitters.

Mains and ripple are sines of a frequency of their own, sampled like everything else. There is no
filter before the converter, so one above half the sampling rate appears at its alias (`aliased`):
a rotor's 249.9 Hz at 49.9 Hz in 200 samples per second.
"""

from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from simdevice.certificate import Position
from simdevice.streams import Part, stream

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Interference:
    """Disturbances of a record; each is off at 0.

    Attributes
    ----------
    mains
        Amplitude picked up in both channels, A, in one phase that is random from record to record.
    mains_frequency
        Hz.
    ripple
        Amplitude at the rotor's frequency, A: a vector that turns with the rotor, so the y channel
        is a quarter turn behind the x channel. Phase random from record to record.
    spin
        The rotor's speed, rad/s.
    jitter
        Standard deviation of the moment at which a sample is really taken, s: both channels are
        sampled by one clock, the record's times are the nominal ones.
    """

    mains: float = 0.0
    mains_frequency: float = 50.0
    ripple: float = 0.0
    spin: float = 1570.0
    jitter: float = 0.0

    def __post_init__(self) -> None:
        for item in fields(self):
            value = getattr(self, item.name)
            if not (np.isfinite(value) and value >= 0):
                what = item.name.replace("_", " ")
                raise ValueError(f"The {what} is {value}: give a finite number that is not negative.")

    @property
    def quiet(self) -> bool:
        """Whether all of it is off."""
        return not (self.mains or self.ripple or self.jitter)

    @property
    def ripple_frequency(self) -> float:
        """Hz."""
        return self.spin / (2 * np.pi)

    def instants(self, t: Array, seed: int, position: Position) -> Array:
        """When the samples of nominal times `t`, (n,), s, are really taken."""
        if not self.jitter:
            return t
        return t + self.jitter * stream(seed, Part.JITTER, *position.key).standard_normal(len(t))

    def currents(self, t: Array, seed: int, position: Position) -> Array:
        """Mains and ripple, (2, n), A, at (n,) moments since the record's beginning, s."""
        total = np.zeros((2, len(t)))
        if self.mains:
            phase = _phase(seed, Part.MAINS_PHASE, position)
            total += self.mains * np.sin(2 * np.pi * self.mains_frequency * t + phase)
        if self.ripple:
            turned = self.spin * t + _phase(seed, Part.RIPPLE_PHASE, position)
            total += self.ripple * np.array([np.cos(turned), np.sin(turned)])
        return total


def _phase(seed: int, part: Part, position: Position) -> float:
    return float(stream(seed, part, *position.key).uniform(0.0, 2 * np.pi))


def aliased(frequency: float, rate: float) -> float:
    """Where a sine of `frequency` appears when sampled `rate` times a second, in [0, rate/2]; Hz."""
    return abs(frequency - rate * round(frequency / rate))
