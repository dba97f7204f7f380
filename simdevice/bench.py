"""A session on the bench: the records of both currents in every position, or their means alone.

A record is steady current + white rate noise through the torquers, read by the ammeter. Each
position's record depends on the bench and the position alone, so records may be made in any order
and by any number of workers.
"""

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from functools import partial

import numpy as np
from numpy.typing import NDArray

from simdevice.ammeter import Ammeter
from simdevice.certificate import Certificate, Position
from simdevice.gyro import Gyro
from simdevice.noise import RateNoise
from simdevice.stand import Stand
from simdevice.streams import Part, stream

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Bench:
    """Everything that a session's currents depend on.

    Attributes
    ----------
    gyro, stand, ammeter, noise
        The true gyro (as it is in this start), the true stand, the instrument, the rate noise.
    rate
        Samples per second.
    duration
        Of each record, s.
    seed
        Of the session's noise.
    """

    gyro: Gyro
    stand: Stand
    ammeter: Ammeter = field(default_factory=Ammeter)
    noise: RateNoise = field(default_factory=RateNoise)
    rate: float = 200.0
    duration: float = 60.0
    seed: int = 0

    def __post_init__(self) -> None:
        if not (0 < self.rate < np.inf and 0 < self.duration < np.inf):
            raise ValueError("The sampling rate and the duration must be finite and greater than zero.")
        if self.samples < 1:
            raise ValueError("The record is shorter than one sample: raise the duration or the rate.")

    @property
    def samples(self) -> int:
        """Number of samples of a record."""
        return round(self.duration * self.rate)


@dataclass(frozen=True, slots=True, eq=False)
class SimulatedPosition:
    """The record of one position: time from its beginning, s, and both currents as read, A; all (n,)."""

    theta: float
    psi: float
    repeat: int
    t: Array
    jx: Array
    jy: Array


@dataclass(frozen=True, slots=True, eq=False)
class SimulatedSession:
    """The records of a session, in the order in which the positions were asked for."""

    bench: Bench
    positions: tuple[SimulatedPosition, ...]

    @property
    def truth(self) -> Gyro:
        """The gyro's true parameters."""
        return self.bench.gyro

    @property
    def stand(self) -> Stand:
        """The true stand."""
        return self.bench.stand

    @property
    def certificate(self) -> Certificate:
        """What the laboratory knows of the stand."""
        return self.bench.stand.certificate


@dataclass(frozen=True, slots=True, eq=False)
class MeanCurrents:
    """Mean currents of a session without its records; arrays (n,), one row per position.

    `jx`, `jy` and their standard uncertainties `u_jx`, `u_jy` in A; the uncertainty is that of the
    noise (type A) and 0 for a bench without noise. `duration` in s and `rate` in Hz say which
    records the means stand for.
    """

    theta: Array
    psi: Array
    repeat: NDArray[np.int64]
    jx: Array
    jy: Array
    u_jx: Array
    u_jy: Array
    duration: float
    rate: float


def steady_currents(bench: Bench, positions: Sequence[Position]) -> tuple[Array, Array]:
    """True steady currents in each position, A, (n,) each: no noise, no instrument."""
    return bench.gyro.steady_currents(*bench.stand.felt(positions))


def position_record(bench: Bench, position: Position) -> SimulatedPosition:
    """The record of one position.

    Raises
    ------
    ValueError
        When the stand's certificate does not cover the position.
    """
    n = bench.samples

    def normal(part: Part, number: int) -> Array:
        return stream(bench.seed, part, number, *position.key).standard_normal(n)

    sample_std = bench.noise.sample_std(bench.rate)
    noise = bench.gyro.currents_for(
        sample_std * normal(Part.RATE_WHITE, 0), sample_std * normal(Part.RATE_WHITE, 1)
    )
    steady = steady_currents(bench, [position])
    jx, jy = (
        channel.read(steady[number] + noise[number], normal(Part.AMMETER_WHITE, number))
        for number, channel in enumerate(bench.ammeter.channels)
    )
    return SimulatedPosition(position.theta, position.psi, position.repeat, np.arange(n) / bench.rate, jx, jy)


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
    _refuse_twins(positions)
    if workers < 1:
        raise ValueError(f"There are {workers} workers: give at least one.")
    record = partial(position_record, bench)
    if workers == 1:
        return SimulatedSession(bench, tuple(map(record, positions)))
    with ThreadPoolExecutor(workers) as pool:
        return SimulatedSession(bench, tuple(pool.map(record, positions)))


def mean_currents(bench: Bench, positions: Sequence[Position]) -> MeanCurrents:
    """Means that records of this bench would have, drawn directly.

    A mean of n readings is normal with the expectation of one reading and its standard deviation
    over √n: the noise is white. Expectation and deviation include quantisation and limit
    (`simdevice.ammeter.Channel.moments`). The numbers are not those of `run_session`: the same
    distribution, from streams of their own.

    Parameters
    ----------
    bench, positions
        As for `run_session`.

    Raises
    ------
    ValueError
        As `run_session`.
    """
    _refuse_twins(positions)
    currents = steady_currents(bench, positions)
    sample_std = bench.noise.sample_std(bench.rate)
    deviates = _rate_and_ammeter_deviates(bench.seed, positions)
    noise = bench.gyro.currents_for(sample_std * deviates[:, 0], sample_std * deviates[:, 1])
    per_rate = bench.gyro.currents_for(np.array([1.0, 0.0]), np.array([0.0, 1.0]))
    means, uncertainties = np.empty((2, len(positions))), np.empty((2, len(positions)))
    for number, channel in enumerate(bench.ammeter.channels):
        current_std = sample_std * float(np.hypot(*per_rate[number]))
        _, analogue_std = channel.analogue(0.0, current_std)
        for row, current in enumerate(currents[number]):
            expectation, std = channel.moments(float(current), current_std)
            error = channel.gain * noise[number][row] + channel.noise * deviates[row, 2 + number]
            # The reading's own deviation, in proportion to the analogue noise: this keeps the
            # correlation that cross-coupling makes between the channels.
            shrink = std / analogue_std if analogue_std else 0.0
            means[number, row] = expectation + error * shrink / np.sqrt(bench.samples)
            uncertainties[number, row] = std / np.sqrt(bench.samples)
    return MeanCurrents(
        theta=np.array([position.theta for position in positions]),
        psi=np.array([position.psi for position in positions]),
        repeat=np.array([position.repeat for position in positions], dtype=np.int64),
        jx=means[0],
        jy=means[1],
        u_jx=uncertainties[0],
        u_jy=uncertainties[1],
        duration=bench.samples / bench.rate,
        rate=bench.rate,
    )


def _rate_and_ammeter_deviates(seed: int, positions: Sequence[Position]) -> Array:
    """Standard normal numbers (n, 4): rate noise x, y, ammeter noise x, y."""
    parts = [(part, axis) for part in (Part.MEAN_RATE_WHITE, Part.MEAN_AMMETER_WHITE) for axis in range(2)]
    return np.array(
        [
            [stream(seed, part, axis, *position.key).standard_normal() for part, axis in parts]
            for position in positions
        ]
    )


def _refuse_twins(positions: Sequence[Position]) -> None:
    if not positions:
        raise ValueError("A session needs at least one position.")
    if len({position.key for position in positions}) < len(positions):
        raise ValueError("A position is named twice: give its further measurements the repeats 1, 2, …")
