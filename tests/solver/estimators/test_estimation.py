"""Estimates with every input uncertain: covariance, χ² and residuals beside an independent calculation."""

from dataclasses import replace

import numpy as np
import pytest
from scipy import stats

from solver.calibrate import calibrate
from solver.error_model import observation_equations
from solver.estimators.estimation import Solved, least_squares, paper
from solver.estimators.generalised import generalised
from solver.estimators.observability import find_invisible
from solver.estimators.rate_noise import Problem, noise_of, root_inverse
from solver.inputs import CommonUncertainty, inputs_of
from solver.propagation.budget import make_budget
from tests.solver.sessions import Setup
from tests.solver.uncertain_sessions import ARCSEC, Uncertain, without_u

SHARED = {
    "gain_x": 2e-4, "gain_y": 3e-4, "offset_x": 2e-9, "offset_y": 1e-9, "alpha": 20 * ARCSEC,
    "beta": 30 * ARCSEC, "gamma": 40 * ARCSEC, "level_1": 25 * ARCSEC, "level_2": 15 * ARCSEC,
    "azimuth": 120 * ARCSEC, "latitude": 60 * ARCSEC, "gravity": 1e-4,
}  # fmt: skip
METHODS = [least_squares, paper]
SESSIONS = 200


def solve(method, observations, common=None) -> Solved:
    return method(observation_equations(observations), observations, common)


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("repeats", [1, 2])
def test_covariance_is_that_of_all_inputs(method, repeats, rng):
    """H by differences of the right side, V of all inputs: an independent H·V·Hᵀ."""
    case = Uncertain(Setup(noise=0.005, u_given=True, repeats=repeats), shared=SHARED)
    observations = case.observe(rng)
    solved = solve(method, observations, case.common)
    noise = inputs_of(observations, solved.values, case.common).residual_covariance
    np.testing.assert_allclose(
        solved.estimate.covariance, solved.gain @ noise @ solved.gain.T, rtol=1e-9, atol=1e-30
    )
    smaller = solve(method, observations).estimate.standard_uncertainties
    assert np.all(solved.estimate.standard_uncertainties > smaller)


@pytest.mark.parametrize("method", METHODS)
def test_gain_gives_the_values(method, rng):
    """Both estimators are linear in the equations: H·right_side is the estimate; the iteration ends at 1e-12."""
    observations = Uncertain(shared=SHARED).observe(rng)
    solved = solve(method, observations)
    values = solved.gain @ solved.problem.equations.right_side
    np.testing.assert_allclose(values, solved.values, rtol=1e-8)


@pytest.mark.parametrize("method", METHODS)
def test_without_further_uncertainty_nothing_changes(method, rng):
    observations = Setup(noise=0.005, u_given=True).observe(rng)
    solved = solve(method, observations, CommonUncertainty())
    plain = getattr(calibrate(observations), method.__name__)
    assert solved.estimate.covariance.tobytes() == plain.covariance.tobytes()
    assert solved.estimate.fit.chi2 == plain.fit.chi2


@pytest.mark.parametrize("method", METHODS)
def test_the_long_way_agrees_with_the_short_one(method, rng):
    """An angle's uncertainty of 1e-9″ takes the way through the dense V: the same to rounding."""
    observations = Setup(noise=0.005, u_given=True).observe(rng)
    short = solve(method, observations).estimate
    stated = replace(observations, u_gamma=np.full(16, 1e-9 * ARCSEC))
    long = solve(method, stated).estimate
    u = short.standard_uncertainties
    np.testing.assert_allclose(long.covariance / np.outer(u, u), short.covariance / np.outer(u, u), atol=1e-9)
    assert long.fit.chi2 == pytest.approx(short.fit.chi2, rel=1e-8)
    np.testing.assert_allclose(long.standardised, short.standardised, atol=1e-8)


def test_errors_and_chi_squared_are_those_stated():
    """200 sessions: mean of eᵀ·C⁻¹·e is 8, of χ² 24, each residual has unit variance; all at 99.99 %."""
    case = Uncertain(shared=SHARED)
    rng = np.random.default_rng(11)
    distances, chi2, residuals = {name: [] for name in ("least_squares", "paper")}, [], []
    for _ in range(SESSIONS):
        observations = case.observe(rng)
        for method in METHODS:
            estimate = solve(method, observations, case.common).estimate
            u = estimate.standard_uncertainties
            error = (estimate.values - case.setup.parameters) / u
            distances[method.__name__].append(
                error @ np.linalg.solve(estimate.covariance / np.outer(u, u), error)
            )
            chi2.append(estimate.fit.chi2)
            residuals.append(estimate.standardised)
    low, high = stats.chi2.ppf([0.00005, 0.99995], 8 * SESSIONS) / SESSIONS
    for found in distances.values():
        assert low < np.mean(found) < high
    # Of the data, not of the method: only V, around the two estimates, differs by u(K)/K and the like.
    np.testing.assert_allclose(chi2[::2], chi2[1::2], rtol=0.01)
    low, high = stats.chi2.ppf([0.00005, 0.99995], 24 * SESSIONS) / SESSIONS
    assert low < np.mean(chi2[::2]) < high
    low, high = stats.chi2.ppf([5e-7, 1 - 5e-7], SESSIONS) / SESSIONS  # over 32 residuals and two methods
    for first in (0, 1):
        mean_square = np.mean(np.square(residuals[first::2]), axis=0)
        assert np.all((low < mean_square) & (mean_square < high))


