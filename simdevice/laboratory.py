"""The laboratory that stand and ammeter share: one true gyro on one true stand, and one clock.

The acquired record of a place and take is that of the bench, whenever it is made: what the clock
decides is only how much of it is there already.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from simdevice.ammeter import Channel
from simdevice.axes import SLEW_RATE, Axes, NoSuchPosition, NotAllowed
from simdevice.bench import Bench, position_record, steady_currents
from simdevice.certificate import Position, certify
from simdevice.clock import Clock

Array = NDArray[np.float64]

READING_TIME: Final = 0.1
"""Over which a live reading is averaged, s."""


@dataclass(eq=False)
class Acquisition:
    """Samples that become available with time.

    Attributes
    ----------
    label, take
        As it was started.
    rows : (n, 4) array
        Index, time since the beginning in s, both currents in A.
    over : (n,) array
        Which samples are at a limit of the ammeter.
    begin, duration
        In laboratory time, s.
    position
        Where the case was.
    """

    label: int
    position: Position
    rows: Array
    over: NDArray[np.bool_]
    begin: float
    duration: float
    sample_time: float
    stopped: float = np.inf

    def running(self, now: float) -> bool:
        """Whether samples are still to come."""
        return now < min(self.begin + self.duration, self.stopped)

    def available(self, now: float) -> int:
        """How many samples are there."""
        elapsed = min(now, self.stopped) - self.begin
        if elapsed >= self.duration:
            return len(self.rows)
        # A sample is there when the time that it is a mean of is over; 1e-9 of it is forgiven.
        return int(np.searchsorted(self.rows[:, 1], elapsed - self.sample_time * (1 - 1e-9), side="right"))


class Laboratory:
    """What is true in the laboratory now."""

    def __init__(self, bench: Bench, clock: Clock, faults: Sequence[str] = ()) -> None:
        self.bench = bench
        self.clock = clock
        self.axes = Axes(bench.stand.certificate, clock)
        self.acquisition: Acquisition | None = None
        self._readings = 0
        self._faults = faults

    def move(self, theta: float, psi: float) -> None:
        """Begin to move the stand to the fixed position at these angles, rad."""
        self.axes.nearest(theta, psi)
        self._disturb()
        self.axes.move(theta, psi)

    def home(self) -> None:
        """Begin to seek the stand's reference."""
        self._disturb()
        self.axes.home()

    def currents(self) -> tuple[float, float]:
        """What the ammeter shows now, A: a mean over `READING_TIME`."""
        self._readings += 1
        rng = np.random.default_rng([self.bench.seed, self._readings])
        deviates = rng.standard_normal((4, 1))
        std = self.bench.noise.sample_std(1.0 / READING_TIME)
        noise = self.bench.gyro.currents_for(std * deviates[0], std * deviates[1])
        average = np.sqrt(READING_TIME * self.bench.rate)
        jx, jy = (
            float(channel.read(true + noise[axis], deviates[2 + axis] / average)[0])
            for axis, (channel, true) in enumerate(
                zip(self.bench.ammeter.channels, self._true_currents(), strict=True)
            )
        )
        return jx, jy

    def over_limit(self, currents: Sequence[float]) -> bool:
        """Whether a reading is at its channel's limit."""
        pairs = zip(self.bench.ammeter.channels, currents, strict=True)
        return any(abs(current) >= _last_reading(channel) for channel, current in pairs)

    def acquire(self, label: int, take: int, samples: int, rate: float) -> None:
        """Begin to acquire where the stand is.

        Raises
        ------
        NotAllowed
            When the case is not at rest in a fixed position: there is no steady current to record.
        """
        if self.axes.moving:
            raise NotAllowed("the stand moves: no steady current to record")
        try:
            place = self.axes.nearest(*self.axes.case())
        except NoSuchPosition:
            raise NotAllowed(
                "the stand is between its fixed positions: no steady current to record"
            ) from None
        position = Position(place.theta, place.psi, take)
        bench = replace(self.bench, rate=rate, duration=samples / rate)
        record = position_record(bench, position)
        rows = np.column_stack([np.arange(len(record.t), dtype=np.float64), record.t, record.jx, record.jy])
        self.acquisition = Acquisition(
            label, position, rows, self._over(rows), self.clock.now(), samples / rate, 1.0 / rate
        )

    def stop_acquiring(self) -> None:
        """End the acquisition; what there is stays."""
        if self.acquisition is not None and self.acquisition.running(self.clock.now()):
            self.acquisition.stopped = self.clock.now()

    def _over(self, rows: Array) -> NDArray[np.bool_]:
        channels = self.bench.ammeter.channels
        over: NDArray[np.bool_] = np.any(
            [np.abs(rows[:, 2 + axis]) >= _last_reading(channel) for axis, channel in enumerate(channels)],
            axis=0,
        )
        return over

    def _disturb(self) -> None:
        """What a movement does to an acquisition: the currents go to their limits and the rest is spoilt."""
        acquisition, now = self.acquisition, self.clock.now()
        if acquisition is None or not acquisition.running(now):
            return
        rest = slice(acquisition.available(now), None)
        for axis, current in enumerate(self._slewing_currents()):
            channel = self.bench.ammeter.channels[axis]
            acquisition.rows[rest, 2 + axis] = channel.read(np.array([current]), np.zeros(1))[0]
        acquisition.over[rest] = True

    def _slewing_currents(self) -> tuple[float, float]:
        """Currents that would hold the rotor while the stand turns at its slew rate, A."""
        jx, jy = self.bench.gyro.currents_for(np.array([SLEW_RATE]), np.array([SLEW_RATE]))
        return float(jx[0]), float(jy[0])

    def _true_currents(self) -> tuple[float, float]:
        if self.axes.moving and np.isfinite(self.axes.left()):
            return self._slewing_currents()
        theta, psi = self.axes.case()
        bench, position = self.bench, Position(theta, psi)
        if position.place not in bench.stand.certificate.places:
            bench = replace(bench, stand=replace(bench.stand, certificate=certify([theta], [psi])))
        jx, jy = steady_currents(bench, [position])
        return float(jx[0]), float(jy[0])


def _last_reading(channel: Channel) -> float:
    """The reading of a current beyond the channel's limit, A."""
    beyond = replace(channel, gain=1.0).read(np.array([np.inf]), np.zeros(1))
    return float(beyond[0])
