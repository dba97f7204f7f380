"""What the rebalance loop makes of a session: the transient after a move, and the colour of the noise."""

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from simdevice.dynamics import LoopDynamics, LoopParameters

Array = NDArray[np.float64]

_REMEMBERED = 1e-6
"""Of a pulse of noise, what the loop still remembers when it is left out."""
_GONE = 1e-18
"""Of a transient, what is nothing beside the current that it is added to."""


@lru_cache(maxsize=8)
def dynamics_of(parameters: LoopParameters) -> LoopDynamics:
    """The loop's dynamics; the same object for the same parameters, for what it has worked out."""
    return LoopDynamics(parameters)


def transient(
    parameters: LoopParameters, rate_step: Array, drift_step: Array, t: Array
) -> tuple[Array, Array]:
    """How far the measured rates are from steady after a move.

    Parameters
    ----------
    parameters
        Of the loop.
    rate_step, drift_step : (2,) arrays
        Case rate and drift of the new place less those of the old one, x and y, rad/s.
    t : (n,) array
        Since the case came to rest in the new place, s.

    Returns
    -------
    x, y : (n,) arrays
        rad/s.

    Raises
    ------
    ValueError
        When the loop is unstable.
    """
    return dynamics_of(parameters).measured_rates_after_step(
        float(rate_step[0]), float(rate_step[1]), t,
        drift_step_x=float(drift_step[0]), drift_step_y=float(drift_step[1]),
    )  # fmt: skip


def forgotten(parameters: LoopParameters, t: float) -> bool:
    """Whether nothing is left of a transient `t` seconds after the move."""
    return bool(dynamics_of(parameters).poles.real.max() * t < np.log(_GONE))


@lru_cache(maxsize=8)
def answer(parameters: LoopParameters, rate: float) -> NDArray[np.complex128]:
    """Measured rate after a drift noise that lasts one sample, sample by sample.

    Returns
    -------
    (m,) array
        Real part: on the axis of the noise; imaginary part: what it makes on y of noise on x. It ends
        where 1e-6 of it is left, and its sum is 1: slow noise passes as it is.

    Raises
    ------
    ValueError
        When the loop is unstable.
    """
    dynamics = dynamics_of(parameters)
    dynamics.refuse_unstable()
    slowest = float(dynamics.poles.real.max())
    samples = int(np.ceil(np.log(_REMEMBERED) / slowest * rate)) + 1
    t = np.arange(samples + 1) / rate
    x, y = dynamics.measured_rates_after_step(0.0, 0.0, t, drift_step_x=-1.0)
    pulse = np.diff(x + 1j * y)
    pulse.flags.writeable = False
    return pulse
