"""Every draw's solution against the single path: design by `solver.error_model`, solved orthogonally."""

from dataclasses import replace

import numpy as np
import pytest

from solver import successive
from solver.calibrate import calibrate
from solver.error_model import design_matrix, observation_equations, right_side
from solver.errors import InputError, SolverError
from solver.estimators.rate_noise import root_inverse, whitening_of
from solver.geometry import base, case_orientation, elements
from solver.inputs import COMMON, CommonUncertainty
from solver.least_squares import solve
from solver.propagation import draw_solutions
from solver.propagation.draw_solutions import session_model
from solver.propagation.input_draws import Errors
from tests.solver.propagation.test_budget import COEFFICIENTS, session
from tests.solver.propagation.test_input_draws import EARTH, everything
from tests.solver.sessions import grid


def single(at, common, errors, draw, values):
    """Design and right side of one draw, position by position."""
    z = dict(zip(COMMON, errors.common[:, draw], strict=True))
    turned = case_orientation(
        at.theta, at.psi, at.alpha + errors.angles[0, :, draw] + z["alpha"],
        at.beta + errors.angles[1, :, draw] + z["beta"], at.gamma + errors.angles[2, :, draw] + z["gamma"],
        base(z["level_1"], z["level_2"], z["azimuth"]),
    )  # fmt: skip
    here = elements(turned)
    jx = (at.jx + errors.currents[0, :, draw]) * (1 + z["gain_x"]) + z["offset_x"]
    jy = (at.jy + errors.currents[1, :, draw]) * (1 + z["gain_y"]) + z["offset_y"]
    design = design_matrix(here, jx, jy)
    design[:, 6:] *= 1 + z["gravity"]
    latitude = at.latitude + z["latitude"]
    return design, right_side(here, EARTH * np.cos(latitude), EARTH * np.sin(latitude)), z["temperature"]


def check(observations, common, *, whitening=None, rows=None, far=1.0, agreement=1e-9):
    """Compare 200 draws with the single path, in units of their own standard deviation."""
    rng = np.random.default_rng(5)
    equations = observation_equations(observations)
    values = calibrate(observations, "least-squares").solved["least-squares"].values
    model = session_model(observations, values, common=common, whitening=whitening, rows=rows)
    errors = model.inputs.errors(rng, 200)
    errors = Errors(far * errors.currents, errors.angles, errors.common)
    found = model.parameters(model.inputs.apply(errors))
    whole = draw_solutions._whole(whitening, equations.design) if rows is None else rows
    expected = np.empty_like(found)
    for draw in range(200):
        design, right, warmer = single(observations, common, errors, draw, values)
        q = solve(whole @ design, whole @ right).values
        expected[:, draw] = q - common.temperature_coefficients * warmer
    u = expected.std(axis=1)
    assert (np.abs(found - expected) < agreement * u[:, None]).all()
    return model


@pytest.fixture
def observations(rng):
    return session(rng)


def weights_of(observations, kind):
    values = calibrate(observations, "least-squares").solved["least-squares"]
    if kind == "equal":
        return None
    if kind == "by position":
        u = np.stack((observations.u_jx, observations.u_jy), axis=1)
        u = u * np.linspace(0.5, 2.0, u.size).reshape(u.shape)  # every equation has its own
        return whitening_of(values.values, u)
    return root_inverse(
        replace(values.problem, common=everything()).inputs(values.values).residual_covariance
    )


@pytest.mark.parametrize("kind", ["equal", "by position", "whole"])
def test_least_squares_agrees_with_the_single_path(observations, kind):
    check(observations, everything(), whitening=weights_of(observations, kind))


def test_the_papers_method_agrees_with_the_single_path(observations):
    rows = successive.combination(*successive.position_weights(observations))
    check(observations, everything(), rows=rows)


def test_the_papers_rows_give_what_its_iteration_gives(observations):
    """A draw put back into a session and solved by successive approximations."""
    values = calibrate(observations, "paper").solved["paper"].values
    rows = successive.combination(*successive.position_weights(observations))
    model = session_model(observations, values, rows=rows)
    errors = model.inputs.errors(np.random.default_rng(2), 5)
    found = model.parameters(model.inputs.apply(errors))
    spread = np.sqrt(np.diagonal(calibrate(observations, "paper").paper.covariance))
    for draw in range(5):
        jx, jy = (
            j + errors.currents[row, :, draw] for row, j in enumerate((observations.jx, observations.jy))
        )
        alpha, beta, gamma = (
            getattr(observations, name) + errors.angles[axis, :, draw]
            for axis, name in enumerate(("alpha", "beta", "gamma"))
        )
        moved = replace(observations, jx=jx, jy=jy, alpha=alpha, beta=beta, gamma=gamma)
        expected = calibrate(moved, "paper").paper.values
        # the iteration stops at a relative change of 1e-12, u is 1e-4 of K: 1e-8 u
        assert (np.abs(found[:, draw] - expected) < 1e-7 * spread).all()


