"""Correlations pair by pair against scipy and simulated cases."""

import numpy as np
import pytest
from scipy import stats

from solver.drift.comparing.correlation import correlations
from solver.errors import InputError


def test_coefficients_intervals_and_p_are_those_of_scipy():
    rng = np.random.default_rng(1)
    table = rng.normal(size=(15, 3)) @ rng.normal(size=(3, 3))
    found = correlations(table, level=0.9)
    for i, j in ((0, 1), (0, 2), (1, 2)):
        expected = stats.pearsonr(table[:, i], table[:, j])
        ends = expected.confidence_interval(0.9)  # by Fisher's z
        assert found.r[i, j] == found.r[j, i] == pytest.approx(expected.statistic, rel=1e-12)
        assert found.p_value[i, j] == pytest.approx(expected.pvalue, rel=1e-9)
        assert (found.low[j, i], found.high[i, j]) == pytest.approx((ends.low, ends.high), rel=1e-9)
    assert found.r[1, 1] == 1.0
    assert np.isnan(found.p_value[1, 1])


def test_holm_adjusts_for_all_pairs():
    """Holm, 1979: smallest p times the number of pairs, the next times one less, none below the one before."""
    rng = np.random.default_rng(2)
    found = correlations(rng.normal(size=(12, 4)))
    pairs = [(i, j) for i in range(4) for j in range(i)]
    order = sorted(pairs, key=lambda pair: found.p_value[pair])
    largest = 0.0
    for step, pair in enumerate(order):
        largest = max(largest, min(1.0, (6 - step) * found.p_value[pair]))
        assert found.p_holm[pair] == pytest.approx(largest)


def test_missing_values_leave_the_other_pairs_alone():
    rng = np.random.default_rng(3)
    table = rng.normal(size=(10, 3))
    table[:4, 2] = np.nan
    found = correlations(table)
    assert found.count.tolist() == [[10, 10, 6], [10, 10, 6], [6, 6, 6]]
    assert found.r[0, 2] == pytest.approx(stats.pearsonr(table[4:, 0], table[4:, 2]).statistic, rel=1e-12)


def test_a_course_removed_costs_degrees_of_freedom():
    rng = np.random.default_rng(4)
    time = np.arange(12.0)
    wrong, p = 0, []
    course = np.linalg.qr(np.vander(time, 4)).Q
    for _ in range(2000):
        table = rng.normal(size=(12, 2))
        left = table - course @ (course.T @ table)
        p.append(correlations(left, lost=3).p_value[0, 1])
        wrong += correlations(left).p_value[0, 1] < 0.05
    assert np.mean(np.array(p) < 0.05) == pytest.approx(0.05, abs=4 * (0.05 * 0.95 / 2000) ** 0.5)
    assert wrong / 2000 > 0.07  # what it would be without


def test_against_an_expected_correlation():
    rng = np.random.default_rng(5)
    root = np.linalg.cholesky([[1.0, 0.8], [0.8, 1.0]])
    expected = np.array([[1.0, 0.8], [0.8, 1.0]])
    p = [
        correlations(rng.normal(size=(20, 2)) @ root.T, expected=expected).p_value[0, 1] for _ in range(2000)
    ]
    # Fisher's z is normal to some percent of the level for 20 cases
    assert np.mean(np.array(p) < 0.05) == pytest.approx(0.05, abs=4 * (0.05 * 0.95 / 2000) ** 0.5 + 0.005)


def test_too_few_or_constant_cases():
    found = correlations([[1.0, 2.0], [2.0, 4.0]])
    assert found.r[0, 1] == 1.0
    assert np.isnan(found.p_value[0, 1])
    assert np.isnan(found.low[0, 1])
    found = correlations([[1.0, 2.0], [1.0, 4.0], [1.0, 5.0]])
    assert np.isnan(found.r[0, 1])
    found = correlations([[1.0, 2.0], [2.0, 4.0], [3.0, 6.0], [4.0, 8.0]])
    assert (found.p_value[0, 1], found.low[0, 1], found.high[0, 1]) == (0.0, 1.0, 1.0)
    assert np.isnan(correlations(np.full((3, 1), np.nan)).r[0, 0])


def test_what_does_not_fit_is_refused():
    with pytest.raises(InputError, match="table"):
        correlations([1.0, 2.0])
    with pytest.raises(InputError, match="table"):
        correlations(np.ones((4, 2)), expected=np.ones((2, 2)))
