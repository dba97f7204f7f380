"""What temperature does: biases that warm up, and parameters that follow the temperature."""

from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from typing import Final

import numpy as np
from numpy.typing import NDArray

from simdevice.gyro import Gyro

Array = NDArray[np.float64]

ZERO_CELSIUS: Final = 273.15
"""K."""
ROOM: Final = 20.0 + ZERO_CELSIUS
"""Temperature at which a gyro's parameters hold, K."""


@dataclass(frozen=True, slots=True)
class Decay:
    """amplitude·exp(−t/time_constant): rad/s at power-up, s."""

    amplitude: float = 0.0
    time_constant: float = 600.0

    def __post_init__(self) -> None:
        if not np.isfinite(self.amplitude):
            raise ValueError("The warm-up's amplitude must be a finite number.")
        if not 0 < self.time_constant < np.inf:
            raise ValueError("The warm-up's time constant must be a finite number above zero.")

    def at(self, t: Array) -> Array:
        """Value at times since power-up, s; any shape."""
        return self.amplitude * np.exp(-t / self.time_constant)


@dataclass(frozen=True, slots=True)
class WarmUp:
    """What w0x and w0y have too much while the gyro warms up, each a decay of its own."""

    x: Decay = field(default_factory=Decay)
    y: Decay = field(default_factory=Decay)

    @property
    def quiet(self) -> bool:
        """Whether nothing drifts."""
        return not (self.x.amplitude or self.y.amplitude)

    def drifts(self, t: Array) -> Array:
        """Excess of w0x and w0y, (2, n), rad/s, at (n,) times since power-up, s."""
        return np.array([self.x.at(t), self.y.at(t)])


@dataclass(frozen=True, slots=True)
class Temperature:
    """The gyro's temperature and what follows it.

    T(t) = at_power_up + drift·t + swing·sin(2π·t/period), and a parameter is its value at `reference`
    plus sensitivity·(T − reference).

    Attributes
    ----------
    at_power_up, reference
        K.
    drift
        K/s.
    swing, period
        Of a room's regulation, K and s.
    sensitivity
        Per parameter of `Gyro`, SI per K; 0 where not named.
    """

    at_power_up: float = ROOM
    drift: float = 0.0
    swing: float = 0.0
    period: float = 3600.0
    reference: float = ROOM
    sensitivity: Mapping[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if not np.isfinite([self.at_power_up, self.drift, self.swing, self.reference]).all():
            raise ValueError("Temperatures, their drift and their swing must be finite numbers.")
        if not 0 < self.period < np.inf:
            raise ValueError("The period of the temperature's swing must be a finite number above zero.")
        unknown = set(self.sensitivity) - {item.name for item in fields(Gyro)}
        if unknown:
            raise ValueError(f"A gyro has no parameter {', '.join(sorted(unknown))}.")

    def at(self, t: Array) -> Array:
        """Temperature, K, at times since power-up, s; any shape."""
        return self.at_power_up + self.drift * t + self.swing * np.sin(2 * np.pi / self.period * t)

    def currents(self, gyro: Gyro, rate: Array, specific_force: Array, t: Array) -> Array:
        """What the temperature adds to the steady currents of one position.

        Parameters
        ----------
        gyro
            At the reference temperature.
        rate, specific_force : (3,) arrays
            As for `Gyro.steady_currents`.
        t : (n,) array
            Since power-up, s.

        Returns
        -------
        (2, n) array
            Steady currents at the temperature less those at the reference, A.
        """
        if not self.sensitivity:
            return np.zeros((2, len(t)))
        warmer = self.at(t) - self.reference
        per_kelvin = {item.name: self.sensitivity.get(item.name, 0.0) for item in fields(Gyro)}
        kx, ky, kxy, kyx = (
            getattr(gyro, name) + per_kelvin[name] * warmer for name in ("kx", "ky", "kxy", "kyx")
        )
        drift = np.array(gyro.drift(specific_force))
        # Drift is linear in its parameters, so its change is the drift of the changed parameters alone.
        change = gyro.shifted({name: per_kelvin[name] for name in _DRIFTS}).drift(specific_force) - drift
        x, y = rate[:2, None] - drift[:, None] - change[:, None] * warmer
        determinant = kx * ky - kxy * kyx
        steady = np.array(gyro.steady_currents(rate, specific_force))
        added: Array = np.array([ky * x - kxy * y, kx * y - kyx * x]) / determinant - steady[:, None]
        return added


_DRIFTS: Final = ("w0x", "w0y", "wg", "wk", "wn")
