import numpy as np
import pytest
from scipy import linalg, stats

from solver.error_model import observation_equations
from solver.errors import InputError
from solver.estimators.estimation import least_squares
from solver.estimators.generalised import generalised
from solver.inputs import inputs_of
from tests.solver.estimators.test_estimation import SHARED
from tests.solver.sessions import Setup
from tests.solver.uncertain_sessions import ARCSEC, Uncertain, without_u

SESSIONS = 200


def solve(observations, common=None):
    return generalised(observation_equations(observations), observations, common)


def test_it_is_least_squares_on_equations_whitened_by_cholesky(rng):
    """Two rounds by scipy's Cholesky and numpy's lstsq, scaled columns; 1e-8 u for what rounding costs."""
    case = Uncertain(shared=SHARED)
    observations = case.observe(rng)
    equations = observation_equations(observations)
    solved = solve(observations, case.common)
    scale = np.linalg.norm(equations.design, axis=0)
    values = np.linalg.lstsq(equations.design / scale, equations.right_side)[0] / scale
    for _ in range(2):
        lower = linalg.cholesky(inputs_of(observations, values, case.common).residual_covariance, lower=True)
        whitened = linalg.solve_triangular(lower, equations.design / scale, lower=True)
        right_side = linalg.solve_triangular(lower, equations.right_side, lower=True)
        values = np.linalg.lstsq(whitened, right_side)[0] / scale
    u = solved.estimate.standard_uncertainties
    np.testing.assert_allclose(solved.values / u, values / u, atol=1e-8)
    covariance = np.linalg.inv(whitened.T @ whitened) / np.outer(scale, scale)
    # H·V·Hᵀ with V at the estimate, this one with V a round before: 1e-3 apart at most.
    np.testing.assert_allclose(
        solved.estimate.covariance / np.outer(u, u), covariance / np.outer(u, u), atol=2e-3
    )
    assert solved.estimate.method == "generalised"


def test_with_currents_alone_it_is_least_squares(rng):
    observations = Setup(noise=0.005, u_given=True).observe(rng)
    plain = least_squares(observation_equations(observations), observations).estimate
    found = solve(observations).estimate
    u = plain.standard_uncertainties
    np.testing.assert_allclose(found.values / u, plain.values / u, atol=1e-8)
    np.testing.assert_allclose(
        found.covariance / np.outer(u, u), plain.covariance / np.outer(u, u), atol=1e-8
    )
    assert found.fit.chi2 == pytest.approx(plain.fit.chi2, rel=1e-8)


def test_no_linear_estimator_has_a_smaller_uncertainty(rng):
    """Certified angles of very different quality: the weights pay, for every parameter."""
    case = Uncertain(shared=SHARED)
    observations = case.observe(rng)
    for column in (observations.u_alpha, observations.u_beta, observations.u_gamma):
        column[::3] = 600 * ARCSEC
    plain = least_squares(observation_equations(observations), observations, case.common).estimate
    best = solve(observations, case.common).estimate
    assert np.all(best.standard_uncertainties <= plain.standard_uncertainties * (1 + 1e-6))
    assert np.any(best.standard_uncertainties < 0.8 * plain.standard_uncertainties)


def test_errors_and_chi_squared_are_those_stated():
    """200 sessions: eᵀ·C⁻¹·e is 8 and χ² 24 in the mean, p uniform; 99.99 %."""
    case = Uncertain(shared=SHARED)
    rng = np.random.default_rng(5)
    distances, chi2, p_values = [], [], []
    for _ in range(SESSIONS):
        estimate = solve(case.observe(rng), case.common).estimate
        u = estimate.standard_uncertainties
        error = (estimate.values - case.setup.parameters) / u
        distances.append(error @ np.linalg.solve(estimate.covariance / np.outer(u, u), error))
        chi2.append(estimate.fit.chi2)
        p_values.append(estimate.fit.p_value)
    for found, freedom in ((distances, 8), (chi2, 24)):
        low, high = stats.chi2.ppf([0.00005, 0.99995], freedom * SESSIONS) / SESSIONS
        assert low < np.mean(found) < high
    assert stats.kstest(p_values, "uniform").pvalue > 1e-4


def test_it_refuses_without_uncertainties_and_says_what_is_missing(rng):
    observations = without_u(Setup(noise=0.005).observe(rng))
    with pytest.raises(InputError, match=r"Give u\(Jx\) and u\(Jy\)") as caught:
        solve(observations)
    assert caught.value.message.code == "no-uncertainty"


def test_what_no_position_determines_stays_blank(rng):
    observations = Setup(noise=0.005, u_given=True, latitude=90.0).observe(rng)
    estimate = solve(observations).estimate
    assert np.isnan(estimate.values).any()
    assert "unobservable" in {warning.code for warning in estimate.warnings}
    assert estimate.fit.rank < 8


def test_a_large_common_term_does_not_spoil_the_numbers(rng):
    """An azimuth known to 2° makes V ill-conditioned; what it does not touch is found as well as ever."""
    case = Uncertain(angles=0.0)
    observations = case.observe(rng)
    common = Uncertain(shared={"azimuth": 7200 * ARCSEC}).common
    plain, found = solve(observations).estimate, solve(observations, common).estimate
    assert found.fit.chi2 <= plain.fit.chi2 * (1 + 1e-6)
    error = (found.values - case.setup.parameters) / found.standard_uncertainties
    assert np.all(np.abs(error) < 5)
