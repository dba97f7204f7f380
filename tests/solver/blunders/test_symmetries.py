"""What a calibration may not depend on, and how its answer follows the input."""

from dataclasses import fields

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from solver.calibrate import calibrate
from solver.records import Array, Observations
from tests.solver.sessions import Setup

seeds = st.integers(0, 2**32 - 1)
few = settings(max_examples=25, deadline=None)


def remade(observations: Observations, **changes: Array | float) -> Observations:
    columns = {item.name: getattr(observations, item.name) for item in fields(observations)}
    return Observations.sorted_from(**{**columns, **changes})


def estimates(observations: Observations) -> list[tuple[Array, Array]]:
    result = calibrate(observations)
    return [(item.values, item.standard_uncertainties) for item in (result.least_squares, result.paper)]


def session(seed: int) -> Observations:
    return Setup(noise=0.005, u_given=True).observe(np.random.default_rng(seed))


@few
@given(seeds, st.floats(1e-3, 1e3))
def test_scale_factors_follow_the_unit_of_current(seed, unit):
    observations = session(seed)
    scaled = remade(
        observations,
        jx=observations.jx * unit, jy=observations.jy * unit,
        u_jx=observations.u_jx * unit, u_jy=observations.u_jy * unit,
    )  # fmt: skip
    follow = np.array([unit] * 4 + [1.0] * 4)
    for (values, u), (others, other_u) in zip(estimates(observations), estimates(scaled), strict=True):
        # Rounding of 1e-16 times condition and signal over noise: about 1e-11 of u.
        assert np.all(np.abs(others * follow - values) < 1e-8 * u)
        np.testing.assert_allclose(other_u * follow, u, rtol=1e-9)


@few
@given(seeds)
def test_reversing_both_channels_reverses_the_scale_factors(seed):
    observations = session(seed)
    reversed_ = remade(observations, jx=-observations.jx, jy=-observations.jy)
    sign = np.array([-1.0] * 4 + [1.0] * 4)
    for (values, u), (others, other_u) in zip(estimates(observations), estimates(reversed_), strict=True):
        assert np.all(np.abs(others * sign - values) < 1e-8 * u)
        np.testing.assert_allclose(other_u, u, rtol=1e-9)


@few
@given(seeds, st.floats(-1e-4, 1e-4), st.floats(-1e-4, 1e-4))
def test_a_bias_of_the_gyro_moves_only_the_bias(seed, shift_x, shift_y):
    """Adding K⁻¹·δω to every current lowers ω0 by δω and leaves the rest: exact for either method's limit."""
    observations = session(seed)
    for index, (values, u) in enumerate(estimates(observations)):
        kx, ky, kxy, kyx = values[:4]
        jx, jy = np.linalg.solve([[kx, kxy], [kyx, ky]], [shift_x, shift_y])
        moved, _ = estimates(remade(observations, jx=observations.jx + jx, jy=observations.jy + jy))[index]
        expected = values - np.array([0, 0, 0, 0, shift_x, shift_y, 0, 0])
        # The iteration stops within 1e-12 of 10 rad/(s·A), 1e-8 of u.
        assert np.all(np.abs(moved - expected) < 1e-6 * u)


@few
@given(seeds)
def test_the_order_of_the_rows_does_not_matter(seed):
    observations = session(seed)
    order = np.random.default_rng(seed).permutation(len(observations))
    columns = {
        item.name: getattr(observations, item.name)[order]
        for item in fields(observations)
        if isinstance(getattr(observations, item.name), np.ndarray)
    }
    for one, other in zip(estimates(observations), estimates(remade(observations, **columns)), strict=True):
        for left, right in zip(one, other, strict=True):
            assert left.tobytes() == right.tobytes()


@few
@given(seeds, st.integers(2, 4))
def test_repeating_every_value_changes_u_but_not_the_answer(seed, times):
    observations = session(seed)
    columns = {
        item.name: np.tile(getattr(observations, item.name), times)
        for item in fields(observations)
        if isinstance(getattr(observations, item.name), np.ndarray)
    }
    columns["repeat"] = np.repeat(np.arange(times), len(observations))
    repeated = remade(observations, **columns)
    for (values, u), (others, other_u) in zip(estimates(observations), estimates(repeated), strict=True):
        assert np.all(np.abs(others - values) < 1e-8 * u)
        np.testing.assert_allclose(other_u * np.sqrt(times), u, rtol=1e-9)
