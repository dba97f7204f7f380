"""Components of variance against scipy's analysis of variance, the GUM's example and simulated truth."""

import numpy as np
import pytest
from scipy import stats

from solver.errors import InputError
from solver.variance_components import from_summaries, variance_components

DAYS = np.array([172, 116, 13, 144, 106, 31, 60, 125, 163, 41.0])
SPREADS = np.array([60, 77, 111, 101, 67, 93, 80, 73, 88, 86.0])
"""JCGM 100:2008, table H.9: daily means (µV above 10 V) and standard deviations (µV) of five observations."""


def table(rng, groups, repeats, between, within):
    return rng.normal(0, between, (groups, 1)) + rng.normal(0, within, (groups, repeats))


def test_f_and_p_are_those_of_scipy():
    rows = table(np.random.default_rng(1), 7, 4, 1.0, 2.0)
    found = variance_components(rows)
    expected = stats.f_oneway(*rows)
    assert found.f == pytest.approx(expected.statistic, rel=1e-12)
    assert found.p_value == pytest.approx(expected.pvalue, rel=1e-10)
    assert (found.dof_between, found.dof_within) == (6, 21)
    # the sums of squares of the two parts are those of the whole
    assert found.u_mean_pooled == pytest.approx(rows.std(ddof=1) / 28**0.5, rel=1e-12)
    assert found.u_mean == pytest.approx(rows.mean(axis=1).std(ddof=1) / 7**0.5, rel=1e-12)


def test_the_gum_example():
    """H.5: mean 97 µV; s_a 128, s_b 85, s_B 43, u 18 and pooled 13 µV; F 2.25 from rounded 57 and 85 µV."""
    found = from_summaries(DAYS, SPREADS, 5)
    assert round(found.mean) == 97
    assert round(found.mean_square_between**0.5) == 128
    assert round(found.mean_square_within**0.5) == 85
    assert round(found.variance_between**0.5) == 43
    assert (round(found.u_mean), round(found.u_mean_pooled)) == (18, 13)
    assert found.f == pytest.approx(2.25, abs=0.02)  # H.27 divides rounded values: 5·57²/85² = 2.248
    assert 0.025 < found.p_value < 0.05  # H.5.2.3: significant at 5 %, not at 2.5 %


def test_components_are_right_on_average():
    rng = np.random.default_rng(2)
    found = [variance_components(table(rng, 6, 5, 0.7, 1.3)) for _ in range(4000)]
    between = np.array([(item.mean_square_between - item.mean_square_within) / 5 for item in found])
    within = np.array([item.variance_within for item in found])
    for values, truth in ((between, 0.49), (within, 1.69)):  # unbiased: within 4 standard errors
        assert values.mean() == pytest.approx(truth, abs=4 * values.std() / 4000**0.5)


def test_p_is_uniform_when_groups_do_not_differ():
    rng = np.random.default_rng(3)
    p = [variance_components(rng.normal(size=(5, 3))).p_value for _ in range(2000)]
    assert stats.kstest(p, "uniform").pvalue > 1e-3


def test_a_between_that_cannot_be_seen_is_zero_not_negative():
    found = variance_components([[1.0, -1.0], [-1.0, 1.0], [1.0, -1.0]])
    assert found.variance_between == 0.0
    assert found.f == 0.0
    assert found.p_value == 1.0


def test_groups_without_scatter_within():
    found = variance_components([[1.0, 1.0], [2.0, 2.0]])
    assert found.f == np.inf
    assert found.p_value == 0.0
    assert found.variance_between == pytest.approx(0.5)


@pytest.mark.parametrize("rows", [[[1.0, 2.0]], [[1.0], [2.0]], [1.0, 2.0]])
def test_too_little_is_refused(rows):
    with pytest.raises(InputError, match="two groups"):
        variance_components(rows)


def test_what_is_not_finite_is_refused():
    with pytest.raises(InputError, match="finite"):
        variance_components([[1.0, np.nan], [1.0, 2.0]])
