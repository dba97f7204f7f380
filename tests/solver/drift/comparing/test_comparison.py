"""Differences in units of their uncertainty, against scipy, brute force and numbers worked by hand."""

import numpy as np
import pytest
from scipy import stats

from solver.drift.comparing.comparison import compare, compare_jointly
from solver.errors import InputError


def test_a_difference_of_independent_results():
    """By hand: U 0.3 and 0.4 make 0.5, so that 0.4 is E_n 0.8 (ISO 13528:2022, 9.7)."""
    found = compare(100.5, 0.15, 100.1, 0.2)
    assert found.e_n == pytest.approx(0.8)
    assert found.u == pytest.approx(0.25)
    assert found.coverage_factor == pytest.approx(1.959964, abs=5e-7)  # normal distribution, tables
    assert found.in_expanded == pytest.approx(0.4 / (1.959964 * 0.25), rel=1e-6)
    assert found.p_value == pytest.approx(2 * stats.norm.sf(1.6), rel=1e-9)
    assert found.dof is None


def test_degrees_of_freedom_are_those_of_welch():
    rng = np.random.default_rng(1)
    a, b = rng.normal(0, 1, 8), rng.normal(0.5, 3, 5)
    u = [x.std(ddof=1) / len(x) ** 0.5 for x in (a, b)]
    found = compare(a.mean(), u[0], b.mean(), u[1], dof=(7, 4), probability=0.95)
    welch = stats.ttest_ind(a, b, equal_var=False)
    assert found.p_value == pytest.approx(welch.pvalue, rel=1e-9)
    assert found.dof == pytest.approx(welch.df, rel=1e-9)
    ends = welch.confidence_interval(0.95)
    assert found.expanded == pytest.approx((ends.high - ends.low) / 2, rel=1e-9)


def test_what_both_share_does_not_count():
    """The same certificate in both: u² = 0.3² of their own each, 0.4² in common; the difference has 0.3²·2."""
    found = compare(1.0, 0.5, 0.0, 0.5, covariance=0.16)
    assert found.u == pytest.approx(0.3 * 2**0.5)
    assert found.e_n == pytest.approx(1 / (2 * 0.3 * 2**0.5))


def test_differences_of_equal_gyros_are_significant_as_often_as_stated():
    rng = np.random.default_rng(2)
    common = rng.normal(0, 0.4, 4000)
    a, b = common + rng.normal(0, 0.3, 4000), common + rng.normal(0, 0.2, 4000)
    found = [
        compare(x, (0.4**2 + 0.3**2) ** 0.5, y, (0.4**2 + 0.2**2) ** 0.5, covariance=0.16)
        for x, y in zip(a, b, strict=True)
    ]
    beyond = np.mean([abs(item.in_expanded) > 1 for item in found])
    assert beyond == pytest.approx(0.05, abs=4 * (0.05 * 0.95 / 4000) ** 0.5)
    assert stats.kstest([item.p_value for item in found], "uniform").pvalue > 1e-3


def test_parameters_together():
    rng = np.random.default_rng(3)
    root_a, root_b, root = rng.normal(size=(3, 4, 4))
    shared = root @ root.T
    cov_a, cov_b = root_a @ root_a.T + shared, root_b @ root_b.T + shared
    a, b = rng.normal(size=4), rng.normal(size=4)
    found = compare_jointly(a, cov_a, b, cov_b, shared=shared)
    own = root_a @ root_a.T + root_b @ root_b.T
    assert found.covariance == pytest.approx(own, rel=1e-9, abs=1e-12)
    # conditioned like the covariance, some 1e3: nine digits are left
    assert found.chi2 == pytest.approx((a - b) @ np.linalg.solve(own, a - b), rel=1e-9)
    assert (found.dof, found.p_value) == pytest.approx((4, stats.chi2.sf(found.chi2, 4)))
    assert [item.u for item in found.single] == pytest.approx(np.sqrt(np.diag(own)))


def test_the_unit_of_a_parameter_does_not_matter():
    a, b = np.array([1.0, 2.0]), np.array([1.5, 1.0])
    covariance = np.array([[0.2, 0.1], [0.1, 0.3]])
    unit = np.diag([1e-9, 1e6])
    plain = compare_jointly(a, covariance, b, covariance)
    scaled = compare_jointly(unit @ a, unit @ covariance @ unit, unit @ b, unit @ covariance @ unit)
    assert scaled.chi2 == pytest.approx(plain.chi2, rel=1e-12)


def test_a_parameter_told_twice_counts_once():
    covariance = np.full((2, 2), 0.5)
    found = compare_jointly([3.0, 3.0], covariance, [1.0, 1.0], covariance)
    assert (found.chi2, found.dof) == pytest.approx((4.0, 1))
    found = compare_jointly([3.0, 2.0], covariance, [1.0, 1.0], covariance)
    assert (found.chi2, found.p_value) == (np.inf, 0.0)


def test_degrees_of_freedom_and_factors_of_each_parameter():
    covariance = np.eye(2)
    found = compare_jointly(
        [2.0, 2.0],
        covariance,
        [0.0, 0.0],
        covariance,
        dof=((5, None), (5, None)),
        coverage_factors=([2, 3], [2, 3]),
    )
    assert found.single[0].dof == pytest.approx(10)
    assert found.single[1].dof is None
    assert [item.e_n for item in found.single] == pytest.approx([2 / 8**0.5, 2 / 18**0.5])


def test_what_cannot_be_compared_is_refused():
    with pytest.raises(InputError, match="share cannot be more"):
        compare(1.0, 0.1, 2.0, 0.1, covariance=0.02)
    with pytest.raises(InputError, match="without any uncertainty"):
        compare(1.0, 0.1, 2.0, 0.1, covariance=0.01)
    with pytest.raises(InputError, match="without any uncertainty"):
        compare(1.0, 0.0, 2.0, 0.0)
    with pytest.raises(InputError, match="same quantities"):
        compare_jointly([1.0], [[1.0]], [1.0, 2.0], np.eye(2))
