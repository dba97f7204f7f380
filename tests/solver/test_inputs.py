"""How errors of the inputs show in the residuals: against perturbed sessions by an independent route."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from solver.errors import InputError
from solver.inputs import COMMON, SOURCES, CommonUncertainty, by_angles, by_common, by_currents, inputs_of
from solver.records import PARAMETERS, Observations
from tests.solver.sessions import Setup, to_case

STEP = 1e-6
# Central differences err by the third derivative times STEP²/6, some 1e-13 of the value, and by
# rounding, 1e-16/STEP = 1e-10 of the terms that cancel.
TOLERANCE = 1e-8


@pytest.fixture
def session(rng) -> Observations:
    return Setup(misalignment=3600.0, noise=0.005, u_given=True).observe(rng)


def residuals(
    at,
    q,
    *,
    base=(0.0, 0.0, 0.0),
    latitude=0.0,
    gravity=0.0,
    gain=(0.0, 0.0),
    offset=(0.0, 0.0),
    misaligned=(0.0, 0.0, 0.0),
):
    """Right side minus left side of the observation equations with changed inputs, by scipy's rotations."""
    angles = np.stack((at.alpha, at.beta, at.gamma), axis=1) + misaligned

    def back(axis, angle):
        return Rotation.from_rotvec(-angle * np.eye(3)[axis])

    turned = (back(2, base[2]) * back(1, base[1]) * back(0, base[0])).as_matrix()
    turn = to_case(np.stack((at.theta, at.psi), axis=1), angles) @ turned
    phi = at.latitude + latitude
    earth = turn @ (7.292115e-5 * np.array([0.0, np.cos(phi), np.sin(phi)]))
    force = (1.0 + gravity) * turn[:, :, 2]
    kx, ky, kxy, kyx, w0x, w0y, wg, wk = q
    jx, jy = at.jx * (1 + gain[0]) + offset[0], at.jy * (1 + gain[1]) + offset[1]
    x = earth[:, 0] - (kx * jx + kxy * jy + w0x + wg * force[:, 0] - wk * force[:, 1])
    y = earth[:, 1] - (kyx * jx + ky * jy + w0y + wk * force[:, 0] + wg * force[:, 1])
    return np.stack((x, y), axis=1).ravel()


CHANGES = {
    "gain_x": lambda h: {"gain": (h, 0.0)},
    "gain_y": lambda h: {"gain": (0.0, h)},
    "offset_x": lambda h: {"offset": (h, 0.0)},
    "offset_y": lambda h: {"offset": (0.0, h)},
    "alpha": lambda h: {"misaligned": (h, 0.0, 0.0)},
    "beta": lambda h: {"misaligned": (0.0, h, 0.0)},
    "gamma": lambda h: {"misaligned": (0.0, 0.0, h)},
    "level_1": lambda h: {"base": (h, 0.0, 0.0)},
    "level_2": lambda h: {"base": (0.0, h, 0.0)},
    "azimuth": lambda h: {"base": (0.0, 0.0, h)},
    "latitude": lambda h: {"latitude": h},
    "gravity": lambda h: {"gravity": h},
}


@pytest.mark.parametrize("name", CHANGES)
def test_a_common_error_shows_as_a_perturbed_session_does(session, name):
    q = Setup().parameters
    column = by_common(session, q, CommonUncertainty())[:, COMMON.index(name)]
    change = CHANGES[name]
    moved = (residuals(session, q, **change(STEP)) - residuals(session, q, **change(-STEP))) / (2 * STEP)
    assert np.max(np.abs(column - moved)) < TOLERANCE * np.max(np.abs(moved))


def test_a_temperature_error_shows_as_the_change_of_the_parameters(session):
    coefficients = dict(zip(PARAMETERS, 1e-3 * Setup().parameters, strict=True))
    common = CommonUncertainty.of({"temperature": 1.0}, temperature_coefficients=coefficients)
    q = Setup().parameters
    column = by_common(session, q, common)[:, COMMON.index("temperature")]
    warmer = residuals(session, q * (1 + 1e-3)) - residuals(session, q)
    assert np.allclose(column, warmer, rtol=0, atol=1e-12 * np.max(np.abs(warmer)))  # linear: rounding alone


