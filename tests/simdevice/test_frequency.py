"""Tests of the loop in the frequency domain: margins found again by moving the poles."""

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from simdevice.dynamics import GVK_6, GVK_6_AS_PRINTED, LoopDynamics, LoopParameters
from simdevice.frequency import Margins, drift_response, loop_gain, margins, rate_response
from simdevice.responses import held_response

LOOPS = {
    "paper": GVK_6,
    "slower": replace(GVK_6, integral_time=3e-2),
    "near-the-edge": replace(GVK_6, integral_time=3e-3),
    "proportional": replace(GVK_6, integral_time=math.inf),
    "another": LoopParameters(2e-3, 1.1e-6, 2.0, 2.0, 7.0, 8e-2, 2.3e-3),
}


def rightmost(loop: LoopParameters, factor: complex) -> complex:
    """The rightmost root of D + factor·N, from the complex equation with its loop term multiplied."""
    h, a, t2 = loop.angular_momentum, loop.inertia, loop.lag_time
    k = loop.pickoff_gain * loop.amplifier_gain * loop.torquer_scale * factor
    lags = np.polymul([t2, 1.0], [t2, 1.0])
    rotor = np.array([a, -1j * h, 0.0])
    if math.isinf(loop.integral_time):
        roots = np.roots(np.polyadd(np.polymul(rotor, lags), [-1j * h * k]))
    else:
        t1 = loop.integral_time
        left = np.polymul(rotor, np.polymul([t1, 0.0], lags))
        roots = np.roots(np.polyadd(left, -1j * h * k * np.array([t1, 1.0])))
    return complex(roots[roots.real.argmax()])


def crossing(loop: LoopParameters, factor: Callable[[float], complex], far: float) -> tuple[float, complex]:
    """The first of 400 steps towards `far` at which a pole has crossed, refined, and that pole."""
    steps = np.linspace(0.0, far, 401)
    over = next((k for k, at in enumerate(steps) if rightmost(loop, factor(at)).real > 0), None)
    if over is None:
        return math.nan, complex(math.nan, math.nan)
    low, high = steps[over - 1], steps[over]
    for _ in range(50):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if rightmost(loop, factor(middle)).real > 0 else (middle, high)
    return high, rightmost(loop, factor(high))


def turned(sign: float) -> Callable[[float], complex]:
    """The factor that turns the loop gain."""
    return lambda angle: complex(np.exp(1j * sign * angle))


def worse_of(loop: LoopParameters) -> Margins:
    found = margins(LoopDynamics(loop))
    assert found is not None
    return found.worse


@pytest.mark.parametrize("name", LOOPS)
def test_the_gain_margin_is_where_the_poles_cross_the_axis(name: str) -> None:
    gain = worse_of(LOOPS[name]).gain
    factor, pole = crossing(LOOPS[name], math.exp, 5.0)
    assert gain is not None
    # Two ways to the same root; where a pole crosses is known to 1e-9 of its size or so.
    assert gain.value == pytest.approx(math.exp(factor), rel=1e-7)
    assert gain.omega == pytest.approx(pole.imag, rel=1e-6)


@pytest.mark.parametrize("name", LOOPS)
def test_less_gain_never_makes_it_unstable(name: str) -> None:
    assert all(rightmost(LOOPS[name], math.exp(-at)).real < 0 for at in np.linspace(0.0, 7.0, 71))


@pytest.mark.parametrize("name", LOOPS)
def test_the_phase_margin_is_the_angle_at_which_the_poles_cross_the_axis(name: str) -> None:
    phase = worse_of(LOOPS[name]).phase
    angle, pole = min(crossing(LOOPS[name], turned(sign), math.pi) for sign in (1.0, -1.0))
    assert phase is not None
    assert abs(phase.value) == pytest.approx(angle, rel=1e-7)  # as above
    assert phase.omega == pytest.approx(pole.imag, rel=1e-6)
    # Its sign says which way: that much more and the loop is unstable.
    assert rightmost(LOOPS[name], turned(1.0)(1.001 * phase.value)).real > 0


def test_each_sign_of_frequency_has_its_own_margins_and_the_worse_counts() -> None:
    found = margins(LoopDynamics(GVK_6))
    assert found is not None
    assert found.positive.gain is not None
    assert found.negative.gain is not None
    # The rotor's factor 1 − ωA/H: smaller before the nutation than on the other side.
    omega = found.positive.gain.omega
    assert found.negative.gain.omega == -omega
    ratio = found.negative.gain.value / found.positive.gain.value
    assert ratio == pytest.approx((1 + omega / 2800.0) / (1 - omega / 2800.0), rel=1e-12)  # rounding
    assert found.worse.gain == found.positive.gain
    assert found.worse.phase == found.positive.phase
    assert found.worse.bandwidth == found.negative.bandwidth


@pytest.mark.parametrize("name", LOOPS)
def test_the_bandwidth_is_where_the_measured_rate_is_first_down_by_3_db(name: str) -> None:
    found = margins(LoopDynamics(LOOPS[name]))
    assert found is not None
    for side, sign in ((found.positive, 1), (found.negative, -1)):
        assert side.bandwidth is not None
        at = np.abs(rate_response(LOOPS[name], sign * np.array([side.bandwidth])))[0]
        assert at == pytest.approx(math.sqrt(0.5), rel=1e-9)  # a polished root of |R|² = 1/2
        below = np.abs(rate_response(LOOPS[name], sign * np.linspace(1e-3, 0.9999, 2000) * side.bandwidth))
        assert below.min() > math.sqrt(0.5)


@pytest.mark.parametrize("omega", [40.0, -40.0, 300.0, -300.0])
def test_frequency_responses_are_the_steady_answers_to_oscillations(omega: float) -> None:
    """Drive the exactly discretised loop with e^(iωt), held over steps that are short against it."""
    step = 2e-6
    t = np.arange(400_000) * step
    wave = np.exp(1j * omega * t)
    still = np.zeros(len(t), dtype=np.complex128)
    # Holding delays a wave by half a step and shrinks it by (ωτ/2)²/6 < 2e-8: both are divided out.
    held = np.exp(-0.5j * omega * step) * np.sinc(omega * step / (2 * np.pi))
    dynamics = LoopDynamics(GVK_6)
    for answer, rate, drift in ((rate_response, wave, still), (drift_response, still, wave)):
        _, measured = held_response(dynamics, rate, drift, step)
        # After 0.8 s the nutation, excited by 1e-3 at most, has decayed by e⁻¹³ to 2e-9.
        assert measured[-1] / wave[-1] / held == pytest.approx(
            complex(answer(GVK_6, np.array([omega]))[0]), rel=1e-7
        )


def test_the_loop_gain_is_the_rotor_s_answer_to_the_loop() -> None:
    omega = np.array([-5e3, -200.0, 17.0, 930.0, 4e3])
    s = 1j * omega
    w = 180.0 * (1 + 1.5e-2 * s) / (1.5e-2 * s * (1 + 1e-3 * s) ** 2)  # the paper's (2)
    expected = -1j * 1.4e-3 * w / (5e-7 * s**2 - 1j * 1.4e-3 * s)  # A·z̈ − iH·ż = iH·(W·z), opened
    np.testing.assert_allclose(loop_gain(GVK_6, omega), expected, rtol=1e-12)


def test_an_unstable_loop_has_no_margins() -> None:
    assert margins(LoopDynamics(GVK_6_AS_PRINTED)) is None
    assert margins(LoopDynamics(replace(GVK_6, lag_time=0.0))) is None
