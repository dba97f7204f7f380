"""The loop's motion on a regular time axis: step responses, and the answer to held inputs.

Both are exact: over an interval τ in which case rate and drift are held, the states go from x to
Φ·x + Γ·(ω, ωp), with (Φ, Γ) from one matrix exponential::

    exp | F  B |·τ  =  | Φ  Γ |
        | 0  0 |       | 0  I |

A free motion needs Φ, Φ², Φ⁴, … only: each doubles the number of states that are known.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from simdevice.dynamics import LoopDynamics, exponential

Array = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

_GROWTH = 7.0
"""Time constants after which a growing response, then a thousandfold, is cut off."""
_BLOCK = 64


@dataclass(frozen=True, slots=True, eq=False)
class StepResponse:
    """The loop after a step of the case rate or the drift, from rest.

    Attributes
    ----------
    t : (n,) array
        Since the step, s.
    alpha, beta : (n,) arrays
        Deflections of the rotor against the case, rad.
    rate_x, rate_y : (n,) arrays
        Measured rates, rad/s.
    cut_off
        Where the response of an unstable loop was ended, s, as it would grow without bound; None
        when it was not.
    """

    t: Array
    alpha: Array
    beta: Array
    rate_x: Array
    rate_y: Array
    cut_off: float | None = None


def step_response(
    dynamics: LoopDynamics,
    duration: float,
    interval: float,
    *,
    rate: tuple[float, float] = (1.0, 0.0),
    drift: tuple[float, float] = (0.0, 0.0),
) -> StepResponse:
    """Deflections and measured rates after a step (paper, figures 4 and 5).

    Parameters
    ----------
    dynamics
        The loop, stable or not.
    duration, interval
        Length and step of the time axis, s; the axis begins at the step and ends at `duration`.
    rate, drift
        Steps of the case rate and of the drift about x and y, rad/s.

    Raises
    ------
    ValueError
        When interval or duration is not greater than zero, or the axis is shorter than one interval.
    """
    if not 0 < interval <= duration < np.inf:
        raise ValueError(
            f"A response over {duration} s in steps of {interval} s: both must be finite and greater than zero, "
            "the step the smaller one."
        )
    growth = max(float(dynamics.poles[0].real), 0.0)
    cut_off = _GROWTH / growth if growth * duration > _GROWTH else None
    n = 1 + int((duration if cut_off is None else cut_off) / interval * (1 + 1e-12))
    t = np.arange(n, dtype=np.float64) * interval
    steady = dynamics.steady_state(complex(*rate), complex(*drift))
    states = free_states(exponential(dynamics.matrix, interval), -steady, n)
    # From rest: the steady state and what is not yet there of it.
    z, measured = dynamics.output @ states + (dynamics.output @ steady)[:, None]
    return StepResponse(t, z.real, z.imag, measured.real, measured.imag, cut_off)


def free_states(step: ComplexArray, start: ComplexArray, n: int) -> ComplexArray:
    """States (len(start), n) at 0, 1, … n − 1 intervals: the first 2ᵏ, advanced by Φ^(2ᵏ), are the next."""
    states = np.empty((len(start), n), dtype=np.complex128)
    states[:, 0] = start
    known, power = 1, step
    while known < n:
        more = min(known, n - known)
        np.matmul(power, states[:, :more], out=states[:, known : known + more])
        known += more
        power = power @ power
    return states


def held_response(
    dynamics: LoopDynamics, rate: ComplexArray, drift: ComplexArray, interval: float
) -> tuple[ComplexArray, ComplexArray]:
    """Deflection and measured rate, both as x + iy, under inputs that are held from sample to sample.

    Parameters
    ----------
    dynamics
        The loop; it is at rest at the first sample, before its first input acts.
    rate, drift : (n,) arrays
        ωx + iωy and ωpx + iωpy, rad/s; sample k acts from k·interval to (k + 1)·interval.
    interval
        s.

    Returns
    -------
    z, measured : (n,) arrays
        At the samples' times, rad and rad/s: sample k is not yet moved by input k.
    """
    n, order = len(rate), len(dynamics.matrix)
    step, drive = discretised(dynamics, interval)
    driven = np.zeros((-(-n // _BLOCK) * _BLOCK, order), dtype=np.complex128)
    driven[:n] = np.column_stack((rate, drift)) @ drive.T
    blocks = driven.reshape(-1, _BLOCK, order)
    powers = np.empty((_BLOCK + 1, order, order), dtype=np.complex128)
    powers[0] = np.eye(order)
    for k in range(_BLOCK):
        powers[k + 1] = step @ powers[k]
    # What the inputs of one block add to the state at its end, for all blocks at once …
    added = np.einsum("kij,bkj->bi", powers[_BLOCK - 1 :: -1], blocks, optimize=True)
    starts = np.zeros((len(blocks), order), dtype=np.complex128)
    for k in range(1, len(blocks)):
        starts[k] = powers[_BLOCK] @ starts[k - 1] + added[k - 1]
    # … and within a block, sample by sample, again for all blocks at once.
    states = np.empty_like(blocks)
    states[:, 0] = starts
    for k in range(1, _BLOCK):
        states[:, k] = states[:, k - 1] @ step.T + blocks[:, k - 1]
    z, measured = dynamics.output @ states.reshape(-1, order)[:n].T
    return z, measured


def discretised(dynamics: LoopDynamics, interval: float) -> tuple[ComplexArray, ComplexArray]:
    """Φ, (n, n), and Γ, (n, 2), of one interval in which case rate and drift are held."""
    n = len(dynamics.matrix)
    whole = np.zeros((n + 2, n + 2), dtype=np.complex128)
    whole[:n, :n], whole[:n, n:] = dynamics.matrix, dynamics.inputs
    together = exponential(whole, interval)
    return together[:n, :n], together[:n, n:]


def settling_time(dynamics: LoopDynamics, fraction: float = 0.02) -> float:
    """When the measured rates, as a vector, are for good within `fraction` of a step of the case rate, s.

    Raises
    ------
    ValueError
        When the loop is unstable.
    """
    dynamics.refuse_unstable()
    weights = np.abs(dynamics.mode_weights(-dynamics.steady_state(rate=1.0))[1])
    latest = -1.0 / float(dynamics.poles[0].real)
    while weights @ np.exp(dynamics.poles.real * latest) > fraction:
        latest *= 2.0
    fastest = float(np.abs(dynamics.poles).max())
    t = np.linspace(0.0, latest, int(np.clip(8.0 * fastest * latest, 2_000, 200_000)))
    left = np.hypot(*dynamics.measured_rates_after_step(1.0, 0.0, t))
    last = int(np.flatnonzero(left > fraction)[-1])
    return float(np.interp(-fraction, -left[last : last + 2], t[last : last + 2]))
