"""Intervals from findings: against NCSLI's worked examples, brute force and simulated instruments."""

import numpy as np
import pytest

from solver.drift.recalibrating.reliability import judge_interval, reliability_model
from solver.errors import InputError


@pytest.mark.parametrize(
    ("within", "count", "days", "target", "confidence", "printed"),
    [
        (15, 20, 365, 0.95, 0.5, (231, 0.9949, 0.6516, 0.8286)),
        (14, 20, 365, 0.95, 0.5, (205, 0.9993, 0.6000, 0.7843)),
        (16, 20, 730, 0.95, 0.5, (523, 0.9682, 0.7041, 0.8716)),
        (42, 50, 365, 0.90, 0.3, (329, 0.7557, 0.8067, 0.8664)),
    ],
)
def test_method_a3(within, count, days, target, confidence, printed):
    """NCSL International Symposium 2019, tutorial on intervals, assets 1 to 3; the last from Suncal's own tests.

    All as in sandialabs/suncal, test/test_interval.py, testA3: interval, rejection confidence, bounds of R.
    """
    found = judge_interval(within, count, days, target, confidence)
    assert round(found.days) == printed[0]
    assert (round(found.confidence, 4), round(found.low, 4), round(found.high, 4)) == printed[1:]
    assert found.changed


def test_what_does_not_contradict_the_target_stands():
    found = judge_interval(19, 20, 365)
    assert (found.days, found.changed) == (365, False)
    # 1 − 0.95^13 = 0.487 does not reach one half, 1 − 0.95^14 = 0.512 does
    assert [judge_interval(n, n, 365).changed for n in (13, 14)] == [False, True]


def test_method_a3_changes_by_two_at_most():
    assert judge_interval(0, 20, 365).days == 182.5
    assert judge_interval(400, 400, 365).days == 730
    assert (judge_interval(0, 20, 365).low, judge_interval(20, 20, 365).high) == (0.0, 1.0)


def test_of_one_length_the_model_is_closed():
    """R(t) = g/n at the only t: I' = t·ln R_t/ln(g/n)."""
    found = reliability_model([365.0] * 20, [True] * 16 + [False] * 4)
    assert found.days == pytest.approx(365 * np.log(0.95) / np.log(0.8), rel=1e-9)
    assert found.shape == 1.0


def test_the_likelihood_is_at_its_largest():
    rng = np.random.default_rng(1)
    days = rng.choice([60.0, 120.0, 240.0, 480.0], 120)
    within = rng.random(120) < np.exp(-((days / 500) ** 3))
    found = reliability_model(days, within)

    def log_likelihood(shape, scale):
        powers = (days / scale) ** shape
        return np.sum(np.where(within, -powers, np.log1p(-np.exp(-powers))))

    grid = np.array(
        [[log_likelihood(b, e) for e in np.linspace(300, 900, 121)] for b in np.linspace(1, 6, 101)]
    )
    assert found.shape > 1.5
    assert found.log_likelihood == pytest.approx(log_likelihood(found.shape, found.scale), rel=1e-12)
    assert grid.max() <= found.log_likelihood <= grid.max() + 0.05  # finer than the grid by less than this
    assert found.days == pytest.approx(found.scale * (-np.log(0.95)) ** (1 / found.shape))


def test_wear_is_told_from_a_constant_rate_no_more_often_than_stated():
    rng = np.random.default_rng(2)
    taken = 0
    for _ in range(150):
        days = rng.choice([90.0, 180.0, 360.0, 720.0], 150)
        taken += reliability_model(days, rng.random(150) < np.exp(-days / 700)).shape != 1.0
    assert taken / 150 <= 0.05 + 4 * (0.05 * 0.95 / 150) ** 0.5


def test_the_lower_bound_covers():
    rng = np.random.default_rng(3)
    truth, below = 700 * -np.log(0.95), 0
    for _ in range(200):
        days = rng.choice([90.0, 360.0], 60)
        found = reliability_model(days, rng.random(60) < np.exp(-days / 700))
        below += found.at_least <= truth
        assert found.at_least < found.days
    # where Weibull is taken by chance the bound is off: 5 % and 5 % at worst
    assert below / 200 >= 0.90 - 4 * (0.9 * 0.1 / 200) ** 0.5


def test_findings_on_their_way_to_none():
    """One out of very many, and one within: the rate is about 1/Σt, or the logarithm of their number over t."""
    assert reliability_model([100.0] * 1000, [True] * 999 + [False]).scale == pytest.approx(1e5, rel=1e-3)
    found = reliability_model([100.0] * 1000, [True] + [False] * 999)
    assert found.scale == pytest.approx(100 / np.log(1000), rel=1e-9)


def test_nothing_out_of_tolerance():
    """As likely as not: 0.5 = exp(−Σt/η), so η = Σt/ln 2; the bound has 0.05 for 0.5."""
    found = reliability_model([100.0, 200.0, 700.0], [True] * 3)
    assert found.days == pytest.approx(1000 / np.log(2) * -np.log(0.95))
    assert found.at_least == pytest.approx(1000 / -np.log(0.05) * -np.log(0.95))


def test_nothing_within_tolerance():
    found = reliability_model([100.0, 200.0], [False, False])
    assert (found.days, found.at_least) == (0.0, 0.0)


@pytest.mark.parametrize(
    ("days", "within"), [([], []), ([0.0], [True]), ([1.0, 2.0], [True]), ([np.nan], [True])]
)
def test_what_does_not_fit_is_refused(days, within):
    with pytest.raises(InputError, match="Findings"):
        reliability_model(days, within)
    with pytest.raises(InputError, match="Findings"):
        judge_interval(3, 2, 365)
