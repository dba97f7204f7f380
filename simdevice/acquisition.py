"""An acquisition of the ammeter: a record that becomes available as the laboratory's clock goes on."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from simdevice.ammeter import Ammeter
from simdevice.bench import SimulatedPosition
from simdevice.certificate import Position

Array = NDArray[np.float64]


@dataclass(eq=False)
class Acquisition:
    """Samples so far.

    Attributes
    ----------
    label
        The number by which its user knows it.
    position
        Place that the stand says, and which take.
    rows : (n, 4) array
        Number of the row, time since the beginning in s, both currents in A: all that it will have.
    over : (n,) array
        Which rows have a current at a limit of the ammeter.
    begin, duration
        In laboratory time, s.
    interval
        Time of a sample, s.
    """

    label: int
    position: Position
    rows: Array
    over: NDArray[np.bool_]
    begin: float
    duration: float
    interval: float
    _ended: float = field(default=np.inf, init=False)

    @property
    def end(self) -> float:
        """When it ends or ended, s of laboratory time."""
        return min(self.begin + self.duration, self._ended)

    def running(self, now: float) -> bool:
        """Whether it goes on."""
        return now < self.end

    def available(self, now: float) -> int:
        """How many rows are there: those whose sample's time is over."""
        elapsed = min(now, self._ended) - self.begin
        if elapsed >= self.duration:
            return len(self.rows)
        # Times are sums of rounded numbers: a millionth of a sample is forgiven.
        complete = self.rows[:, 1] + self.interval <= elapsed + 1e-6 * self.interval
        return int(np.count_nonzero(complete))

    def overloaded(self, now: float) -> bool:
        """Whether a row that is there has a current at a limit."""
        return bool(self.over[: self.available(now)].any())

    def stop(self, now: float) -> None:
        """End it; what is there stays."""
        self._ended = min(self.end, now)

    def spoil(self, now: float, ammeter: Ammeter, currents: tuple[float, float]) -> None:
        """Let the rest of it show these true currents, A, as an overload."""
        rest = slice(self.available(now), None)
        for axis, (channel, current) in enumerate(zip(ammeter.channels, currents, strict=True)):
            self.rows[rest, 2 + axis] = channel.read(np.array([current]), np.zeros(1))[0]
        self.over[rest] = True


def acquisition(
    label: int, record: SimulatedPosition, ammeter: Ammeter, begin: float, count: int, rate: float
) -> Acquisition:
    """The acquisition of a record that was asked for with `count` samples and `rate` of them in a second.

    Rows are numbered without a gap, also where samples were dropped: their times show it.
    """
    rows = np.column_stack([np.arange(len(record.t), dtype=np.float64), record.t, record.jx, record.jy])
    tops = [channel.top for channel in ammeter.channels]
    over: NDArray[np.bool_] = np.any(np.abs(rows[:, 2:]) >= tops, axis=1)
    position = Position(record.theta, record.psi, record.repeat)
    return Acquisition(label, position, rows, over, begin, count / rate, 1.0 / rate)
