"""A session on the bench: the records of both currents in every position.

The current of a channel is a sum of parts, each with its own parameters and its own stream:

- the steady current in the place (`Gyro`, `Stand`), of the gyro as it is in this start;
- white rate noise, as the loop passes it on;
- bias instability and rate random walk (`slow`), warm-up and temperature (`thermal`), all of them
  functions of the time since power-up, which the timetable says for every record;
- what is left of the transient after the move (`closed_loop`);
- mains and ripple (`interference`).

The ammeter reads the sum at the moments of its clock, and faults befall what it read. A record
depends on the bench, the position and its repeat alone, so records may be made in any order and by
any number of workers, and the first m of n samples are those of m. A part that is off is neither
drawn nor computed, and a part switched on changes no number of another's: all go through the
torquers of the reference temperature, and with an ammeter without steps the difference of two
sessions is the part alone, to the rounding of the sum. Jitter and faults are no parts of that sum.
"""

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from simdevice import currents, faults
from simdevice.arrangement import Bench, refuse_twins
from simdevice.certificate import Certificate, Position
from simdevice.currents import steady_currents
from simdevice.faults import Kind
from simdevice.gyro import Gyro
from simdevice.means import MeanCurrents, mean_currents
from simdevice.stand import Stand
from simdevice.streams import Part
from simdevice.truth import mean_gyro

Array = NDArray[np.float64]

__all__ = [
    "Bench",
    "MeanCurrents",
    "SimulatedPosition",
    "SimulatedSession",
    "mean_currents",
    "mean_gyro",
    "position_record",
    "run_session",
    "steady_currents",
]


@dataclass(frozen=True, slots=True, eq=False)
class SimulatedPosition:
    """The record of one position.

    Attributes
    ----------
    theta, psi, repeat
        What was asked for, rad.
    t, jx, jy : (n,) arrays
        Time from the record's beginning, s, and both currents as read, A.
    begin
        s after power-up.
    temperature
        Mean of the gyro's temperature over the record, K; None where it is not known.
    overload
        Whether a reading is at the ammeter's limit.
    faults
        What befell it; an interrupted record is one that ends early.
    """

    theta: float
    psi: float
    repeat: int
    t: Array
    jx: Array
    jy: Array
    begin: float = 0.0
    temperature: float | None = None
    overload: bool = False
    faults: tuple[Kind, ...] = ()


@dataclass(frozen=True, slots=True, eq=False)
class SimulatedSession:
    """The records of a session, in the order in which the positions were asked for."""

    bench: Bench
    positions: tuple[SimulatedPosition, ...]

    @property
    def truth(self) -> Gyro:
        """The gyro's true parameters, as they were on average while the records were made."""
        return mean_gyro(self.bench, [Position(item.theta, item.psi, item.repeat) for item in self.positions])

    @property
    def stand(self) -> Stand:
        """The true stand."""
        return self.bench.stand

    @property
    def certificate(self) -> Certificate:
        """What the laboratory knows of the stand."""
        return self.bench.stand.certificate


def position_record(bench: Bench, position: Position, count: int | None = None) -> SimulatedPosition:
    """The record of one take of one position.

    Parameters
    ----------
    bench, position
        All that the record depends on; the take is the position's repeat.
    count
        Samples, default: those of the bench's duration. The timetable's slots keep their length, so
        the first samples do not depend on how many are asked for.

    Raises
    ------
    ValueError
        When the stand's certificate does not cover the position, or no sample is asked for.
    """
    n = bench.samples if count is None else count
    if n < 1:
        raise ValueError(f"A record of {n} samples was asked for: it needs at least one sample.")
    t = np.arange(n) / bench.rate
    begin = bench.begin(position)
    kinds = bench.kinds_at(position)
    case = currents.case_in(bench, faults.wrong(position) if Kind.WRONG_POSITION in kinds else position)
    current = np.repeat(case.steady()[:, None], n, axis=1)
    instants = bench.interference.instants(t, bench.seed, position)
    for part in (
        currents.white_currents(bench, position, n),
        currents.moving_currents(case, position, begin, instants),
    ):
        if part is not None:
            current += part
    jx, jy = (_read(bench, position, number, current[number]) for number in range(2))
    if kinds:
        samples = np.array([t, jx, jy])
        t, jx, jy = faults.afflicted(samples, kinds, position, bench.seed, bench.samples, bench.ammeter)
    return SimulatedPosition(
        position.theta, position.psi, position.repeat, t, jx, jy, begin,
        _mean_temperature(bench, begin),
        any(_overloaded(j, channel.top) for j, channel in zip((jx, jy), bench.ammeter.channels, strict=True)),
        kinds,
    )  # fmt: skip


def run_session(bench: Bench, positions: Sequence[Position], *, workers: int = 1) -> SimulatedSession:
    """Records of all positions.

    Parameters
    ----------
    bench
        What is measured, where and with what.
    positions
        Each place and repeat once, in any order.
    workers
        Threads that share the work (numpy's generators let them run side by side). The records
        are the same to the bit for any number.

    Raises
    ------
    ValueError
        When a position and repeat is named twice, or the certificate does not cover a position.
    """
    refuse_twins(positions)
    if workers < 1:
        raise ValueError(f"There are {workers} workers: give at least one.")
    record = partial(position_record, bench)
    if workers == 1:
        return SimulatedSession(bench, tuple(map(record, positions)))
    with ThreadPoolExecutor(workers) as pool:
        return SimulatedSession(bench, tuple(pool.map(record, positions)))


def _read(bench: Bench, position: Position, number: int, current: Array) -> Array:
    """What a channel of the ammeter shows, A."""
    channel, n = bench.ammeter.channels[number], len(current)
    if not channel.noise:
        return channel.read(current, np.zeros(n))
    return channel.read(current, currents.normal(bench, Part.AMMETER_WHITE, number, position, n))


def _mean_temperature(bench: Bench, begin: float) -> float | None:
    """Mean of the gyro's temperature over a record, K; a hundred moments are enough for one so slow."""
    if bench.temperature is None:
        return None
    return float(bench.temperature.at(begin + np.linspace(0.0, bench.duration, 100)).mean())


def _overloaded(readings: Array, top: float) -> bool:
    return bool(np.isfinite(top) and max(readings.max(initial=0.0), -readings.min(initial=0.0)) >= top)
