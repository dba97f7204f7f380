import numpy as np
import pytest
from scipy import stats

from solver.error_model import observation_equations
from solver.estimators.estimation import least_squares
from solver.estimators.robust import robust
from solver.propagation.budget import make_budget
from tests.solver.estimators.test_estimation import SHARED
from tests.solver.sessions import Setup
from tests.solver.uncertain_sessions import Uncertain, without_u

SESSIONS = 200


def solve(observations, common=None):
    return robust(observation_equations(observations), observations, common)


def spoil(observations, rng, count, smallest=30.0, largest=300.0):
    """Blunders in both currents of `count` positions, in units of u."""
    rows = rng.choice(len(observations), count, replace=False)
    for current in (observations.jx, observations.jy):
        u = Setup(noise=0.005).u_current
        current[rows] += u * rng.choice([-1, 1], count) * rng.uniform(smallest, largest, count)
    return rows


@pytest.mark.parametrize("given", [True, False])
@pytest.mark.parametrize("count", [1, 2])
def test_blunders_do_not_spoil_it(count, given):
    """40 sessions: at most a few u of least squares' ordinary uncertainty off, where that is off by tens."""
    rng = np.random.default_rng(8)
    setup = Setup(noise=0.005, u_given=True)
    u = least_squares(*with_equations(setup.observe(rng))).estimate.standard_uncertainties
    plain, found = [], []
    for _ in range(40):
        observations = setup.observe(rng)
        rows = spoil(observations, rng, count)
        observations = observations if given else without_u(observations)
        solved = solve(observations)
        plain.append(least_squares(*with_equations(observations)).values)
        found.append(solved.values)
        assert np.all(solved.weights[rows] < 0.2)
        assert solved.estimate.outliers[rows].all()
    largest = [np.max(np.abs(np.array(rows) - setup.parameters) / u, axis=1) for rows in (plain, found)]
    assert np.median(largest[0]) > 20
    assert np.max(largest[1]) < 7
    assert np.median(largest[1]) < 3


def with_equations(observations):
    return observation_equations(observations), observations


@pytest.mark.parametrize("given", [True, False])
@pytest.mark.parametrize("count", [0, 1])
def test_stated_uncertainties_are_true(given, count):
    """200 sessions, mean square of errors over u.

    Between 0.85 (given: f is not below that of normal noise) and 1.0 for infinite n; K² of Huber's
    formula makes up for n = 32, p = 8 to about 10 % in the square; from the scatter Student's 24/22 is added;
    99.99 % of 200 correlated eights is taken as that of 2·200 independent ones.
    """
    setup = Setup(noise=0.005, u_given=True)
    rng = np.random.default_rng(21)
    errors = []
    for _ in range(SESSIONS):
        observations = setup.observe(rng)
        spoil(observations, rng, count)
        estimate = solve(observations if given else without_u(observations)).estimate
        assert estimate.uncertainty_basis == ("given" if given else "scatter")
        errors.append((estimate.values - setup.parameters) / estimate.standard_uncertainties)
    low, high = stats.chi2.ppf([0.00005, 0.99995], 2 * SESSIONS) / (2 * SESSIONS)
    mean_square = np.mean(np.square(errors))
    assert 0.85 * low < mean_square < 1.1 * high * (1.0 if given else 24 / 22)


def test_all_inputs_uncertain():
    """Angles by position in the weights and in f, common terms on top: mean square of 200 sessions as above."""
    case = Uncertain(shared=SHARED)
    rng = np.random.default_rng(4)
    errors = []
    for _ in range(SESSIONS):
        estimate = solve(case.observe(rng), case.common).estimate
        errors.append((estimate.values - case.setup.parameters) / estimate.standard_uncertainties)
    low, high = stats.chi2.ppf([0.00005, 0.99995], 2 * SESSIONS) / (2 * SESSIONS)
    assert 0.85 * low < np.mean(np.square(errors)) < 1.1 * high


def test_without_anything_beyond_k_it_is_least_squares(rng):
    """Noise of a tenth of the stated: every weight is 1, and the estimate that of least squares."""
    observations = Setup(noise=0.005, u_given=True).observe(rng)
    for u in (observations.u_jx, observations.u_jy):
        u *= 10
    solved = solve(observations)
    plain = least_squares(*with_equations(observations)).estimate
    u = plain.standard_uncertainties
    assert np.all(solved.weights == 1.0)
    np.testing.assert_allclose(solved.values / u, plain.values / u, atol=1e-4)  # a round more of weighting
    np.testing.assert_allclose(solved.estimate.standard_uncertainties / u, np.sqrt(1 / 0.95), rtol=1e-3)


def test_a_blunder_in_one_channel_costs_the_other_nothing(rng):
    observations = Setup(noise=0.005, u_given=True).observe(rng)
    observations.jy[6] += 100 * observations.u_jy[6]
    solved = solve(observations)
    assert solved.weights[6, 1] < 0.03
    assert solved.weights[6, 0] > 0.3
    assert np.argwhere(solved.estimate.outliers).tolist() == [[6, 1]]


def test_gain_and_budget_belong_to_the_estimate(rng):
    case = Uncertain(shared=SHARED)
    observations = case.observe(rng)
    spoil(observations, rng, 1)
    for given in (True, False):
        solved = solve(observations if given else without_u(observations), case.common)
        u = solved.estimate.standard_uncertainties
        values = solved.gain @ solved.problem.equations.right_side
        np.testing.assert_allclose(values / u, solved.values / u, atol=1e-5)  # the rounds end at 1e-9 of u
        here = solved.linearise()
        budget = make_budget(here.gain, here.inputs, scatter=here.scatter, scatter_dof=here.scatter_dof)
        np.testing.assert_allclose(budget.covariance, solved.estimate.covariance, rtol=1e-9, atol=1e-30)


def test_false_alarms_with_the_median_as_scale():
    """Good sessions without u(J): at 1 % about 2 in 200; 99.99 % fewer than 10, of Student's quality twice that."""
    rng = np.random.default_rng(2)
    alarms = sum(
        bool(solve(Setup(noise=0.005).observe(rng)).estimate.outliers.any()) for _ in range(SESSIONS)
    )
    assert alarms < 2 * stats.binom.ppf(0.9999, SESSIONS, 0.01)


def test_exact_data_and_undetermined_parameters(rng):
    exact = solve(Setup(misalignment=20.0).observe(rng))
    np.testing.assert_allclose(exact.values, Setup().parameters, rtol=1e-9)
    assert not exact.estimate.outliers.any()
    for given in (True, False):
        pole = Setup(noise=0.005, u_given=given, latitude=90.0).observe(rng)
        estimate = solve(pole).estimate
        assert np.isnan(estimate.values).any()
        assert estimate.uncertainty_basis == "none"
