"""Tests of the rotor in its rebalance loop."""

import math
import re
from dataclasses import replace

import numpy as np
import pytest

from simdevice.dynamics import GVK_6, GVK_6_AS_PRINTED, LoopDynamics
from simdevice.gyro import Gyro
from simdevice.responses import step_response


@pytest.mark.parametrize(
    ("integral_time", "printed"),
    [
        (1.5e-3, [40 + 366j, 27 - 325j, -19 + 2791j]),
        (1.5e-2, [-17 + 2788j, -131 + 49j, -131 - 89j, -391 + 118j, -1331 - 65j]),
        (3e-2, [-16 + 2787j, -43, -238 - 102j]),
    ],
    ids=["printed", "default", "slower"],
)
def test_the_poles_of_the_paper_s_gyro(integral_time: float, printed: list[complex]) -> None:
    poles = LoopDynamics(replace(GVK_6, integral_time=integral_time)).poles
    # Whole numbers are printed, one of them (118) rounded up from 117.46: half a unit and that slack.
    for pole in printed:
        nearest = poles[abs(poles - pole).argmin()]
        assert abs(nearest.real - pole.real) <= 0.55
        assert abs(nearest.imag - pole.imag) <= 0.55


def test_the_printed_integral_time_is_unstable() -> None:
    assert LoopDynamics(GVK_6).stable
    assert not LoopDynamics(GVK_6_AS_PRINTED).stable


def test_poles_are_the_roots_of_the_loop_s_polynomial() -> None:
    loop, (h, a) = GVK_6, (GVK_6.angular_momentum, GVK_6.inertia)
    t1, t2, k = loop.integral_time, loop.lag_time, 6.0 * 3.0 * 10.0
    # (A·s² − iH·s)·T1·s·(1 + T2·s)² − iH·K·(1 + T1·s), written out from the complex equation.
    controller = np.polymul([t1, 0.0], np.polymul([t2, 1.0], [t2, 1.0]))
    polynomial = np.polyadd(np.polymul([a, -1j * h, 0.0], controller), -1j * h * k * np.array([t1, 1.0]))
    expected = np.roots(polynomial)
    for pole in LoopDynamics(loop).poles:
        # Both are eigenvalues of a 5 × 5 matrix, good to some hundred roundings of the largest.
        assert abs(expected - pole).min() <= 1e-9 * abs(pole)


def test_a_proportional_loop_drives_the_nutation_unstable_and_the_double_lag_stabilises_it() -> None:
    """Without lags the poles' real parts add up to zero: what one gains in damping another loses."""
    proportional = replace(GVK_6, integral_time=math.inf, lag_time=0.0)
    for loop in (proportional, replace(GVK_6, lag_time=0.0)):
        poles = LoopDynamics(loop).poles
        growing = poles[poles.real > 0]
        assert len(growing) == 1
        assert growing[0].imag == pytest.approx(loop.nutation, rel=0.1)
        assert poles.real.sum() == pytest.approx(0.0, abs=1e-9)  # rounding of 2800 rad/s
    lagged = LoopDynamics(replace(proportional, lag_time=GVK_6.lag_time))
    assert lagged.stable
    assert lagged.poles.real.sum() == pytest.approx(-2 / GVK_6.lag_time, rel=1e-12)


@pytest.mark.parametrize("integral_time", [1.5e-2, math.inf], ids=["integrator", "proportional"])
def test_the_measured_rates_become_the_case_rate_less_the_drift(integral_time: float) -> None:
    dynamics = LoopDynamics(replace(GVK_6, integral_time=integral_time))
    z, measured = dynamics.output @ dynamics.steady_state(0.3 - 0.2j, 0.01 + 0.05j)
    assert measured == pytest.approx(0.29 - 0.25j, rel=1e-12)
    if math.isinf(integral_time):
        assert z == pytest.approx(-(0.29 - 0.25j) / 180.0, rel=1e-12)  # −(ω − ωp)/K: nothing integrates
    else:
        assert abs(z) <= 1e-16  # the integrator takes the steady deflection away
    final = step_response(dynamics, 3.0, 1e-3, rate=(0.3, -0.2), drift=(0.01, 0.05))
    assert final.rate_x[-1] == pytest.approx(0.29, rel=1e-12)
    assert final.rate_y[-1] == pytest.approx(-0.25, rel=1e-12)


def test_a_rotor_that_is_hardly_held_stays_where_it_points() -> None:
    """With next to no loop the case turns away under the rotor, which keeps its inertial direction."""
    dynamics = LoopDynamics(replace(GVK_6, pickoff_gain=1e-12, integral_time=1e6))
    response = step_response(dynamics, 1.0, 1e-3, rate=(0.4, -0.1))
    # The loop's rate is K·∫z dt, below 1e-11 rad/s here.
    np.testing.assert_allclose(response.alpha, -0.4 * response.t, rtol=0, atol=1e-10)
    np.testing.assert_allclose(response.beta, 0.1 * response.t, rtol=0, atol=1e-10)


