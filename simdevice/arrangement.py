"""The bench: gyro, stand and instrument, and all that a session's currents depend on."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from simdevice import closed_loop, faults
from simdevice.ammeter import Ammeter
from simdevice.certificate import Position
from simdevice.dynamics import LoopParameters
from simdevice.faults import Fault, Kind
from simdevice.gyro import Gyro
from simdevice.interference import Interference
from simdevice.noise import RateNoise
from simdevice.stand import Stand
from simdevice.thermal import Temperature, WarmUp
from simdevice.timetable import Timetable


@dataclass(frozen=True, slots=True, eq=False)
class Bench:
    """Everything that a session's currents depend on.

    Attributes
    ----------
    gyro, stand, ammeter, noise
        The true gyro, the true stand, the instrument, the rate noise.
    rate
        Samples per second.
    duration
        Of each record, s.
    seed
        Of the session's noise.
    timetable
        When records begin, after power-up.
    start
        Number of the power-up: another one has another turn-on offset and other slow noise.
    warm_up, temperature
        What drifts with time and temperature; no temperature is known where it is None.
    interference
        Mains, ripple, jitter of the clock.
    loop
        The rebalance loop; None for one that follows at once.
    faults
        Of the records.

    Raises
    ------
    ValueError
        When a value cannot be, the loop is unstable, or a fault cannot strike here.
    """

    gyro: Gyro
    stand: Stand
    ammeter: Ammeter = field(default_factory=Ammeter)
    noise: RateNoise = field(default_factory=RateNoise)
    rate: float = 200.0
    duration: float = 60.0
    seed: int = 0
    timetable: Timetable = field(default_factory=Timetable)
    start: int = 0
    warm_up: WarmUp = field(default_factory=WarmUp)
    temperature: Temperature | None = None
    interference: Interference = field(default_factory=Interference)
    loop: LoopParameters | None = None
    faults: tuple[Fault, ...] = ()

    def __post_init__(self) -> None:
        if not (0 < self.rate < np.inf and 0 < self.duration < np.inf):
            raise ValueError("The sampling rate and the duration must be finite and greater than zero.")
        if self.samples < 1:
            raise ValueError("The record is shorter than one sample: raise the duration or the rate.")
        if self.start < 0:
            raise ValueError(f"The start is number {self.start}: starts count from 0.")
        if self.loop is not None:
            closed_loop.answer(self.loop, self.rate)  # refuses an unstable loop
        if self.faults:
            faults.refuse_impossible(self.faults, self.samples, self.ammeter)
            _ = self.located_faults

    @property
    def samples(self) -> int:
        """Number of samples of a record."""
        return round(self.duration * self.rate)

    @property
    def gyro_in_this_start(self) -> Gyro:
        """The gyro with the turn-on offsets of this power-up: the truth that a session measures."""
        if not self.noise.turn_on:
            return self.gyro
        x, y = self.noise.turn_on_offsets(self.seed, self.start).tolist()
        return self.gyro.shifted({"w0x": x, "w0y": y})

    @property
    def changes(self) -> bool:
        """Whether currents change with the time since power-up."""
        warms = self.temperature is not None and bool(self.temperature.sensitivity)
        return self.noise.wanders or not self.warm_up.quiet or warms

    @property
    def located_faults(self) -> tuple[Fault, ...]:
        """The faults, each with its place."""
        return faults.located(self.faults, self.stand.certificate, self.seed)

    def kinds_at(self, position: Position) -> tuple[Kind, ...]:
        """What befalls this take of this place."""
        if not self.faults:
            return ()
        return tuple(fault.kind for fault in self.located_faults if fault.hits(position))

    def slot(self, position: Position) -> int:
        """Number of a position's slot in the timetable."""
        certificate = self.stand.certificate
        return position.repeat * len(certificate.theta) + certificate.row_of(position)

    def begin(self, position: Position) -> float:
        """When a position's record begins by the timetable, s after power-up."""
        return self.timetable.begin(self.slot(position), self.duration)

    def before(self, position: Position) -> Position | None:
        """The position of the slot before; None for the first slot."""
        certificate = self.stand.certificate
        repeat, row = divmod(self.slot(position) - 1, len(certificate.theta))
        if repeat < 0:
            return None
        return Position(float(certificate.theta[row]), float(certificate.psi[row]), repeat)


def refuse_twins(positions: Sequence[Position]) -> None:
    """Refuse a session of no position, or of one that is named twice."""
    if not positions:
        raise ValueError("A session needs at least one position.")
    if len({position.key for position in positions}) < len(positions):
        raise ValueError("A position is named twice: give its further measurements the repeats 1, 2, …")