def test_repeated_positions(rng):
    check(session(rng, repeats=3), everything(), whitening=None)


def test_without_noise_of_the_draws_nothing_moves(observations):
    """All errors zero: the estimate itself, within rounding of the whitened equations."""
    solved = calibrate(observations, "least-squares").solved["least-squares"]
    u = np.stack((observations.u_jx, observations.u_jy), axis=1)
    model = session_model(observations, solved.values, whitening=whitening_of(solved.values, u))
    found = model.parameters(model.inputs.apply(Errors(None, None, np.zeros((13, 2)))))
    uncertainty = solved.estimate.standard_uncertainties
    # the estimate's weights were of the round before, whose K differs by 1e-4: 1e-4 u
    assert (np.abs(found - solved.values[:, None]) < 1e-3 * uncertainty[:, None]).all()


def test_draws_far_from_the_estimate_are_solved_orthogonally(observations, monkeypatch):
    """Noise of the size of the signal: every draw's matrix is far from the identity."""
    calls = []
    original = draw_solutions._designs
    monkeypatch.setattr(draw_solutions, "_designs", lambda *a: calls.append(a[0].shape[-1]) or original(*a))
    check(observations, everything(), far=600.0)
    assert sum(calls) > 100


def test_near_draws_are_not(observations, monkeypatch):
    monkeypatch.setattr(draw_solutions, "_designs", lambda *a: pytest.fail("a near draw was taken for far"))
    check(observations, everything())


def test_badly_conditioned_sessions_are_solved_orthogonally(rng, monkeypatch):
    """Latitude 89.5°: hardly any horizontal Earth rate to learn K from."""
    calls = []
    original = draw_solutions._designs
    monkeypatch.setattr(draw_solutions, "_designs", lambda *a: calls.append(1) or original(*a))
    # both sides are orthogonal; they lose κ·ε of |q|/u, with κ = 150 and |q|/u = 1e5
    check(session(rng, latitude=89.5, noise=1e-4), everything(), agreement=1e-8)
    assert calls


def test_calls_of_any_size(observations):
    model = session_model(observations, calibrate(observations).least_squares.values)
    for count in (1, 511, 513, 1024):
        assert model(np.random.default_rng(0), count).shape == (count, 8)


def test_any_positions(rng):
    """Eight positions, θ of 30°: nothing is special about right angles."""
    positions = np.vstack((grid((0, 30), (10, 100, 190, 280)), grid((75,), (45, 200))))
    check(session(rng, positions=positions), everything())


def test_blank_parameters_are_refused(observations):
    values = calibrate(observations).least_squares.values.copy()
    values[6] = np.nan
    with pytest.raises(InputError, match="wg"):
        session_model(observations, values)


def test_infinite_errors_are_told(observations):
    model = session_model(observations, calibrate(observations).least_squares.values)
    errors = model.inputs.errors(np.random.default_rng(0), 3)
    errors.currents[0, 0, 1] = np.inf
    with pytest.raises(SolverError, match="not a finite number"):
        model.parameters(model.inputs.apply(errors))


def test_temperature_moves_parameters_by_their_coefficients(observations):
    """Warmer by δT than assumed: the values belong to the assumed temperature after −coefficient·δT."""
    common = CommonUncertainty.of({"temperature": 0.5}, temperature_coefficients=COEFFICIENTS)
    values = calibrate(observations).least_squares.values
    model = session_model(observations, values, common=common)
    errors = np.zeros((13, 1))
    errors[COMMON.index("temperature")] = 2.0
    found = model.parameters(model.inputs.apply(Errors(None, None, errors)))
    still = model.parameters(model.inputs.apply(Errors(None, None, 0 * errors)))
    np.testing.assert_allclose((found - still)[0, 0], -2 * COEFFICIENTS["kx"])
    np.testing.assert_allclose((found - still)[4, 0], -2 * COEFFICIENTS["w0x"])
