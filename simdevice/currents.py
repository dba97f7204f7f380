"""The parts of a session's currents, each by itself; `simdevice.bench` says what they are."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from simdevice import closed_loop, slow
from simdevice.arrangement import Bench
from simdevice.certificate import Position
from simdevice.gyro import Gyro
from simdevice.streams import Part, stream

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Case:
    """The gyro at rest in one place, as `case_in` makes it.

    Attributes
    ----------
    bench
        All that does not depend on the place.
    gyro
        As it is in this start.
    rate, force : (3,) arrays
        What the case feels along its axes: rad/s and g.
    """

    bench: Bench
    gyro: Gyro
    rate: Array
    force: Array

    def steady(self) -> Array:
        """Steady currents, (2,), A: warm, and at the reference temperature."""
        return np.array(self.gyro.steady_currents(self.rate, self.force))

    def slow(self, t: Array) -> Array | None:
        """What differs from the steady currents and changes slowly: wander, warm-up, temperature.

        Parameters
        ----------
        t : (n,) array
            Since power-up, s, not negative.

        Returns
        -------
        (2, n) array, or None
            A; None when there is no such part.
        """
        bench, parts = self.bench, list[Array]()
        if bench.noise.wanders:
            parts.append(slow.wander(bench.noise, bench.seed, bench.start, t))
        if not bench.warm_up.quiet:
            # More drift is less current: it turns the rotor in the torquers' stead.
            parts.append(-bench.warm_up.drifts(t))
        rates = total(parts)
        if rates is not None:
            parts = [np.array(self.gyro.currents_for(rates[0], rates[1]))]
        if bench.temperature is not None and bench.temperature.sensitivity:
            # Of the gyro without its turn-on offset: parts add up, products of two small ones are left out.
            parts.append(bench.temperature.currents(bench.gyro, self.rate, self.force, t))
        return total(parts)

    def transient(self, previous: "Case", t: Array) -> Array | None:
        """What is left of the transient of a move from the previous place.

        Parameters
        ----------
        previous
            Where the case was.
        t : (n,) array
            Since the case came to rest here, s.

        Returns
        -------
        (2, n) array, or None
            A; None without a loop.
        """
        if self.bench.loop is None:
            return None
        rate_step = self.rate[:2] - previous.rate[:2]
        drift_step = np.array(self.gyro.drift(self.force)) - np.array(self.gyro.drift(previous.force))
        x, y = closed_loop.transient(self.bench.loop, rate_step, drift_step, t)
        return np.array(self.gyro.currents_for(x, y))


def case_in(bench: Bench, position: Position) -> Case:
    """The gyro at rest in a place; the position's repeat does not matter.

    Raises
    ------
    ValueError
        When the stand's certificate does not cover the place.
    """
    (rate,), (force,) = bench.stand.felt([position])
    return Case(bench, bench.gyro_in_this_start, rate, force)


def steady_currents(bench: Bench, positions: Sequence[Position]) -> tuple[Array, Array]:
    """True steady currents in each position, A, (n,) each.

    No noise, no instrument; warm, and at the reference temperature.
    """
    return bench.gyro_in_this_start.steady_currents(*bench.stand.felt(positions))


def white_currents(bench: Bench, position: Position, n: int) -> Array | None:
    """White rate noise through loop and torquers, (2, n), A; None without it."""
    std = bench.noise.sample_std(bench.rate)
    if not std:
        return None
    x, y = (std * normal(bench, Part.RATE_WHITE, axis, position, n) for axis in range(2))
    if bench.loop is not None:
        pulse = closed_loop.answer(bench.loop, bench.rate)
        before = (
            std * normal(bench, Part.RATE_WHITE_BEFORE, axis, position, len(pulse) - 1)[::-1]
            for axis in range(2)
        )
        x, y = (np.concatenate(pair) for pair in zip(before, (x, y), strict=True))
        # Summed sample by sample, not by a Fourier transform, whose rounding would depend on n.
        passed = np.convolve(x + 1j * y, pulse, "valid")
        x, y = passed.real, passed.imag
    return np.array(bench.gyro.currents_for(x, y))


def moving_currents(case: Case, position: Position, begin: float, t: Array) -> Array | None:
    """All of a record that is a function of time.

    Parameters
    ----------
    case
        Where the gyro really is.
    position
        What was asked for: its streams, and its place in the timetable.
    begin
        Of the record, s after power-up.
    t : (n,) array
        When samples are really taken, s after `begin`.

    Returns
    -------
    (2, n) array, or None
        A; None when there is no such part.
    """
    bench = case.bench
    parts = [case.slow(np.maximum(begin + t, 0.0))]
    settle = bench.timetable.settle
    if bench.loop is not None and not closed_loop.forgotten(bench.loop, settle + float(t.min(initial=0.0))):
        previous = bench.before(position)
        if previous is not None:
            parts.append(case.transient(case_in(bench, previous), settle + t))
    if not bench.interference.quiet:
        parts.append(bench.interference.currents(t, bench.seed, position))
    return total([part for part in parts if part is not None])


def total(parts: Sequence[Array]) -> Array | None:
    """Sum of parts in their order, in the place of the first; None of none."""
    if not parts:
        return None
    result = parts[0]
    for part in parts[1:]:
        result += part
    return result


def normal(bench: Bench, part: Part, number: int, position: Position, n: int) -> Array:
    """Standard normal numbers of a record, (n,)."""
    deviates: Array = stream(bench.seed, part, number, *position.key).standard_normal(n)
    return deviates