def test_a_free_rotor_nutates_with_constant_energy() -> None:
    dynamics = LoopDynamics(replace(GVK_6, pickoff_gain=1e-12, integral_time=1e6))
    t = np.linspace(0.0, 0.1, 1001)
    start = np.zeros(5, dtype=np.complex128)
    start[1] = 1e-3
    z = dynamics.free_motion(start, t)[0]
    # u = 1e-3·exp(i·H/A·t) and its integral: the kinetic energy A·|u|²/2 does not change.
    expected = 1e-3 * (np.exp(1j * GVK_6.nutation * t) - 1) / (1j * GVK_6.nutation)
    np.testing.assert_allclose(z, expected, rtol=0, atol=1e-15)


@pytest.mark.parametrize("name", ["paper", "poles-meet", "proportional"])
def test_what_is_left_after_a_step_is_the_response_less_its_end(name: str) -> None:
    loop = {
        "paper": GVK_6,
        # Two poles at one place (tests of `simdevice.responses`): the modes are of no use there.
        "poles-meet": replace(GVK_6, pickoff_gain=7.3598973225035484, integral_time=0.010141546833881692),
        "proportional": replace(GVK_6, integral_time=math.inf),
    }[name]
    dynamics = LoopDynamics(loop)
    response = step_response(dynamics, 0.2, 1e-4, rate=(0.7, -0.4), drift=(0.02, 0.1))
    some = np.random.default_rng(1).permutation(len(response.t))[:300]
    x, y = dynamics.measured_rates_after_step(
        0.7, -0.4, response.t[some], drift_step_x=0.02, drift_step_y=0.1
    )
    # Modes against powers of one matrix exponential: rounding alone, of numbers near 1.
    np.testing.assert_allclose(x, response.rate_x[some] - 0.68, rtol=0, atol=1e-11)
    np.testing.assert_allclose(y, response.rate_y[some] + 0.5, rtol=0, atol=1e-11)


def test_before_the_step_the_old_rates_stand_and_long_after_nothing_is_left() -> None:
    x, y = LoopDynamics(GVK_6).measured_rates_after_step(0.7, -0.4, np.array([-1.0, 0.0, 1e3, 1e9]))
    np.testing.assert_allclose(x, [-0.7, -0.7, 0.0, 0.0], rtol=0, atol=1e-15)
    np.testing.assert_allclose(y, [0.4, 0.4, 0.0, 0.0], rtol=0, atol=1e-15)
    assert x[2] == y[2] == x[3] == y[3] == 0.0


def test_currents_of_the_settled_loop_obey_the_observation_equations() -> None:
    """The rates of the settled loop through the torquers are the currents of the steady gyro."""
    gyro = Gyro(10.02, 9.97, 0.013, -0.021, 2e-6, -3e-6, 4e-6, 1.5e-6, 2e-8)
    rate, force = np.array([5.1e-5, -3.3e-5, 4.0e-5]), np.array([0.31, -0.52, 0.795])
    dynamics = LoopDynamics(GVK_6)
    drift = gyro.drift(force)
    settled = dynamics.output[1] @ dynamics.steady_state(
        complex(rate[0], rate[1]), complex(float(drift[0]), float(drift[1]))
    )
    currents = gyro.currents_for(np.asarray(settled.real), np.asarray(settled.imag))
    # The observation equations once more, as a linear system with the drift written out.
    expected = np.linalg.solve(
        [[10.02, 0.013], [-0.021, 9.97]],
        [
            5.1e-5 - (2e-6 + 4e-6 * 0.31 - 1.5e-6 * -0.52 + 2e-8 * 0.31 * 0.795),
            -3.3e-5 - (-3e-6 + 1.5e-6 * 0.31 + 4e-6 * -0.52 + 2e-8 * -0.52 * 0.795),
        ],
    )
    np.testing.assert_allclose(currents, expected, rtol=1e-12)
    np.testing.assert_allclose(gyro.steady_currents(rate, force), expected, rtol=1e-12)


def test_no_transient_of_an_unstable_loop() -> None:
    with pytest.raises(ValueError, match=r"is unstable, its pole at 39\.55\+366\.1j rad/s does not decay"):
        LoopDynamics(GVK_6_AS_PRINTED).measured_rates_after_step(1.0, 0.0, np.zeros(1))


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"angular_momentum": 0.0}, "angular momentum is 0.0: it must be above zero"),
        ({"inertia": -1e-7}, "inertia is -1e-07: it must be above zero"),
        ({"integral_time": -math.inf}, "integral time is -inf: give a finite number"),
        ({"integral_time": math.nan}, "integral time is nan: give a finite number"),
        ({"lag_time": -1e-3}, "lag time is -0.001: it must be at least zero"),
        ({"torquer_scale": math.inf}, "torquer scale is inf: give a finite number"),
    ],
    ids=["momentum", "inertia", "integral", "integral-nan", "lag", "torquer"],
)
def test_parameters_that_cannot_be(change: dict[str, float], says: str) -> None:
    with pytest.raises(ValueError, match=re.escape(says)):
        replace(GVK_6, **change)
