"""The truth that a session can find: parameters that wander have no other value than their mean."""

from collections.abc import Sequence

import numpy as np

from simdevice import slow
from simdevice.arrangement import Bench
from simdevice.certificate import Position
from simdevice.gyro import Gyro

_MOMENTS = 64
"""Of each record, at which slow parts are looked at: about a second apart, as they change little within it."""


def mean_gyro(bench: Bench, positions: Sequence[Position]) -> Gyro:
    """The gyro as it was on average while the records of these positions were made.

    Parameters
    ----------
    bench
        Its turn-on offset, wander, warm-up and temperature count.
    positions
        The session's.

    Returns
    -------
    Gyro
        The bench's own, when nothing changes it.
    """
    gyro = bench.gyro_in_this_start
    if not bench.changes:
        return gyro
    begins = np.array([bench.begin(position) for position in positions])
    within = (np.arange(_MOMENTS) + 0.5) * (bench.duration / _MOMENTS)
    t = (begins[:, None] + within).ravel()
    if bench.noise.wanders or not bench.warm_up.quiet:
        # What the rate has too much, the drift has too little.
        excess = bench.warm_up.drifts(t) - slow.wander(bench.noise, bench.seed, bench.start, t)
        x, y = excess.mean(axis=1).tolist()
        gyro = gyro.shifted({"w0x": x, "w0y": y})
    known = bench.temperature
    if known is not None and known.sensitivity:
        warmer = float((known.at(t) - known.reference).mean())
        gyro = gyro.shifted({name: slope * warmer for name, slope in known.sensitivity.items()})
    return gyro
