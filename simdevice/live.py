"""Currents as they are now: for an instrument that shows readings while time goes on.

Unlike a record, which follows the timetable whenever it is made, a live reading follows the actual
time since power-up and since the last move.
"""

import numpy as np

from simdevice.arrangement import Bench
from simdevice.certificate import Position
from simdevice.currents import case_in, total


def live_current(
    bench: Bench,
    place: Position,
    t_since_power_on: float,
    t_since_move: float,
    previous_place: Position | None,
) -> tuple[float, float]:
    """Expected currents now, without white noise, mains, ripple and the ammeter.

    Depends on bench, place and times alone: steady current, warm-up, temperature and wander at the
    actual time, and what is left of the transient of the last move.

    Parameters
    ----------
    bench
        Its faults and its timetable do not matter.
    place
        Where the case really stands; the certificate must cover it. The repeat does not matter.
    t_since_power_on
        s, not negative.
    t_since_move
        Since the case came to rest, s.
    previous_place
        Where it stood before; None for no move: no transient.

    Returns
    -------
    jx, jy : float
        True currents, A.
    """
    case = case_in(bench, place)
    parts = [case.steady()[:, None], case.slow(np.array([t_since_power_on]))]
    if previous_place is not None:
        parts.append(case.transient(case_in(bench, previous_place), np.array([t_since_move])))
    currents = total([part for part in parts if part is not None])
    assert currents is not None
    jx, jy = currents[:, 0].tolist()
    return jx, jy
