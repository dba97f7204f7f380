"""Whether the currents have come to rest: the slope of a line through the last readings, and how well it is known.

A line J = J₀ + b·t is fitted to the readings of a window by least squares. With n readings, S = Σ(t − t̄)² and
the residuals' scatter s² (n − 2 degrees of freedom), u(b) = s/√S (Draper and Smith, Applied Regression
Analysis, 1.4). A channel is at rest when |b| + t·u(b) is below the limit, which says more than that no slope
was seen: so large a one would have been. It drifts when |b| − t·u(b) is above; in between nobody knows yet,
and more readings are wanted. Warm-up is judged in the same way over a longer window.
"""

from collections import deque
from dataclasses import dataclass
from typing import Final

import numpy as np
from scipy.special import stdtrit

from app.station.contracts import Array

_NA_PER_MA: Final = 1e6
_FEWEST: Final = 5


@dataclass(frozen=True, slots=True)
class RestRule:
    """When a channel is at rest.

    Attributes
    ----------
    window_s
        Readings so long back are judged, s.
    limit_na_per_s
        Largest slope of a channel at rest, nA/s.
    confidence
        Probability with which the slope is below the limit (or above it).
    allowed_s
        After so long without rest somebody has to look, s.
    """

    window_s: float
    limit_na_per_s: float
    confidence: float = 0.95
    allowed_s: float = 60.0


@dataclass(frozen=True, slots=True)
class Slope:
    """Slope of a channel and its standard uncertainty, mA/s, with the degrees of freedom of the latter."""

    value: float
    u: float
    dof: int


def slope(t_s: Array, current_ma: Array) -> Slope:
    """Slope of the line through readings (n,) at times (n,), n ≥ 3 and not all at one time."""
    centred = t_s - t_s.mean()
    spread = float(centred @ centred)
    deviations = current_ma - current_ma.mean()
    value = float(centred @ deviations) / spread
    residuals = deviations - value * centred
    dof = len(t_s) - 2
    return Slope(value, float(np.sqrt(residuals @ residuals / dof / spread)), dof)


@dataclass(frozen=True, slots=True)
class Rest:
    """What the readings of the window say.

    Attributes
    ----------
    settled
        True at rest, False drifting, None not known yet.
    x, y
        The channels' slopes; None while there are too few readings.
    """

    settled: bool | None
    x: Slope | None = None
    y: Slope | None = None


class RestWatch:
    """Judges readings as they come, in the order of their times."""

    def __init__(self, rule: RestRule) -> None:
        self._rule = rule
        self._readings: deque[tuple[float, float, float]] = deque()
        self._since: float | None = None

    def clear(self) -> None:
        """Forget all readings: the stand has moved."""
        self._readings.clear()
        self._since = None

    def add(self, t_s: float, jx_ma: float, jy_ma: float) -> Rest:
        """Add a reading and judge those of the window."""
        if self._since is None:
            self._since = t_s
        self._readings.append((t_s, jx_ma, jy_ma))
        while self._readings[0][0] < t_s - self._rule.window_s:
            self._readings.popleft()
        return self.judged()

    def judged(self) -> Rest:
        """What the readings of the window say; nothing before the window is full."""
        if self._since is None or len(self._readings) < _FEWEST:
            return Rest(None)
        t_s, jx_ma, jy_ma = np.array(self._readings, dtype=np.float64).T
        if t_s[-1] - self._since < self._rule.window_s or t_s[-1] == t_s[0]:
            return Rest(None)
        x, y = slope(t_s, jx_ma), slope(t_s, jy_ma)
        verdicts = [self._settled(x), self._settled(y)]
        if False in verdicts:
            return Rest(False, x, y)
        return Rest(None if None in verdicts else True, x, y)

    def _settled(self, channel: Slope) -> bool | None:
        limit = self._rule.limit_na_per_s / _NA_PER_MA
        margin = float(stdtrit(channel.dof, self._rule.confidence)) * channel.u
        if abs(channel.value) + margin <= limit:
            return True
        return False if abs(channel.value) - margin > limit else None
