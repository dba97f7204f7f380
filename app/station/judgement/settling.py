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


def slopes(t_s: Array, currents_ma: Array) -> list[Slope]:
    """Slopes of the lines through readings (n, m) of m channels at times (n,), n ≥ 3 and not all at one time."""
    centred = t_s - t_s.mean()
    spread = centred @ centred
    deviations = currents_ma - currents_ma.mean(axis=0)
    values = centred @ deviations / spread
    residuals = deviations - centred[:, None] * values
    dof = len(t_s) - 2
    uncertainties = np.sqrt(np.einsum("ij,ij->j", residuals, residuals) / dof / spread)
    return [Slope(value, u, dof) for value, u in zip(values.tolist(), uncertainties.tolist(), strict=True)]


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
        if len(rows) < _FEWEST or rows[-1, 0] == rows[0, 0]:
            return Rest(None)
        x, y = slopes(rows[:, 0], rows[:, 1:])
        student = float(stdtrit(x.dof, self._rule.confidence))
        verdicts = [self._settled(channel, student * channel.u) for channel in (x, y)]
        if False in verdicts:
            return Rest(False, x, y)
        return Rest(None if None in verdicts else True, x, y)

    def _settled(self, channel: Slope, margin: float) -> bool | None:
        limit = self._rule.limit_na_per_s / _NA_PER_MA
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
