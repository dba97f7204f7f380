"""Whether the currents have come to rest: the slope of a line through the last readings, and how well it is known.

A line J = J₀ + b·t is fitted to the readings of a window by least squares. With n readings, S = Σ(t − t̄)² and
the residuals' scatter s² (n − 2 degrees of freedom), u(b) = s/√S (Draper and Smith, Applied Regression
Analysis, 1.4). A channel is at rest when |b| + t·u(b) is below the limit, which says more than that no slope
was seen: so large a one would have been. It drifts when |b| − t·u(b) is above; in between nobody knows yet.

The noisier the readings, the longer the window that can tell: u(b) falls with its length to the power 3/2. So the
last w seconds are judged, then the last 2w, 4w, 8w, and the first window that shows rest is believed. Warm-up is
judged in the same way with a longer w.
"""

from dataclasses import dataclass
from typing import Final

import numpy as np
from scipy.special import stdtrit

from app.station.contracts import Array

_NA_PER_MA: Final = 1e6
_FEWEST: Final = 10
_WINDOWS: Final = (1, 2, 4, 8)


@dataclass(frozen=True, slots=True)
class RestRule:
    """When a channel is at rest.

    Attributes
    ----------
    window_s
        The shortest window, s.
    limit_na_per_s
        Largest slope of a channel at rest, nA/s.
    confidence
        Probability, of each look, with which the slope is below the limit.
    allowed_s
        After so long without rest somebody has to look, s.
    """

    window_s: float
    limit_na_per_s: float
    confidence: float = 0.99
    allowed_s: float = 600.0


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
    """What the readings say.

    Attributes
    ----------
    settled
        True at rest, False drifting, None not known yet.
    x, y
        The channels' slopes in the window that says so; None while there are too few readings.
    """

    settled: bool | None
    x: Slope | None = None
    y: Slope | None = None


class RestWatch:
    """Judges readings as they come, in the order of their times."""

    def __init__(self, rule: RestRule) -> None:
        self._rule = rule
        self._rows = np.empty((64, 3))
        self._count = 0
        self._since = 0.0

    def clear(self) -> None:
        """Forget all readings: the stand has moved."""
        self._count = 0

    def add(self, t_s: float, jx_ma: float, jy_ma: float) -> Rest:
        """Add a reading and judge."""
        if not self._count:
            self._since = t_s
        if self._count == len(self._rows):
            self._make_room(t_s)
        self._rows[self._count] = t_s, jx_ma, jy_ma
        self._count += 1
        return self.judged()

    def judged(self) -> Rest:
        """What the readings say so far; nothing before the shortest window is full."""
        rows = self._rows[: self._count]
        verdict = Rest(None)
        for windows in _WINDOWS:
            length = windows * self._rule.window_s
            if not len(rows) or rows[-1, 0] - self._since < length:
                break
            first = int(np.searchsorted(rows[:, 0], rows[-1, 0] - length))
            found = self._window(rows[min(first, max(len(rows) - _FEWEST, 0)) :])
            if found.settled:
                return found
            if verdict.settled is None:
                verdict = found
        return verdict

    def _window(self, rows: Array) -> Rest:
        t_s, jx_ma, jy_ma = rows.T
        if len(rows) < _FEWEST or t_s[-1] == t_s[0]:
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

    def _make_room(self, now_s: float) -> None:
        """Drop what no window reaches any more; double the room when that does not halve it."""
        oldest = now_s - _WINDOWS[-1] * self._rule.window_s
        kept = self._rows[np.searchsorted(self._rows[:, 0], oldest) :]
        room = max(len(self._rows), 2 * len(kept))
        rows = np.empty((room, 3))
        rows[: len(kept)] = kept
        self._rows, self._count = rows, len(kept)
