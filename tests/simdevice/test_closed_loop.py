"""The loop's part in a session, against an integration of the rotor's equations (paper, (1) and (2))."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from simdevice.closed_loop import answer, dynamics_of, forgotten, transient
from simdevice.dynamics import GVK_6, GVK_6_AS_PRINTED

H, A, K, T1, T2 = 1.4e-3, 5e-7, 180.0, 1.5e-2, 1e-3  # spec 2.1's gyro: Kα·Ku·Km = 6·3·10
RATE = 200.0


def rotor(t: float, s: np.ndarray, mx: float, my: float) -> list[float]:
    """α, β, α̇, β̇ and of each axis ∫ and the two lags, at rest with moments; real equations, no rate."""
    a, b, da, db, ia, ib, ya, yb, wa, wb = s
    return [
        da, db, (mx - H * (db + wb)) / A, (my + H * (da + wa)) / A, a, b,
        (K * (a + ia / T1) - ya) / T2, (K * (b + ib / T1) - yb) / T2, (ya - wa) / T2, (yb - wb) / T2,
    ]  # fmt: skip


def test_a_pulse_of_drift_noise_is_answered_as_the_rotor_does() -> None:
    """A drift of −1 rad/s about x during one sample: measured rates −W·α, −W·β at the sampling instants."""
    state = np.zeros(10)
    found = []
    for number in range(12):
        my = H if number == 0 else 0.0  # ωpx = −My/H
        step = solve_ivp(
            rotor, (0.0, 1 / RATE), state, args=(0.0, my), method="DOP853", rtol=1e-11, atol=1e-16
        )
        state = step.y[:, -1]
        found.append(-state[8] - 1j * state[9])
    # The integrator's tolerance over some thousand steps.
    np.testing.assert_allclose(answer(GVK_6, RATE)[:12], found, rtol=0, atol=1e-8)


@pytest.mark.parametrize("rate", [50.0, 200.0, 2000.0])
def test_slow_noise_passes_as_it_is(rate: float) -> None:
    pulse = answer(GVK_6, rate)
    # What is left out after the end is 1e-6 of the loop's slowest motion.
    assert pulse.sum() == pytest.approx(1.0, abs=2e-6)
    assert abs(pulse[-1]) < 2e-6


def test_a_transient_begins_where_the_currents_were() -> None:
    rate_step, drift_step = np.array([3e-5, -2e-5]), np.array([1e-6, 4e-6])
    x, y = transient(GVK_6, rate_step, drift_step, np.array([0.0, 0.05, 5.0]))
    # At rest again the measured rates are still the old ones: off by the step of ω − drift.
    assert (x[0], y[0]) == pytest.approx(tuple(drift_step - rate_step), rel=1e-9)
    assert 0 < np.hypot(x[1], y[1]) < np.hypot(x[0], y[0])
    assert (x[2], y[2]) == (0.0, 0.0)


def test_what_is_forgotten_is_below_rounding() -> None:
    """The slowest pole is the nutation's, −17/s: e^(−17·t) is 1e-18 after 2.4 s."""
    assert [forgotten(GVK_6, t) for t in (0.0, 1.0, 2.0, 3.0)] == [False, False, False, True]
    x, y = transient(GVK_6, np.array([1e-4, 1e-4]), np.zeros(2), np.array([3.0]))
    assert abs(x[0]) + abs(y[0]) < 1e-20


def test_an_unstable_loop_is_refused() -> None:
    with pytest.raises(ValueError, match="unstable"):
        answer(GVK_6_AS_PRINTED, RATE)
    with pytest.raises(ValueError, match="unstable"):
        transient(GVK_6_AS_PRINTED, np.ones(2), np.ones(2), np.zeros(1))


def test_dynamics_are_worked_out_once() -> None:
    assert dynamics_of(GVK_6) is dynamics_of(replace(GVK_6))
