"""Intervals of linear combinations of mean squares in the cases in which they are exact."""

import numpy as np
import pytest
from scipy import stats

from solver.drift.repeatability.mean_squares import bounds, effective_dof


def test_bounds_are_exact_where_one_mean_square_is_left():
    dof = np.array([5.0, 12.0])
    low, high = bounds(np.array([0.25, -0.25]), np.array([4.0, 0.0]), dof, 0.95)
    assert low == pytest.approx(5 / stats.chi2.ppf(0.975, 5), rel=1e-9)
    assert high == pytest.approx(5 / stats.chi2.ppf(0.025, 5), rel=1e-9)
    low, high = bounds(np.array([1.0, -1.0]), np.array([4.0, 1.0]), np.array([5.0, np.inf]), 0.95)
    assert low == pytest.approx(4 * 5 / stats.chi2.ppf(0.975, 5) - 1, rel=1e-9)
    assert high == pytest.approx(4 * 5 / stats.chi2.ppf(0.025, 5) - 1, rel=1e-9)


def test_the_lower_bound_is_zero_just_where_f_is_not_significant():
    """Ting et al., 1990: with two mean squares the bound and the F test at half the complement agree."""
    critical = stats.f.ppf(0.975, 3, 8)
    for ratio, sign in ((critical * 1.001, 1), (critical * 0.999, -1)):
        low, _ = bounds(np.array([1.0, -1.0]), np.array([ratio, 1.0]), np.array([3.0, 8.0]), 0.95)
        assert np.sign(low) == sign


def test_effective_degrees_of_freedom():
    """JCGM 100:2008, G.4.1, eq. (G.2b): one component alone keeps its own; two equal ones of n have 2·n together."""
    assert effective_dof(np.array([1.0, 0.0]), np.array([3.0, 5.0]), np.array([7.0, 2.0])) == pytest.approx(
        7.0
    )
    assert effective_dof(np.array([0.5, 0.5]), np.ones(2), np.array([6.0, 6.0])) == pytest.approx(12.0)


@pytest.mark.parametrize(
    "weights", [[0.5, 0.5, 0.2], [0.5, -0.5, 0.0], [0.25, 0.25, -0.5], [1.0, -0.3, -0.3]]
)
def test_bounds_cover_as_stated(weights):
    """Each end misses the truth in 2.5 %; Ting et al. find their method within a percent or so of it."""
    rng = np.random.default_rng(1)
    weights, truth, dof = np.array(weights), np.array([4.0, 1.5, 1.0]), np.array([4.0, 9.0, 25.0])
    missed = np.zeros(2)
    for squares in truth * rng.chisquare(dof, (1500, 3)) / dof:
        low, high = bounds(weights, squares, dof, 0.95)
        missed += [low > weights @ truth, high < weights @ truth]
    assert np.all(missed / 1500 <= 0.035 + 4 * (0.025 * 0.975 / 1500) ** 0.5), missed / 1500
