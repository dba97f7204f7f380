"""Faults of one ammeter channel: stuck at a value, or clipped at its limit.

Both show as readings that repeat one another where the gyro's currents cannot. Their rows are
disbelieved, and the repetition itself is data that the hypothesis predicts.
"""

from collections.abc import Iterator
from typing import Final

import numpy as np

from solver.blunders.current_model import REGRESSORS
from solver.blunders.hypotheses import Hypothesis, measuring_order
from solver.records import Array, Observations

WITHIN_NOISE: Final = 6.0
"""Largest difference of readings that may be one value, in units of their u: P ≈ 2e-5 for two, and a
longer run is judged by its scatter besides."""
_LEAST_RUN: Final = 2
_RELATIVE: Final = (1e-4, 3e-4, 1e-3, 3e-3)
"""Half the largest difference of readings that may be one value without u(J), parts of the largest current of both
channels (a stuck one may show next to nothing): of the Earth rate 0.003 to 0.1 °/h."""
_HALF_CLIPPED: Final = 0.1
_DIFFERENT: Final = 0.1
_SURE_RUN: Final = 3
_ALIVE: Final = 10.0


def stuck_channels(observations: Observations) -> Iterator[Hypothesis]:
    """Channels whose last readings, in measuring order, repeat one value."""
    order = measuring_order(observations)
    for channel, name in enumerate("xy"):
        currents, tolerances = _channel(observations, channel)
        starts = [_run(currents[order], None)]
        starts += [_run(currents[order], tolerance[order]) for tolerance in tolerances]
        for start in dict.fromkeys(starts):
            run = order[start:]
            if len(run) < _LEAST_RUN:
                continue
            for first in (1, 0):  # frozen at its first, good reading; or at a value of no meaning
                missing = np.zeros((len(order), 2), dtype=np.bool_)
                missing[run[first:], channel] = True
                zero = not currents[run].any()
                yield Hypothesis(
                    "channel-stuck", tuple(int(row) for row in run[first:]), 2 * len(order),
                    free=0 if first or zero else 1, missing=missing, repeated=currents[run],
                    details={"channel": name, "value": float(currents[run[-1]])},
                )  # fmt: skip


def surely_stuck(observations: Observations, x: Array, *, visible: bool) -> str:
    """Channels (of ``xy``) that repeat one value at the end, where the orientation changes.

    Exactly; or within noise from so early on that the rest does not tell the channel's scale factors
    (`visible`), when the fit takes them for endless and is content.
    """
    order = measuring_order(observations)
    found = ""
    for channel, name in enumerate("xy"):
        currents, tolerances = _channel(observations, channel)
        other, quiet = _channel(observations, 1 - channel)
        exact = order[_run(currents[order], None) :]
        runs = [(exact, len(exact) >= _SURE_RUN)]
        for tolerance, least in zip(tolerances, quiet, strict=True):
            near = order[_run(currents[order], tolerance[order]) :]
            early = len(near) >= max(_SURE_RUN, len(order) - REGRESSORS) and not visible
            alive = np.ptp(other[near]) > _ALIVE * least.max()  # so the noise is not larger than all currents
            runs.append((near, early and alive))
        if any(sure and np.ptp(x[run], axis=0).max() > _DIFFERENT for run, sure in runs):
            found += name
    return found


def saturated_channels(observations: Observations) -> Iterator[Hypothesis]:
    """Channels whose largest readings, of either or of both signs, agree."""
    for channel, name in enumerate("xy"):
        currents, tolerances = _channel(observations, channel)
        tried: set[tuple[int, ...]] = set()
        for height in (np.abs(currents), currents, -currents):
            for rows, level in _tops(height, tolerances[0]):
                if len(rows) < _LEAST_RUN or rows in tried:
                    continue
                tried.add(rows)
                missing = np.zeros((len(currents), 2), dtype=np.bool_)
                missing[list(rows), channel] = True
                yield Hypothesis(
                    "channel-saturated", rows, 6, free=1 + len(rows) - level, missing=missing,
                    repeated=np.sort(height[list(rows)])[len(rows) - level :],
                    details={"channel": name, "limit": float(height.max())},
                )  # fmt: skip


def _tops(height: Array, tolerance: Array) -> Iterator[tuple[tuple[int, ...], int]]:
    """Rows at the top, and how many of them agree: equal, equal within noise, and each with the next one.

    The next one may be clipped in a part of its record, so its own mean is free.
    """
    order = np.argsort(-height, kind="stable")
    falling = height[order]
    if not falling[0] > 0:
        return
    within = int(np.sum(falling[0] - falling <= tolerance[order] + tolerance[order[0]]))
    for count in {int(np.sum(falling == falling[0])), within}:
        yield tuple(sorted(int(row) for row in order[:count])), count
        if count < len(order) and falling[count] > falling[0] * (1 - _HALF_CLIPPED):
            yield tuple(sorted(int(row) for row in order[: count + 1])), count


def _channel(observations: Observations, channel: int) -> tuple[Array, list[Array]]:
    """Currents of a channel and how far each may be from a value that it repeats.

    Without u(J) several answers, narrow to wide: which noise the sound readings have is for the fit to say.
    """
    currents = (observations.jx, observations.jy)[channel]
    u = (observations.u_jx, observations.u_jy)[channel]
    if u is None:
        largest = max(float(np.abs(observations.jx).max()), float(np.abs(observations.jy).max()))
        return currents, [np.full(len(currents), relative * largest) for relative in _RELATIVE]
    return currents, [np.asarray(WITHIN_NOISE / 2 * u)]


def _run(currents: Array, tolerance: Array | None) -> int:
    """Where the last run of repeated values begins."""
    backwards = currents[::-1]
    spread = np.maximum.accumulate(backwards) - np.minimum.accumulate(backwards)
    allowed = 0.0 if tolerance is None else 2.0 * np.maximum.accumulate(tolerance[::-1])
    return len(currents) - int(np.argmin(np.append(spread <= allowed, False)))
