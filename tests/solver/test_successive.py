import numpy as np
import pytest

from solver import successive
from solver.calibrate import calibrate
from solver.error_model import observation_equations
from solver.errors import InputError, NotConverged, SolverError
from solver.records import PARAMETERS
from tests.solver.sessions import DEG_PER_H, Setup, grid, truth


@pytest.fixture
def observations(rng):
    return Setup(noise=0.005, misalignment=600.0).observe(rng)


def parts(observations):
    return observation_equations(observations), *successive.position_weights(observations)


def test_first_round_by_hand():
    """Without misalignment row 1 has c = d = 0, so K is exact at once and the second round changes nothing.

    θ = 0: x and y point along the platform's horizontal axes, the right sides are ωг·sin ψ and ωг·cos ψ.
    """
    setup = Setup(misalignment=0.0)
    values, history = successive.successive_approximations(*parts(setup.observe(np.random.default_rng(0))))
    np.testing.assert_allclose(
        history[0][[0, 1, 2, 3, 6, 7]], setup.parameters[[0, 1, 2, 3, 6, 7]], rtol=1e-12
    )
    assert len(history) == 2
    np.testing.assert_array_equal(history[-1], values)


def test_first_round_ignores_the_g_sensitive_drift_in_row_one(rng):
    """λ = 1 takes K from row 1 with ωg = ωк = 0: solved here by hand from the simulated currents."""
    setup = Setup(misalignment=3600.0, positions=grid(thetas=(0, 90)))
    observations = setup.observe(rng)
    _, history = successive.successive_approximations(*parts(observations))
    jx, jy = observations.jx, observations.jy
    right = observation_equations(observations).right_side.reshape(-1, 2)
    currents = np.array([[jx[k] - jx[k + 2], jy[k] - jy[k + 2]] for k in (0, 1)])
    for axis, columns in ((0, [0, 2]), (1, [3, 1])):
        rates = [right[k, axis] - right[k + 2, axis] for k in (0, 1)]
        np.testing.assert_allclose(history[0, columns], np.linalg.solve(currents, rates), rtol=1e-12)


def test_history_and_convergence(observations):
    values, history = successive.successive_approximations(*parts(observations))
    assert np.isnan(history[:-1, 4:6]).all()
    assert np.isfinite(history[-1]).all()
    np.testing.assert_array_equal(values, history[-1])
    floor = np.array([1e-3 * abs(values[0])] * 4 + [np.nan] * 2 + [1e-3 * DEG_PER_H] * 2)
    steps = np.abs(np.diff(history, axis=0)) / np.maximum(np.abs(history[1:]), floor)
    steps = np.delete(steps, [4, 5], axis=1)
    assert np.all(steps[-1] <= successive.TOLERANCE)
    assert np.all(steps[:-1].max(axis=1) > successive.TOLERANCE)


def test_the_limit_solves_the_constant_linear_system(observations):
    equations, method, mean = parts(observations)
    values, _ = successive.successive_approximations(equations, method, mean)
    rows = successive.combination(method, mean)
    expected = np.linalg.solve(rows @ equations.design, rows @ equations.right_side)
    # The iteration stops within 1e-12 of the limit, times a contraction of some 1e-2 per round.
    np.testing.assert_allclose(values, expected, rtol=1e-11)


def test_uncertainty_is_the_derivative_of_the_limit(rng):
    """u by implicit differentiation against u by perturbing each current and iterating again."""
    observations = Setup(noise=0.005, u_given=True, misalignment=600.0, repeats=2).observe(rng)
    covariance = calibrate(observations, "paper").paper.covariance
    expected = np.zeros((8, 8))
    for current, u in ((observations.jx, observations.u_jx), (observations.jy, observations.u_jy)):
        for row in range(len(observations)):
            kept, both = current[row], []
            for step in (u[row], -u[row]):
                current[row] = kept + step
                both.append(successive.successive_approximations(*parts(observations))[0])
            current[row] = kept
            change = (both[0] - both[1]) / 2
            expected += np.outer(change, change)
    size = np.sqrt(np.diagonal(expected))
    # u is 1e-4 of the value, so the neglected second order is 1e-4 of u and less.
    np.testing.assert_allclose(covariance / np.outer(size, size), expected / np.outer(size, size), atol=1e-3)


def test_bias_is_the_mean_over_every_measured_position(rng):
    setup = Setup(noise=0.005)
    observations = setup.observe(rng)
    values, _ = successive.successive_approximations(*parts(observations))
    equations = observation_equations(observations)
    np.testing.assert_allclose(equations.residuals(values).reshape(-1, 2).mean(axis=0), 0, atol=1e-19)


def test_repeats_enter_as_their_mean(rng):
    """A position measured three times weighs no more than the others."""
    once = Setup(noise=0.005).observe(rng)
    method, mean = successive.position_weights(Setup(repeats=3).observe(rng))
    np.testing.assert_allclose(mean, 1 / 48, rtol=1e-15)
    np.testing.assert_allclose(method.sum(axis=1), 1, rtol=1e-15)
    assert set(np.count_nonzero(method, axis=1)) == {3}
    single, mean_of_once = successive.position_weights(once)
    assert set(np.count_nonzero(single, axis=1)) == {1}
    np.testing.assert_allclose(mean_of_once, 1 / 16, rtol=1e-15)


def test_uneven_repeats(rng):
    positions = np.concatenate((grid(), [[0.0, 90.0], [270.0, 0.0]]))
    observations = Setup(positions=positions).observe(rng)
    method, mean = successive.position_weights(observations)
    twice = (observations.theta == 0) & np.isclose(observations.psi, np.pi / 2)
    np.testing.assert_allclose(mean[twice], 1 / 32, rtol=1e-15)
    np.testing.assert_array_equal(method[1], twice / 2)


def test_a_whole_turn_is_the_same_position(rng):
    positions = grid()
    positions[positions[:, 1] == 0, 1] = 360.0
    method, _ = successive.position_weights(Setup(positions=positions).observe(rng))
    assert method.shape == (8, 16)


def test_all_missing_positions_are_named(rng):
    with pytest.raises(InputError) as caught:
        successive.position_weights(Setup(positions=grid(thetas=(0, 180))).observe(rng))
    assert caught.value.message.values["positions"] == "(90°, 0°), (90°, 90°), (90°, 180°), (90°, 270°)"


def test_too_few_rounds_are_reported_with_their_history(observations):
    with pytest.raises(NotConverged, match="2 rounds") as caught:
        successive.successive_approximations(*parts(observations), rounds=2)
    _, history = successive.successive_approximations(*parts(observations))
    assert caught.value.iterations.shape == (2, len(PARAMETERS))
    np.testing.assert_array_equal(caught.value.iterations[:, :4], history[:2, :4])


def test_constant_currents_are_refused(rng):
    observations = Setup(truth()).observe(rng)
    observations.jx[:], observations.jy[:] = 1e-6, 2e-6
    with pytest.raises(SolverError, match="do not change"):
        successive.successive_approximations(*parts(observations))


def test_sign_of_the_quadrature_term_in_row_one():
    """The misprint of (18): with −ωк·Δc a gyro with large ωк and a tilted row 1 is recovered exactly."""
    setup = Setup(truth(wk=30.0, wg=-20.0), misalignment=1800.0)
    values, _ = successive.successive_approximations(*parts(setup.observe(np.random.default_rng(5))))
    np.testing.assert_allclose(values, setup.parameters, rtol=1e-9)
