"""The GUM's own examples, and its formulas on cases whose answer is known otherwise."""

import numpy as np
import pytest
from scipy import stats

from solver.propagation.uncertainty import coverage_factor, effective_dof, linked, propagate

H1_COMPONENTS = (25.0, 9.7, 2.9, 16.6)
"""GUM H.1, table H.1: nm, of ls, d, δα and δθ."""
H1_DOF = (18.0, 25.6, 50.0, 2.0)


def h2():
    """GUM H.2, eqs. (H.7): sensitivities of R, X, Z, and the covariance of V, I, φ, from table H.2."""
    samples = np.array([
        [5.007, 4.994, 5.005, 4.990, 4.999],
        [19.663e-3, 19.639e-3, 19.640e-3, 19.685e-3, 19.678e-3],
        [1.0456, 1.0438, 1.0468, 1.0428, 1.0433],
    ])  # fmt: skip
    v, i, phi = samples.mean(axis=1)
    r, x, z = v / i * np.cos(phi), v / i * np.sin(phi), v / i
    sensitivity = np.array([[r / v, -r / i, -x], [x / v, -x / i, r], [z / v, -z / i, 0.0]])
    return sensitivity, np.cov(samples) / 5


def test_end_gauge_of_h1():
    """GUM H.1.6: u = 32 nm, ν_eff = 16 (16.7 truncated), t₉₉ = 2.92, U = 93 nm."""
    covariance = np.diag(np.square(H1_COMPONENTS))
    found = propagate(np.ones(4), covariance, H1_DOF)
    assert round(found.standard_uncertainties[0]) == 32
    assert int(found.dof[0]) == 16
    assert round(float(coverage_factor(16, 0.99)), 2) == 2.92
    # H.1.6 multiplies the rounded 32 nm by 2.92
    assert 2.92 * round(found.standard_uncertainties[0]) == pytest.approx(93, abs=0.5)


def test_worked_number_of_g41():
    """GUM G.4.1, note: four components with relative 0.25, 0.57, 0.82 and 10, 5, 15 observations give 19.0."""
    found = propagate(np.ones(3), np.diag([0.25**2, 0.57**2, 0.82**2]), [9, 4, 14])
    assert found.dof[0] == pytest.approx(19.0, abs=0.05)
    assert round(found.standard_uncertainties[0], 2) == 1.03
    assert round(float(coverage_factor(19, 0.95)), 2) == 2.09
    assert round(float(found.expanded()[0]), 1) == 2.2


def test_correlated_inputs_of_h2():
    """GUM H.2, table H.3: u, and the correlation coefficients of R, X and Z."""
    found = propagate(*h2(), dof=[4, 4, 4])
    # one unit of the last digit: the table prints 0.295 for X where its data give 0.2956
    np.testing.assert_allclose(found.standard_uncertainties, [0.071, 0.295, 0.236], atol=1e-3)
    correlation = found.correlation[np.triu_indices(3, 1)]
    np.testing.assert_allclose(correlation, [-0.588, -0.485, 0.993], atol=5e-4)


def test_inputs_evaluated_together_have_the_observations_degrees_of_freedom():
    """Five simultaneous sets of H.2: every output is like one mean of five, approach 2 of H.2.4: ν = 4."""
    np.testing.assert_allclose(propagate(*h2(), dof=[4, 4, 4]).dof, 4, rtol=1e-12)  # rounding


def test_parts_sum_to_the_variance():
    found = propagate(*h2())
    np.testing.assert_allclose(found.parts.sum(axis=1), np.diagonal(found.covariance), rtol=1e-12)  # rounding
    assert (found.parts < 0).any()  # the correlations of H.2 let inputs cancel one another


def test_components_carry_their_sign():
    found = propagate([[2.0, -3.0]], np.diag([4.0, 0.25]))
    np.testing.assert_array_equal(found.components, [[4.0, -1.5]])
    np.testing.assert_array_equal(found.dof, [np.inf])
    assert found.coverage_factors()[0] == pytest.approx(1.959964, abs=1e-6)  # normal quantile, tables
    assert found.expanded()[0] == pytest.approx(1.959964 * np.hypot(4, 1.5), rel=1e-6)


def test_welch_satterthwaite_over_groups():
    parts = np.array([[1.0, 2.0, 4.0, 8.0]])
    found = effective_dof(parts, np.array([5.0, 7.0, np.inf, 10.0]), [0, 0, 1, 2])
    assert found[0] == pytest.approx(15**2 / (3**2 / 5 + 8**2 / 10))


def test_groups_follow_correlations_through_others():
    covariance = np.eye(6)
    covariance[0, 3] = covariance[3, 0] = covariance[3, 5] = covariance[5, 3] = 0.2
    np.testing.assert_array_equal(linked(covariance), [0, 1, 2, 0, 4, 0])


def test_groups_can_be_told():
    alone = propagate(np.ones(2), np.eye(2), [4, 4])
    together = propagate(np.ones(2), np.eye(2), [4, 4], [0, 0])
    assert alone.dof[0] == pytest.approx(8)
    assert together.dof[0] == pytest.approx(4)


def test_dof_of_simultaneous_observations_by_simulation(rng):
    """Var of an estimated variance is 2·σ⁴/ν: ν from 20,000 simulated sets of six simultaneous observations."""
    covariance = np.array([[1.0, -0.6, 0.0], [-0.6, 2.0, 0.0], [0.0, 0.0, 1.5]])
    c = np.array([1.0, 0.5, -0.7])
    both = rng.multivariate_normal(np.zeros(2), covariance[:2, :2], (20_000, 6))
    third = np.sqrt(1.5) * rng.standard_normal((20_000, 11))
    variances = (both @ c[:2]).var(axis=1, ddof=1) + third.var(axis=1, ddof=1) * c[2] ** 2
    simulated = 2 * variances.mean() ** 2 / variances.var()
    # relative standard error of a variance's estimate from N draws of nearly chi-square form: √((κ − 1)/N),
    # kurtosis κ = 3 + 12/ν ≈ 4.2, so 1.3 %; 4 of them
    assert propagate(c, covariance, [5, 5, 10]).dof[0] == pytest.approx(simulated, rel=0.05)


@pytest.mark.parametrize("dof", [1.0, 2.5, 16.0, 300.0])
@pytest.mark.parametrize("level", [0.6827, 0.95, 0.99])
def test_coverage_factor_is_students_quantile(dof, level):
    assert float(coverage_factor(dof, level)) == pytest.approx(stats.t.interval(level, dof)[1], rel=1e-9)


def test_no_coverage_factor_without_degrees_of_freedom():
    np.testing.assert_array_equal(
        np.isnan(coverage_factor([np.nan, 0.5, 0.0, 1.0])), [True, True, True, False]
    )


def test_an_undetermined_output_leaves_the_others():
    found = propagate([[1.0, 1.0], [np.nan, 1.0]], np.eye(2), [3, 5])
    assert found.standard_uncertainties[0] == pytest.approx(np.sqrt(2))
    assert np.isnan(found.dof[1])
    assert np.isnan(found.coverage_factors()[1])
    assert found.dof[0] == pytest.approx(4 / (1 / 3 + 1 / 5))


def test_an_output_without_uncertainty_has_no_degrees_of_freedom():
    found = propagate([[0.0, 0.0]], np.eye(2), [3, 5])
    assert np.isnan(found.dof[0])
    assert np.isnan(found.correlation[0, 0])
