"""The laboratory that stand and ammeter share: one true gyro on one true stand, and one clock.

A record that is acquired is that of the bench for the place and the take, whenever it is made: the
clock decides only how much of it is there. What is shown live follows the clock.

Faults: those of a record strike by take, as on the bench; those of the stand by movement, so that
the first movement to a place in this process counts as its take 0. An interrupted record is a
connection that breaks in the middle of a block, once for a take.
"""

from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from simdevice.acquisition import Acquisition, acquisition
from simdevice.axes import SLEW_RATE, Angles, Axes, NoSuchPosition, NotAllowed
from simdevice.bench import Bench, position_record
from simdevice.certificate import Position, certify
from simdevice.clock import Clock
from simdevice.faults import OF_STAND, Fault, Kind, located
from simdevice.live import live_current
from simdevice.streams import Part, stream

Array = NDArray[np.float64]

READING_TIME: Final = 0.1
"""Over which a live reading is averaged, s."""
_LONGEST_WANDER: Final = 86_400.0
"""Live readings wander no more after a day, s: slow noise is drawn from power-up on, which takes its time."""
_OF_CONNECTION: Final = (Kind.INTERRUPTED,)


class Laboratory:
    """What is true in the laboratory now; angles in rad, currents in A.

    Parameters
    ----------
    bench
        Without faults of its own.
    clock
        Since the gyro's power-on.
    faults
        Of records, stand and connection.

    Raises
    ------
    ValueError
        When a fault cannot strike here.
    """

    def __init__(self, bench: Bench, clock: Clock, faults: Sequence[Fault] = ()) -> None:
        placed = located(faults, bench.stand.certificate, bench.seed)
        self.bench = replace(
            bench, faults=tuple(item for item in placed if item.kind not in (*OF_STAND, *_OF_CONNECTION))
        )
        self.clock = clock
        self.axes = Axes(bench.stand.certificate, clock)
        self.acquisition: Acquisition | None = None
        self._of_stand = [item for item in placed if item.kind in OF_STAND]
        self._of_connection = [item for item in placed if item.kind in _OF_CONNECTION]
        self._movements: Counter[tuple[int, int]] = Counter()
        self._broken: set[tuple[int, int, int]] = set()

    def move(self, theta: float, psi: float) -> None:
        """Begin to move the stand to the fixed position at these angles.

        Raises
        ------
        NoSuchPosition, NotAllowed
            As `Axes.fixed_position`, `Axes.move`.
        """
        place = self.axes.fixed_position(theta, psi)
        movement = replace(place, repeat=self._movements[place.place])
        mishap = next((fault.kind for fault in self._of_stand if fault.hits(movement)), None)
        self.axes.move(theta, psi, mishap)
        self._movements[place.place] += 1
        self._spoil()

    def home(self) -> None:
        """Begin to seek the stand's reference.

        Raises
        ------
        NotAllowed
            As `Axes.home`.
        """
        self.axes.home()
        self._spoil()

    def currents(self) -> tuple[float, float]:
        """What the ammeter shows now: means over `READING_TIME`."""
        bench, now = self.bench, self.clock.now()
        number = int(now / READING_TIME) % 2**32
        deviates = stream(bench.seed, Part.LIVE_READING, bench.start, number).standard_normal((4, 1))
        std = bench.noise.sample_std(1.0 / READING_TIME)
        noise = bench.gyro_in_this_start.currents_for(std * deviates[0], std * deviates[1])
        averaged = max(np.sqrt(READING_TIME * bench.rate), 1.0)
        true = self._true_currents(now)
        jx, jy = (
            float(channel.read(true[axis] + noise[axis], deviates[2 + axis] / averaged)[0])
            for axis, channel in enumerate(bench.ammeter.channels)
        )
        return jx, jy

    def at_limit(self, currents: tuple[float, float]) -> bool:
        """Whether one of two readings is at its channel's limit."""
        pairs = zip(self.bench.ammeter.channels, currents, strict=True)
        return any(abs(current) >= channel.top for channel, current in pairs)

    def acquire(self, label: int, take: int, count: int, rate: float) -> None:
        """Begin to acquire where the stand is.

        Raises
        ------
        NotAllowed
            When the stand is not at rest in a fixed position: there is no steady current to record.
        ValueError
            When a record cannot be so short or so slow.
        """
        if self.axes.moving:
            raise NotAllowed("the stand moves, and a record is of steady currents")
        try:
            place = self.axes.fixed_position(*self.axes.encoders())
        except NoSuchPosition:
            raise NotAllowed("the stand is between its positions, and a record is of a position") from None
        bench = replace(self.bench, rate=rate)
        if self.axes.slipped:
            bench = replace(bench, faults=(*bench.faults, _wrong(place)))
        record = position_record(bench, replace(place, repeat=take), count)
        self.acquisition = acquisition(label, record, bench.ammeter, self.clock.now(), count, rate)

    def connection_breaks(self) -> bool:
        """Whether the connection breaks now that samples of the acquisition are sent; once for a take."""
        if self.acquisition is None:
            return False
        position = self.acquisition.position
        if position.key in self._broken or not any(item.hits(position) for item in self._of_connection):
            return False
        self._broken.add(position.key)
        return True

    def _spoil(self) -> None:
        """What a movement does to an acquisition: the currents run to their limits, and the rest is lost."""
        if self.acquisition is not None and self.acquisition.running(self.clock.now()):
            self.acquisition.spoil(self.clock.now(), self.bench.ammeter, self._slewing_currents())

    def _slewing_currents(self) -> tuple[float, float]:
        """Currents that would hold the rotor while the stand turns."""
        jx, jy = self.bench.gyro.currents_for(np.array([SLEW_RATE]), np.array([SLEW_RATE]))
        return float(jx[0]), float(jy[0])

    def _true_currents(self, now: float) -> tuple[float, float]:
        if self.axes.turning:
            return self._slewing_currents()
        at, since = self.axes.case(), now - self.axes.at_rest_since
        on = min(now, _LONGEST_WANDER)
        place, before = self._certified(at), self._certified(self.axes.came_from)
        if place is None:
            # Between its positions the stand stands as it says: no certificate knows better.
            stand = replace(self.bench.stand, certificate=certify([at[0]], [at[1]]))
            return live_current(replace(self.bench, stand=stand, faults=()), Position(*at), on, since, None)
        return live_current(self.bench, place, on, since, before)

    def _certified(self, angles: Angles | None) -> Position | None:
        """The fixed position at these angles, if there is one."""
        if angles is None:
            return None
        try:
            return self.axes.fixed_position(*angles)
        except NoSuchPosition:
            return None


def _wrong(place: Position) -> Fault:
    return Fault(Kind.WRONG_POSITION, place.theta, place.psi, every=True)
