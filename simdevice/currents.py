"""The parts of a session's currents, each by itself; `simdevice.bench` says what they are."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from simdevice import closed_loop, slow
from simdevice.arrangement import Bench
from simdevice.certificate import Position
from simdevice.streams import Part, stream

Array = NDArray[np.float64]


def steady_currents(bench: Bench, positions: Sequence[Position]) -> tuple[Array, Array]:
    """True steady currents in each position, A, (n,) each.

    No noise, no instrument; warm, and at the reference temperature.
    """
    return bench.gyro_in_this_start.steady_currents(*bench.stand.felt(positions))


def slow_currents(bench: Bench, position: Position, t: Array) -> Array | None:
    """What differs from the steady current and changes slowly: wander, warm-up, temperature.

    Parameters
    ----------
    bench, position
        Where the case stands; its repeat does not matter.
    t : (n,) array
        Since power-up, s.

    Returns
    -------
    (2, n) array, or None
        A; None when there is no such part.
    """
    gyro = bench.gyro_in_this_start
    parts: list[Array] = []
    if bench.noise.wanders:
        parts.append(np.array(gyro.currents_for(*slow.wander(bench.noise, bench.seed, bench.start, t))))
    if not bench.warm_up.quiet:
        # More drift is less current: it turns the rotor in the torquers' stead.
        parts.append(np.array(gyro.currents_for(*-bench.warm_up.drifts(t))))
    if bench.temperature is not None and bench.temperature.sensitivity:
        (rate,), (force,) = bench.stand.felt([position])
        parts.append(bench.temperature.currents(gyro, rate, force, t))
    return _total(parts)


def transient_currents(bench: Bench, previous: Position, position: Position, t: Array) -> Array:
    """What is left of the transient of a move, (2, n), A, at times `t` since the case came to rest, s."""
    if bench.loop is None:
        return np.zeros((2, len(t)))
    gyro = bench.gyro_in_this_start
    rate, force = bench.stand.felt([previous, position])
    drift = np.column_stack(gyro.drift(force))
    deviation = closed_loop.transient(bench.loop, rate[1, :2] - rate[0, :2], drift[1] - drift[0], t)
    return np.array(gyro.currents_for(*deviation))


def white_currents(bench: Bench, position: Position, n: int) -> Array | None:
    """White rate noise through loop and torquers, (2, n), A."""
    std = bench.noise.sample_std(bench.rate)
    if not std:
        return None
    rates = [std * normal(bench, Part.RATE_WHITE, axis, position, n) for axis in range(2)]
    if bench.loop is not None:
        pulse = closed_loop.answer(bench.loop, bench.rate)
        before = [
            std * normal(bench, Part.RATE_WHITE_BEFORE, axis, position, len(pulse) - 1)[::-1]
            for axis in range(2)
        ]
        x, y = (np.concatenate(pair) for pair in zip(before, rates, strict=True))
        # Summed sample by sample, not by a Fourier transform, whose rounding would depend on n.
        passed = np.convolve(x + 1j * y, pulse, "valid")
        rates = [passed.real, passed.imag]
    return np.array(bench.gyro_in_this_start.currents_for(rates[0], rates[1]))


def moving_currents(bench: Bench, position: Position, stands_at: Position, t: Array) -> Array | None:
    """All that is a function of time, (2, n), A, at the moments of the samples since the record's begin."""
    parts: list[Array] = []
    unsteady = slow_currents(bench, stands_at, np.maximum(bench.begin(position) + t, 0.0))
    if unsteady is not None:
        parts.append(unsteady)
    previous = bench.before(position)
    if bench.loop is not None and previous is not None:
        parts.append(transient_currents(bench, previous, stands_at, bench.timetable.settle + t))
    if not bench.interference.quiet:
        parts.append(bench.interference.currents(t, bench.seed, position))
    return _total(parts)


def _total(parts: Sequence[Array]) -> Array | None:
    total: Array | None = None
    for part in parts:
        total = part if total is None else total + part
    return total


def normal(bench: Bench, part: Part, number: int, position: Position, n: int) -> Array:
    """Standard normal numbers of a record, (n,)."""
    deviates: Array = stream(bench.seed, part, number, *position.key).standard_normal(n)
    return deviates
