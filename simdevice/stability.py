"""Why a loop is unstable, and where stability begins.

At little gain the slow poles obey s² ≈ −K/T1 with a damping that has the sign of T1 − 2·T2, and the
nutation's pole moves from i·H/A by W(iH/A), to the left when Re W(iH/A) < 0. With more gain a pole
can cross the axis only where L is real and negative, at ω = ±ω*, ω* = √(1 − 2·T2/T1)/T2 (see
`simdevice.frequency`). As Re W(iω) < 0 says ω > ω*, the loop is stable if and only if

1. T1 > 2·T2, else integrator and lags turn the phase too far at low frequencies, at any gain;
2. H/A > ω*, else the lags turn it too little at the nutation, which grows at any gain;
3. K < K', the gain at which L(iω*) = −1.
"""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from simdevice.dynamics import LoopParameters
from simdevice.frequency import loop_gain, phase_crossing

Reason = Literal["integral-time", "nutation", "gain"]


@dataclass(frozen=True, slots=True)
class Cause:
    """What keeps a loop from being stable.

    Attributes
    ----------
    reason
        ``integral-time``, ``nutation`` or ``gain``: conditions 1, 2, 3.
    limit
        What the integral time must be above, s; what the lag must be above, s; what the gain K must
        be below, 1/s.
    """

    reason: Reason
    limit: float


def cause_of_instability(loop: LoopParameters) -> Cause | None:
    """The first of the three conditions that a loop does not keep; None for a stable loop."""
    t1, t2, nutation = loop.integral_time, loop.lag_time, loop.nutation
    if t1 <= 2 * t2:
        return Cause("integral-time", 2 * t2)
    crossing = phase_crossing(loop)
    if crossing >= nutation:
        # (T2·H/A)² = 1 − 2·T2/T1, solved for T2; written so that nothing cancels.
        root = np.sqrt(1 / t1**2 + nutation**2)
        return Cause("nutation", float(1 / (1 / t1 + root)))
    factor = -1 / float(loop_gain(loop, np.array([crossing]))[0].real)
    return None if factor > 1 else Cause("gain", loop.gain * factor)