def test_scatter_contains_the_random_angles_and_not_the_common_ones(rng):
    """Without u(J): s² once, common terms on top; with repeats the angles, which they share, as well."""
    case = Uncertain(shared=SHARED)
    observations = without_u(case.observe(rng))
    with_common = solve(least_squares, observations, case.common)
    alone = solve(least_squares, replace(observations, u_alpha=np.zeros(16), u_beta=np.zeros(16)))
    assert alone.estimate.uncertainty_basis == "scatter"
    assert with_common.scatter == alone.scatter
    common_only = replace(observations, u_alpha=np.zeros(16), u_beta=np.zeros(16), u_gamma=np.zeros(16))
    added = inputs_of(common_only, alone.values, case.common).residual_covariance
    np.testing.assert_allclose(
        with_common.estimate.covariance,
        alone.estimate.covariance + alone.gain @ added @ alone.gain.T,
        rtol=1e-9, atol=1e-30,
    )  # fmt: skip
    repeated = without_u(replace(case, setup=replace(case.setup, repeats=2)).observe(rng))
    no_angles = replace(repeated, u_alpha=np.zeros(32), u_beta=np.zeros(32), u_gamma=np.zeros(32))
    assert np.all(
        solve(least_squares, repeated).estimate.standard_uncertainties
        > solve(least_squares, no_angles).estimate.standard_uncertainties
    )


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("repeats", [1, 2])
@pytest.mark.parametrize("given", [True, False])
def test_the_budget_adds_up_to_the_covariance(method, repeats, given, rng):
    case = Uncertain(Setup(noise=0.005, u_given=True, repeats=repeats), shared=SHARED)
    observations = case.observe(rng)
    solved = solve(method, observations if given else without_u(observations), case.common)
    here = solved.linearise()
    assert here.basis == ("given" if given else "scatter")
    budget = make_budget(here.gain, here.inputs, scatter=here.scatter, scatter_dof=here.scatter_dof)
    np.testing.assert_allclose(budget.covariance, solved.estimate.covariance, rtol=1e-9, atol=1e-30)


def test_what_is_blank_has_no_gain(rng):
    """θ = 0 alone does not determine the g-sensitive drifts."""
    setup = Setup(noise=0.005, u_given=True)
    observations = setup.observe(rng)
    solved = solve(least_squares, Setup(noise=0.005, u_given=True, positions=setup.positions[:4], repeats=3,
                                        misalignment=0.0).observe(rng))  # fmt: skip
    blank = np.isnan(solved.estimate.values)
    assert blank[6:].all()
    assert np.isnan(solved.linearise().gain[blank]).all()
    assert np.isfinite(solved.linearise().gain[~blank]).all()
    assert np.isfinite(solved.values).all()
    assert len(observations) == 16


def test_what_is_common_does_not_make_a_drift_unobservable(rng):
    """An offset known to no better than the Earth rate spoils ω0, but no other positions would help."""
    observations = Setup(noise=0.005, u_given=True).observe(rng)
    estimate = solve(least_squares, observations, CommonUncertainty.of({"offset_x": 2e-5})).estimate
    assert np.isfinite(estimate.values).all()
    assert estimate.fit.rank == 8
    assert estimate.standard_uncertainties[4] > 7.292115e-5


def test_whitening_by_a_root(rng):
    basis = rng.standard_normal((6, 6)) * np.logspace(-9, 0, 6)[:, None]
    covariance = basis @ basis.T
    root = root_inverse(covariance)
    np.testing.assert_allclose(root @ covariance @ root.T, np.eye(6), atol=1e-8)  # condition 1e4 or so


def test_noise_of_an_undetermined_scale_is_unknown(rng):
    observations = Setup(noise=0.005, u_given=True, latitude=90.0).observe(rng)
    equations = observation_equations(observations)
    noise = noise_of(Problem(equations, observations), np.ones(8), 20, find_invisible(equations))
    assert noise.basis == "none"
    assert np.isnan(noise.covariance).all()


@pytest.mark.parametrize("method", [least_squares, generalised])
@pytest.mark.parametrize("noise", [0.005, 5e-5])
def test_errors_of_the_angles_do_not_pretend_to_show_the_scale_at_a_pole(noise, method, rng):
    """With quiet currents it is the certificate's 60″ that makes their columns look independent."""
    case = Uncertain(Setup(noise=noise, u_given=True, latitude=90.0))
    for _ in range(5):
        observations = case.observe(rng)
        estimate = solve(method, observations).estimate
        assert np.isnan(estimate.values[:2]).all()
        assert estimate.uncertainty_basis == "none"
