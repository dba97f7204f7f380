import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from solver import error_model, geometry
from solver.constants import EARTH_RATE
from tests.solver.sessions import Setup, grid, truth


@pytest.fixture
def angles(rng):
    return np.radians(grid()[:, 0]), np.radians(grid()[:, 1]), *rng.normal(0, 0.02, (3, 16))


def test_the_true_parameters_solve_the_equations_of_an_independent_simulation(rng):
    setup = Setup(misalignment=3600.0)
    equations = error_model.observation_equations(setup.observe(rng))
    # Rounding of rates of about 1e-4 rad/s.
    np.testing.assert_allclose(equations.residuals(setup.parameters), 0.0, rtol=0, atol=1e-19)


def test_currents_are_those_of_an_independent_simulation(angles):
    setup = Setup()
    at = geometry.elements(geometry.case_orientation(*angles))
    jx, jy = error_model.currents(setup.parameters, at, np.radians(setup.latitude))
    expected = setup.currents(np.column_stack(angles[2:]))
    # Currents of some 1e-6 A, rounded.
    np.testing.assert_allclose(np.column_stack((jx, jy)), expected, rtol=0, atol=1e-20)


@given(
    st.lists(st.floats(-1, 1), min_size=6, max_size=6),
    st.floats(0.1, 30),
    st.floats(0.1, 30),
    st.floats(-1.57, 1.57),
    st.lists(st.floats(-7, 7), min_size=5, max_size=5),
)
def test_forward_model_and_equations_are_inverse(small, kx, ky, latitude, turn):
    """Equations made from the forward model's currents hold for its parameters, whatever they are."""
    kxy, kyx = 0.05 * small[0], 0.05 * small[1]
    parameters = np.array([kx, ky, kxy, kyx, *(np.array(small[2:]) * 1e-4)])
    at = geometry.elements(geometry.case_orientation(*np.array(turn)[:, None]))
    jx, jy = error_model.currents(parameters, at, latitude)
    left = error_model.design_matrix(at, jx, jy) @ parameters
    right = error_model.right_side(at, *error_model.earth_rate(latitude))
    # K·J undoes K⁻¹ up to its condition, here at most 30/0.1, of rates up to 4e-4 rad/s.
    np.testing.assert_allclose(left, right, rtol=0, atol=1e-16)


def test_jacobians_are_the_derivatives(angles):
    """Central differences of residuals, which are linear in q and in J, are exact up to rounding."""
    at = geometry.elements(geometry.case_orientation(*angles))
    parameters, latitude = truth(), 0.9
    currents = np.array(error_model.currents(parameters, at, latitude))

    def residuals(q, jx, jy):
        right = error_model.right_side(at, *error_model.earth_rate(latitude))
        return right - error_model.design_matrix(at, jx, jy) @ q

    design = error_model.design_matrix(at, *currents)
    for index in range(8):
        step = np.zeros(8)
        step[index] = 1e-2 * max(abs(parameters[index]), 1e-6)
        change = residuals(parameters + step, *currents) - residuals(parameters - step, *currents)
        np.testing.assert_allclose(change / (2 * step[index]), -design[:, index], rtol=1e-9, atol=1e-12)
    for channel in (0, 1):
        step = np.zeros((2, 16))
        step[channel, 3] = 1e-7
        change = residuals(parameters, *(currents + step)) - residuals(parameters, *(currents - step))
        by_current = np.zeros(32)
        by_current[6:8] = -error_model.scale_matrix(parameters)[:, channel]
        np.testing.assert_allclose(change / 2e-7, by_current, rtol=1e-9, atol=1e-12)


def test_rate_covariance_is_that_of_sampled_noise(rng):
    parameters = truth(kxy=900.0)
    u = np.array([[2e-9, 5e-9], [4e-9, 1e-9]])
    noise = rng.standard_normal((200_000, 2, 2)) * u
    rates = noise @ error_model.scale_matrix(parameters).T
    sampled = np.einsum("npi,npj->pij", rates, rates) / len(rates)
    expected = error_model.rate_covariance(parameters, u)
    # A sampled variance of n draws scatters by √(2/n) = 0.3 %; six of those.
    scale = np.sqrt(np.einsum("pii,pjj->pij", expected, expected))
    assert np.all(np.abs(sampled - expected) < 6 * np.sqrt(2 / len(noise)) * scale)


def test_full_model_reduces_to_the_terms_of_the_method(rng):
    parameters = truth()
    force = tuple(rng.normal(size=(3, 5)))
    x, y = error_model.drift(parameters, force)
    w0x, w0y, wg, wk = parameters[4:]
    np.testing.assert_allclose(x, w0x + wg * force[0] - wk * force[1], rtol=1e-14)
    np.testing.assert_allclose(y, w0y + wk * force[0] + wg * force[1], rtol=1e-14)


def test_full_model_has_anisoelasticity_and_the_deflected_rotor():
    """Paper, eq. (3), term by term: each alone, with numbers that can be checked in the head."""
    x, y = error_model.drift(np.zeros(8), (2.0, 3.0, 5.0), wn=7.0)
    assert (x, y) == (70.0, 105.0)
    x, y = error_model.drift(np.zeros(8), (0.0, 0.0, 1.0), deflection=(2.0, 3.0), restraint=(5.0, 7.0))
    assert (x, y) == (-5 * 2 + 7 * 3, -5 * 3 - 7 * 2)


def test_earth_rate_by_latitude():
    north, up = error_model.earth_rate(-np.pi / 6)
    assert (north, up) == pytest.approx((EARTH_RATE * np.sqrt(3) / 2, -EARTH_RATE / 2), rel=1e-15)


def test_design_matrix_takes_batches(rng, angles):
    at = geometry.elements(geometry.case_orientation(*angles))
    currents = rng.normal(size=(2, 5, 16))
    batch = error_model.design_matrix(at, *currents)
    assert batch.shape == (5, 32, 8)
    np.testing.assert_array_equal(batch[3], error_model.design_matrix(at, *currents[:, 3]))
