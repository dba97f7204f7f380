"""The two-channel ammeter: what it shows for a current.

    analogue = gain·J + offset + noise
    reading  = step·round(analogue/step), no further from zero than the last step within the limit

A channel without a step (0) is clipped at the limit itself.
"""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr

Array = NDArray[np.float64]

_TAIL = 9.0
"""Standard deviations beyond which a normal variable has no weight in double precision."""
_FINE_STEP = 0.2
"""Quantising by a step below this part of the noise adds noise of step/√12 and no bias: what else it
does is of the order of exp(−2π²/0.2²), nothing in double precision."""
_FINE_STEP_AT_LIMIT = 1e-3
"""The same where the limit cuts the noise: the remainder is of this number's square."""


@dataclass(frozen=True, slots=True)
class Channel:
    """One channel.

    Attributes
    ----------
    gain
        Shown per true current, 1 for an ideal channel.
    offset
        Shown at no current, A.
    step
        Quantisation, A; 0 for none.
    limit
        Largest reading of either sign, A.
    noise
        Standard deviation of the white noise of one sample, A.
    """

    gain: float = 1.0
    offset: float = 0.0
    step: float = 0.0
    limit: float = np.inf
    noise: float = 0.0

    def __post_init__(self) -> None:
        if not (np.isfinite(self.gain) and np.isfinite(self.offset)):
            raise ValueError("An ammeter channel's gain and offset must be finite numbers.")
        if not (0 <= self.step < np.inf and 0 <= self.noise < np.inf):
            raise ValueError("An ammeter channel's step and noise must be finite and not negative.")
        if not self.limit > self.step:
            raise ValueError("An ammeter channel's limit must be greater than its step and than zero.")

    def read(self, current: Array, deviates: Array) -> Array:
        """Readings of a current.

        Parameters
        ----------
        current : (n,) array
            True current, A.
        deviates : (n,) array
            Standard normal numbers, which become the channel's noise.

        Returns
        -------
        (n,) array
            A.
        """
        return self.shown(self.gain * current + self.offset + self.noise * deviates)

    def shown(self, analogue: Array) -> Array:
        """Readings of what arrives at the converter, A: quantised, and no further than the limit."""
        if not self.step:
            return np.clip(analogue, -self.limit, self.limit)
        codes = np.clip(np.rint(analogue / self.step), -self._last_code, self._last_code)
        return codes * self.step + 0.0  # no reading is −0.0

    @property
    def top(self) -> float:
        """The largest reading, A; a reading there says that the current may be larger."""
        return self._last_code * self.step if self.step else self.limit

    def analogue(self, current: float, current_std: float) -> tuple[float, float]:
        """Mean and standard deviation, A, before quantisation and limit; see `moments`."""
        return self.gain * current + self.offset, float(np.hypot(self.gain * current_std, self.noise))

    def moments(self, current: float, current_std: float) -> tuple[float, float]:
        """Expectation and standard deviation of one reading.

        Parameters
        ----------
        current, current_std
            Mean and standard deviation of a normally distributed current, A.

        Returns
        -------
        float, float
            A. Exact for a normal distribution, with the quantisation's bias and the clipping.
        """
        mean, std = self.analogue(current, current_std)
        if std == 0:
            return float(self.read(np.array([current]), np.zeros(1))[0]), 0.0
        inside = abs(mean) + _TAIL * std < self.limit
        if self.step <= (_FINE_STEP if inside else _FINE_STEP_AT_LIMIT) * std:
            return _clipped_moments(mean, float(np.hypot(std, self.step / np.sqrt(12.0))), self.limit)
        first, last = np.clip(
            [np.floor((mean - _TAIL * std) / self.step), np.ceil((mean + _TAIL * std) / self.step)],
            -self._last_code,
            self._last_code,
        )
        codes = np.arange(first, last + 1.0)
        # The outermost codes take everything beyond them: the tail, or what the limit cuts off.
        inner = ndtr(((codes[:-1] + 0.5) * self.step - mean) / std)
        weights = np.diff(inner, prepend=0.0, append=1.0)
        centre = float(weights @ codes)
        return centre * self.step, self.step * float(np.sqrt(weights @ (codes - centre) ** 2))

    @property
    def _last_code(self) -> float:
        # A limit of a whole number of steps must not lose one to rounding: 1e-9 of a step is forgiven.
        return float(np.floor(self.limit / self.step + 1e-9))


@dataclass(frozen=True, slots=True)
class Ammeter:
    """Channel `x` measures Jx, channel `y` measures Jy."""

    x: Channel = field(default_factory=Channel)
    y: Channel = field(default_factory=Channel)

    @property
    def channels(self) -> tuple[Channel, Channel]:
        """Both, x first."""
        return self.x, self.y


def _clipped_moments(mean: float, std: float, limit: float) -> tuple[float, float]:
    """Expectation and standard deviation of a normal variable clipped to ±limit."""
    if abs(mean) + _TAIL * std < limit:
        return mean, std
    low, high = (-limit - mean) / std, (limit - mean) / std
    below, above = ndtr(low), ndtr(-high)
    density_low, density_high = (np.exp(-0.5 * z**2) / np.sqrt(2.0 * np.pi) for z in (low, high))
    inside = 1.0 - below - above
    # Of z = (value − mean)/std, so that the variance is not a difference of large numbers.
    first = density_low - density_high + low * below + high * above
    second = inside + low * density_low - high * density_high + low**2 * below + high**2 * above
    return mean + std * float(first), std * float(np.sqrt(max(second - first**2, 0.0)))
