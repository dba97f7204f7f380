"""A type's distribution against published robust estimates, scipy and simulated gyros."""

import numpy as np
import pytest
from scipy import stats

from solver.drift.comparing.distribution import (
    algorithm_a,
    anderson_darling,
    anderson_darling_p,
    distribution,
)
from solver.errors import InputError

COPPER = np.array(
    [
        [2.2, 2.2, 2.4, 2.4, 2.5, 2.7, 2.8, 2.9, 3.03, 3.03, 3.1, 3.37],
        [3.4, 3.4, 3.4, 3.5, 3.6, 3.7, 3.7, 3.7, 3.7, 3.77, 5.28, 28.95],
    ]
).ravel()
"""Copper in wholemeal flour, µg/g: Analytical Methods Committee, Analyst 114, 1989, 1693-1702."""


def test_algorithm_a_on_copper_in_flour():
    """Huber's proposal 2 of the same values by statsmodels, scale.huber: 3.2054980819923693, 0.67365260010478967."""
    # both iterate to 1e-8 or better
    assert algorithm_a(COPPER) == pytest.approx((3.2054980819923693, 0.67365260010478967), rel=1e-7)


def test_of_normal_values_robust_and_plain_agree():
    values = np.random.default_rng(1).normal(3.0, 2.0, 20000)
    centre, width = algorithm_a(values)
    # efficiencies above 90 %: five standard errors of the plain ones
    assert centre == pytest.approx(3.0, abs=5 * 2 / 20000**0.5)
    assert width == pytest.approx(2.0, abs=5 * 2 / 40000**0.5)


def test_standing_of_each_gyro():
    found = distribution([1.0, 2.0, 2.0, 3.0, 9.0])
    assert list(found.rank) == [1, 2, 2, 4, 5]
    assert found.z == pytest.approx((np.array([1, 2, 2, 3, 9]) - found.robust_mean) / found.robust_sd)
    # the odd one out cannot hide in the scatter it makes: a plain z of five never exceeds 4/√5
    assert found.z[4] > 4 / 5**0.5
    assert (found.mean, found.sd) == pytest.approx((3.4, np.std([1, 2, 2, 3, 9], ddof=1)))
    assert found.quantiles[2] == 2.0


def test_between_gyros_beyond_their_uncertainties():
    rng = np.random.default_rng(2)
    truth = rng.normal(0.0, 0.3, 4000)
    u = rng.choice([0.1, 0.4], 4000)
    found = distribution(truth + rng.normal(0.0, u), u)
    # variance of the estimate about 2·(0.3² + 0.085)²/4000: four of its standard errors in terms of the deviation
    assert found.between == pytest.approx(0.3, abs=4 * (2 / 4000) ** 0.5 * 0.175 / 0.6)
    assert found.sd > 0.35


def test_anderson_darling_statistic():
    values = np.random.default_rng(3).gamma(3.0, size=30)
    squared, _ = anderson_darling(values)
    y = np.sort((values - values.mean()) / values.std(ddof=1))
    i = np.arange(1, 31)
    plain = -30 - np.mean((2 * i - 1) * (stats.norm.logcdf(y) + stats.norm.logsf(y[::-1])))
    assert squared == pytest.approx(plain * (1 + 0.75 / 30 + 2.25 / 900), rel=1e-12)


def test_anderson_darling_significance():
    """D'Agostino & Stephens, 1986, table 4.7: A*² of 0.631, 0.752, 0.873, 1.035 are at 10, 5, 2.5 and 1 %.

    NIST/SEMATECH e-Handbook, 1.3.5.14, has the same table.
    """
    for critical, p in ((0.631, 0.10), (0.752, 0.05), (0.873, 0.025), (1.035, 0.01)):
        assert anderson_darling_p(critical) == pytest.approx(
            p, rel=0.04
        )  # the formulas approximate the table: p to two digits


def test_normal_types_are_called_so_as_often_as_stated():
    rng = np.random.default_rng(4)
    p = np.array([anderson_darling(rng.normal(size=15))[1] for _ in range(3000)])
    for level in (0.01, 0.05, 0.2, 0.5):
        # four standard errors and a twentieth for the approximation of finite samples
        assert np.mean(p < level) == pytest.approx(
            level, abs=4 * (level * (1 - level) / 3000) ** 0.5 + 0.05 * level
        )


def test_what_is_far_from_normal_is_told():
    assert distribution(COPPER).p_normal < 1e-6
    heavy = np.append(np.random.default_rng(5).normal(size=500), 1e6)
    assert 0.0 < distribution(heavy).p_normal < 1e-20


def test_few_or_equal_values():
    found = distribution([1.5])
    assert (found.sd, found.between, found.robust_mean, found.p_normal) == (0.0, 0.0, 1.5, None)
    assert np.isnan(found.z).all()
    found = distribution([2.0] * 9)
    assert (found.robust_sd, found.anderson_darling) == (0.0, None)
    found = distribution([2.0] * 9 + [5.0])  # more than half are equal: the start has no width
    assert found.robust_mean == pytest.approx(2.0, abs=0.35)
    assert found.robust_sd > 0.0


@pytest.mark.parametrize("values", [[], [np.nan], [[1.0]]])
def test_nothing_to_describe_is_refused(values):
    with pytest.raises(InputError, match="one gyro"):
        distribution(values)