def test_currents_and_angles_of_one_position_touch_its_two_equations(session):
    q = Setup().parameters
    angles, currents = by_angles(session, q), by_currents(len(session), q)
    place = 5
    for index, name in enumerate(("alpha", "beta", "gamma")):
        step = np.zeros(16)
        step[place] = STEP
        higher = replace(session, **{name: getattr(session, name) + step})
        lower = replace(session, **{name: getattr(session, name) - step})
        moved = (residuals(higher, q) - residuals(lower, q)) / (2 * STEP)
        expected = np.zeros(32)
        expected[2 * place : 2 * place + 2] = angles[place, :, index]
        assert np.max(np.abs(moved - expected)) < TOLERANCE * np.max(np.abs(expected))
    more = np.zeros(16)
    more[place] = 1e-9
    moved = residuals(replace(session, jx=session.jx + more), q) - residuals(session, q)
    assert np.allclose(moved, 1e-9 * currents[:, 2 * place], rtol=0, atol=1e-19)  # linear: rounding of 1e-4


def test_only_what_is_uncertain_takes_part_and_repeats_share_their_angles(rng):
    session = Setup(noise=0.005, u_given=True, repeats=2).observe(rng)
    some = np.where(session.theta == 0, 5e-6, 0.0)
    session = replace(session, u_alpha=some)
    inputs = inputs_of(session, Setup().parameters, CommonUncertainty.of({"latitude": 1e-6}))
    assert list(np.unique(inputs.source)) == ["angles", "currents", "latitude"]
    assert np.sum(inputs.source == "currents") == 64
    angles = inputs.sensitivity[:, inputs.source == "angles"]
    assert angles.shape == (64, 4)  # four positions at θ = 0, each measured twice
    assert set(np.count_nonzero(np.abs(angles).reshape(32, 2, 4).sum(axis=1), axis=0)) == {2}


def test_correlated_inputs_keep_their_covariance(session):
    common = CommonUncertainty.of(
        {"gain_x": 1e-4, "gain_y": 2e-4}, correlation={("gain_y", "gain_x"): 0.5}, dof={"gain_x": 7}
    )
    inputs = inputs_of(session, Setup().parameters, common)
    gains = inputs.source == "ammeter-gain"
    assert np.allclose(inputs.covariance[np.ix_(gains, gains)], [[1e-8, 1e-8], [1e-8, 4e-8]], rtol=1e-15)
    assert list(inputs.dof[gains]) == [7, np.inf]
    whole = inputs.sensitivity @ inputs.covariance @ inputs.sensitivity.T
    assert np.allclose(inputs.residual_covariance, whole, rtol=0, atol=1e-15 * np.max(whole))


def test_every_common_input_belongs_to_one_line():
    members = [name for line in SOURCES.values() for name in line]
    assert sorted(members) == sorted(COMMON)


def test_nothing_uncertain_is_no_input(session):
    exact = inputs_of(replace(session, u_jx=None, u_jy=None), Setup().parameters)
    assert exact.sensitivity.shape == (32, 0)
    assert not exact.residual_covariance.any()


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"standard": {"gain": 1.0}}, "gain"),
        ({"standard": {"level_1": -1.0}}, "level_1"),
        ({"standard": {"level_1": np.inf}}, "level_1"),
        ({"standard": {}, "dof": {"azimuth": 0.0}}, "azimuth"),
        ({"standard": {}, "correlation": {("gain_x", "gain_y"): 1.5}}, "between −1 and 1"),
        (
            {
                "standard": {},
                "correlation": {("alpha", "beta"): 0.9, ("beta", "gamma"): 0.9, ("alpha", "gamma"): -0.9},
            },
            "contradict",
        ),
    ],
)
def test_impossible_statements_are_refused(arguments, words):
    with pytest.raises(InputError, match=words):
        CommonUncertainty.of(**arguments)
