"""Tests of the rotor in its rebalance loop."""

from dataclasses import replace

import pytest

from simdevice.dynamics import GVK_6, GVK_6_AS_PRINTED, LoopDynamics


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
