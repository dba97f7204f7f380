"""Means of a session's records, drawn without the records."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from simdevice.arrangement import Bench, refuse_twins
from simdevice.certificate import Position
from simdevice.currents import case_in, steady_currents
from simdevice.streams import Part, stream

Array = NDArray[np.float64]

_PIECES = 64
"""Into so many pieces a record is cut, each of which has one current: slow parts move little meanwhile."""


@dataclass(frozen=True, slots=True, eq=False)
class MeanCurrents:
    """Mean currents of a session without its records; arrays (n,), one row per position.

    `jx`, `jy` and their standard uncertainties `u_jx`, `u_jy` in A; the uncertainty is that of the
    white noise (type A) and 0 for a bench without it. `duration` in s and `rate` in Hz say which
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


def mean_currents(bench: Bench, positions: Sequence[Position]) -> MeanCurrents:
    """Means that records of this bench would have, drawn directly.

    A mean of n readings is normal with the expectation of one reading and its standard deviation
    over √n: the noise is white. Expectation and deviation include quantisation and limit
    (`simdevice.ammeter.Channel.moments`). Bias instability, rate random walk, warm-up and
    temperature are those of the record, piece by piece. The numbers are not those of
    `run_session`: the same distribution, from streams of their own.

    Parameters
    ----------
    bench, positions
        As for `run_session`.

    Raises
    ------
    ValueError
        As `run_session`; and when the bench has parts that only a record shows.
    """
    refuse_twins(positions)
    _refuse_what_needs_records(bench)
    lengths = _piece_lengths(bench.samples)
    currents = _expected_currents(bench, positions, lengths)
    sample_std = bench.noise.sample_std(bench.rate)
    deviates = _rate_and_ammeter_deviates(bench.seed, positions)
    noise = bench.gyro.currents_for(sample_std * deviates[:, 0], sample_std * deviates[:, 1])
    per_rate = bench.gyro.currents_for(np.array([1.0, 0.0]), np.array([0.0, 1.0]))
    means, uncertainties = np.empty((2, len(positions))), np.empty((2, len(positions)))
    for number, channel in enumerate(bench.ammeter.channels):
        current_std = sample_std * float(np.hypot(*per_rate[number]))
        _, analogue_std = channel.analogue(0.0, current_std)
        for row, pieces in enumerate(currents[number]):
            moments = [channel.moments(float(current), current_std) for current in pieces]
            expectation, std = moments[0] if len(moments) == 1 else _pooled(moments, lengths)
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


def _refuse_what_needs_records(bench: Bench) -> None:
    present = {
        "the rebalance loop": bench.loop is not None,
        "mains, ripple or jitter": not bench.interference.quiet,
        "faults": bool(bench.faults),
    }
    named = [name for name, there in present.items() if there]
    if named:
        raise ValueError(
            f"Means cannot be drawn without their records: the bench has {', '.join(named)}. "
            "Make the records and take their means."
        )


def _piece_lengths(samples: int) -> NDArray[np.int64]:
    """Samples of each piece of a record."""
    pieces = min(_PIECES, samples)
    return np.diff(np.arange(pieces + 1) * samples // pieces)


def _expected_currents(
    bench: Bench, positions: Sequence[Position], lengths: NDArray[np.int64]
) -> list[list[Array]]:
    """Of each channel, for each position, the currents of the pieces of its record, A; one if all are equal."""
    steady = steady_currents(bench, positions)
    t = np.arange(bench.samples) / bench.rate
    starts = np.cumsum(lengths) - lengths
    expected: list[list[Array]] = [[], []]
    for row, position in enumerate(positions):
        slow = case_in(bench, position).slow(bench.begin(position) + t) if bench.changes else None
        for number in range(2):
            added = np.zeros(1) if slow is None else np.add.reduceat(slow[number], starts) / lengths
            expected[number].append(steady[number][row] + added)
    return expected


def _pooled(moments: Sequence[tuple[float, float]], lengths: NDArray[np.int64]) -> tuple[float, float]:
    """Mean expectation, and the deviation whose square is the mean variance."""
    expectations, deviations = np.array(moments).T
    weights = lengths / lengths.sum()
    return float(weights @ expectations), float(np.sqrt(weights @ deviations**2))


def _rate_and_ammeter_deviates(seed: int, positions: Sequence[Position]) -> Array:
    """Standard normal numbers (n, 4): rate noise x, y, ammeter noise x, y."""
    parts = [(part, axis) for part in (Part.MEAN_RATE_WHITE, Part.MEAN_AMMETER_WHITE) for axis in range(2)]
    return np.array(
        [
            [stream(seed, part, axis, *position.key).standard_normal() for part, axis in parts]
            for position in positions
        ]
    )
