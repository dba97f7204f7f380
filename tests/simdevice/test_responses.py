"""Tests of step responses and held inputs, against an integration of the two real equations."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from simdevice.dynamics import GVK_6, GVK_6_AS_PRINTED, LoopDynamics, LoopParameters
from simdevice.responses import held_response, settling_time, step_response

Array = NDArray[np.float64]

# Two poles meet at the same place, found once by Newton's method from p(s) = p'(s) = 0 with the
# loop's polynomial p; the eigenvectors of such a loop are of no use.
MEETING = replace(GVK_6, pickoff_gain=7.3598973225035484, integral_time=0.010141546833881692)
LOOPS = {
    "paper": GVK_6,
    "printed": GVK_6_AS_PRINTED,
    "slower": replace(GVK_6, integral_time=3e-2),
    "poles-meet": MEETING,
    "another": LoopParameters(2e-3, 1.1e-6, 2.0, 2.0, 7.0, 8e-2, 2.3e-3),
}
# Of the peak: what the work asks for. The integrator's own tolerance is 1e-12 per step.
CLOSE = 1e-8


def integrated(
    loop: LoopParameters,
    t: Array,
    rates: Sequence[tuple[float, float, float]],
    drift: tuple[float, float] = (0.0, 0.0),
) -> Array:
    """α, β and both measured rates, (4, n), at the times `t`, by scipy's DOP853.

    `rates` holds (begin, ωx, ωy): the case rate from `begin` on, the first from 0. The two real
    equations of the rotor as they stand in the paper; a step of the case rate leaves the rotor's
    inertial rate as it is, so α̇ and β̇ step against it. W is realised as three integrators in a
    chain, W = K·(1 + T1·s)/(T1·T2²·s³ + 2·T1·T2·s² + T1·s), not as in the product.
    """
    h, a, t1, t2 = loop.angular_momentum, loop.inertia, loop.integral_time, loop.lag_time
    k = loop.pickoff_gain * loop.amplifier_gain * loop.torquer_scale
    moment_x, moment_y = h * drift[1], -h * drift[0]  # ωpx = −My/H, ωpy = Mx/H

    def loop_out(chain: Array) -> Array:
        return np.asarray(k * (chain[0] + t1 * chain[1]))

    def slope(_: float, y: Array, wx: float, wy: float) -> list[float]:
        alpha, d_alpha, beta, d_beta = y[:4]
        out = [
            d_alpha, (moment_x - h * (d_beta + wy) - h * loop_out(y[7:])) / a,
            d_beta, (moment_y + h * (d_alpha + wx) + h * loop_out(y[4:7])) / a,
        ]  # fmt: skip
        for angle, chain in ((alpha, y[4:7]), (beta, y[7:])):
            out += [chain[1], chain[2], (angle - 2 * t1 * t2 * chain[2] - t1 * chain[1]) / (t1 * t2**2)]
        return out

    state, before = np.zeros(10), (0.0, 0.0)
    found = np.empty((10, len(t)))
    ends = [begin for begin, *_ in rates[1:]] + [np.inf]
    for (begin, wx, wy), end in zip(rates, ends, strict=True):
        state[1] -= wx - before[0]
        state[3] -= wy - before[1]
        before = (wx, wy)
        wanted = (t >= begin) & (t < end)
        span = (begin, min(end, t[-1]))
        solution = solve_ivp(
            slope, span, state, "DOP853", rtol=1e-12, atol=1e-16, args=(wx, wy), dense_output=True
        )
        assert solution.success
        assert solution.sol is not None
        found[:, wanted] = solution.sol(t[wanted])
        state = solution.y[:, -1].copy()
    return np.array([found[0], found[2], -loop_out(found[4:7]), -loop_out(found[7:])])


@pytest.mark.parametrize("name", LOOPS)
@pytest.mark.parametrize(
    ("rate", "drift"), [((1.0, 0.0), (0.0, 0.0)), ((-0.3, 0.8), (0.05, -0.4))], ids=["figures", "all-at-once"]
)
def test_step_responses_agree_with_integration(
    name: str, rate: tuple[float, float], drift: tuple[float, float]
) -> None:
    response = step_response(LoopDynamics(LOOPS[name]), 0.15, 1e-4, rate=rate, drift=drift)
    assert len(response.t) == 1501
    expected = integrated(LOOPS[name], response.t, [(0.0, *rate)], drift)
    found = (response.alpha, response.beta, response.rate_x, response.rate_y)
    for mine, other in zip(found, expected, strict=True):
        assert np.abs(mine - other).max() <= CLOSE * np.abs(other).max()


def test_the_step_acts_on_the_deflection_at_once_and_on_the_rates_later() -> None:
    """The initial state: u(0⁺) = 0, so the deflection leaves zero with −(ωx + iωy)."""
    response = step_response(LoopDynamics(GVK_6), 1e-6, 1e-8, rate=(1.0, 0.5))
    # After 1e-8 s the nutation has turned by 2.8e-5 rad, the next term of the series.
    assert response.alpha[1] / 1e-8 == pytest.approx(-1.0, rel=1e-4)
    assert response.beta[1] / 1e-8 == pytest.approx(-0.5, rel=1e-4)
    # −W·z begins with t³ (a ramp through two lags): K·t³/(6·T2²) is 3e-17 here, below one rounding.
    assert np.hypot(response.rate_x, response.rate_y)[:2] == pytest.approx(0.0, abs=1e-14)


@pytest.mark.parametrize("name", ["paper", "poles-meet", "another"])
def test_held_inputs_agree_with_integration(name: str) -> None:
    steps = [(0.0, 1.0, 0.0), (0.02, -0.5, 0.7), (0.05, 0.0, 0.0)]
    t = np.linspace(0.0, 0.1, 1001)
    rate = np.zeros(len(t), dtype=np.complex128)
    for begin, wx, wy in steps:
        rate[t >= begin - 1e-9] = complex(wx, wy)
    drift = np.full(len(t), 0.1 - 0.2j)
    z, measured = held_response(LoopDynamics(LOOPS[name]), rate, drift, 1e-4)
    expected = integrated(LOOPS[name], t, steps, (0.1, -0.2))
    for mine, other in zip((z.real, z.imag, measured.real, measured.imag), expected, strict=True):
        assert np.abs(mine - other).max() <= CLOSE * np.abs(other).max()


@pytest.mark.parametrize("n", [1, 2, 63, 64, 65, 1000])
def test_a_held_step_is_the_step_response(n: int) -> None:
    dynamics = LoopDynamics(GVK_6)
    z, measured = held_response(dynamics, np.ones(n, np.complex128), np.zeros(n, np.complex128), 1e-4)
    response = step_response(dynamics, max(n - 1, 1) * 1e-4, 1e-4)
    # Two exact ways: rounding alone, of numbers near 1.
    np.testing.assert_allclose(measured, (response.rate_x + 1j * response.rate_y)[:n], rtol=0, atol=1e-12)
    np.testing.assert_allclose(z, (response.alpha + 1j * response.beta)[:n], rtol=0, atol=1e-14)


def test_an_unstable_response_is_cut_off() -> None:
    dynamics = LoopDynamics(GVK_6_AS_PRINTED)
    response = step_response(dynamics, 10.0, 1e-4)
    growth = dynamics.poles.real.max()
    assert response.cut_off == pytest.approx(7 / growth, rel=1e-12)
    assert response.t[-1] <= response.cut_off < response.t[-1] + 1e-4
    assert np.isfinite([response.alpha, response.beta, response.rate_x, response.rate_y]).all()
    assert step_response(dynamics, 0.05, 1e-4).cut_off is None
    assert step_response(LoopDynamics(GVK_6), 10.0, 1e-4).cut_off is None


def test_the_settling_time_is_the_last_one_outside() -> None:
    dynamics = LoopDynamics(GVK_6)
    for fraction in (0.5, 0.02, 1e-3, 1e-6):
        settled = settling_time(dynamics, fraction)
        response = step_response(dynamics, 1.5, 1e-5)
        left = np.hypot(response.rate_x - 1.0, response.rate_y)
        last = response.t[left > fraction][-1]
        # One step of this axis, and one of the axis that is searched (1/8 radian of the fastest pole).
        assert abs(settled - last) <= 1e-5 + 1 / (8 * 2800)
    # Spec 2.1: settles within tens of milliseconds.
    assert 0.01 < settling_time(dynamics) < 0.1


def test_no_settling_time_without_stability() -> None:
    with pytest.raises(ValueError, match="is unstable"):
        settling_time(LoopDynamics(GVK_6_AS_PRINTED))


@pytest.mark.parametrize(
    ("duration", "interval"), [(1.0, 0.0), (0.0, 1e-3), (1e-3, 1.0), (np.inf, 1.0), (1.0, np.nan)]
)
def test_time_axes_that_cannot_be(duration: float, interval: float) -> None:
    with pytest.raises(ValueError, match="greater than zero"):
        step_response(LoopDynamics(GVK_6), duration, interval)
