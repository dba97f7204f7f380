"""Tests of the three conditions of stability, against the poles themselves."""

import math
from collections import Counter
from dataclasses import replace

import numpy as np
import pytest

from simdevice.dynamics import GVK_6, GVK_6_AS_PRINTED, LoopDynamics, LoopParameters
from simdevice.stability import cause_of_instability


def drawn(number: int) -> LoopParameters:
    """A loop somewhere around the paper's, by orders of magnitude."""
    rng = np.random.default_rng((20, number))
    h, a, k, t1, t2 = np.exp(rng.normal(0.0, [1.0, 1.0, 1.0, 1.5, 1.0]))
    return LoopParameters(1.4e-3 * h, 5e-7 * a, 6.0 * k, 3.0, 10.0, 1e-2 * t1, 1e-3 * t2)


def test_the_conditions_say_what_the_poles_say() -> None:
    found: Counter[str] = Counter()
    for number in range(600):
        loop = drawn(number)
        cause = cause_of_instability(loop)
        poles = LoopDynamics(loop).poles
        if abs(poles[0].real) > 1e-9 * abs(poles).max():  # on the axis itself rounding decides
            assert (cause is None) == (poles[0].real < 0), loop
        found[cause.reason if cause else "stable"] += 1
    # Every branch was there, so that the comparison means something.
    assert min(found[name] for name in ("stable", "integral-time", "nutation", "gain")) >= 20, found


@pytest.mark.parametrize(
    ("loop", "reason", "member"),
    [
        (GVK_6_AS_PRINTED, "integral-time", "integral_time"),
        (replace(GVK_6, lag_time=1e-4), "nutation", "lag_time"),
        (replace(GVK_6, lag_time=0.0), "nutation", "lag_time"),
        (replace(GVK_6, integral_time=math.inf, lag_time=0.0), "nutation", "lag_time"),
        (replace(GVK_6, pickoff_gain=60.0), "gain", "pickoff_gain"),
    ],
    ids=["printed", "short-lag", "no-lag", "proportional", "gain"],
)
def test_the_limit_is_where_stability_begins(loop: LoopParameters, reason: str, member: str) -> None:
    cause = cause_of_instability(loop)
    assert cause is not None
    assert cause.reason == reason
    limit = cause.limit / 30.0 if reason == "gain" else cause.limit
    outward = 0.999 if reason == "gain" else 1.001
    # Weak gain for the two conditions that hold at any gain, so that the third does not interfere.
    gain = loop.pickoff_gain if reason == "gain" else 1e-3
    quiet = replace(loop, pickoff_gain=gain)
    assert LoopDynamics(replace(quiet, **{member: limit * outward})).stable
    assert not LoopDynamics(replace(quiet, **{member: limit / outward})).stable


def test_the_paper_s_loop_has_no_cause() -> None:
    assert cause_of_instability(GVK_6) is None
