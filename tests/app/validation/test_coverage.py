"""The coverage study: its noise is what it says, its bounds are right, and it sees intervals that do not hold."""

from dataclasses import replace

import numpy as np
import pytest
from scipy import stats

from app.validation import coverage
from solver import calibrate
from solver.calibrate import Calibration


def silently(fraction, what):
    """Nobody watches."""


def test_means_of_the_records_have_unit_variance():
    means = np.concatenate(
        [coverage.noise_records(np.random.default_rng(k), 50).mean(axis=1) for k in range(20)]
    )
    assert means.var() == pytest.approx(1.0, abs=4 * (2 / 1000) ** 0.5)  # four standard deviations of χ²


def test_the_records_are_correlated_as_stated():
    record = coverage.noise_records(np.random.default_rng(1), 100)
    record -= record.mean()
    lags = [np.mean(record[:, lag:] * record[:, :-lag]) / np.mean(record**2) for lag in (1, 20, 100)]
    part = 0.3**2 / (1 + 0.3**2)
    expected = part * np.exp(-np.array([1, 20, 100]) / 20)  # 0.1 s at 200 Hz
    np.testing.assert_allclose(lags, expected, atol=5e-3)  # 1.2 million samples, 20 of them alike


@pytest.mark.parametrize(("count", "together"), [(400, 8), (640, 1), (4000, 8)])
def test_the_range_holds_the_share_with_the_probability_it_says(count, together):
    low, high = coverage.binomial_range(count, together)
    outside = stats.binom.cdf(round(low * count) - 1, count, 0.95) + stats.binom.sf(
        round(high * count), count, 0.95
    )
    assert outside * together <= 0.001
    inner = stats.binom.cdf(round(low * count), count, 0.95) + stats.binom.sf(
        round(high * count) - 1, count, 0.95
    )
    assert inner * together > 0.001  # and no wider than it must be


def test_sessions_of_both_kinds_hold_the_truth_mostly(monkeypatch):
    monkeypatch.setattr(coverage, "_RECORDS", 64)
    stated = coverage._stated_of_records(silently, 3)[1:]
    methods = coverage.METHODS
    quick = sum(coverage._session(np.random.default_rng([3, k]), methods, stated) for k in range(30))
    whole = coverage._session(np.random.default_rng(4), methods, None)
    assert whole.shape == (3, 8)
    # 720 intervals; those of one session hang together, so only a coarse bound
    assert 0.88 < np.sum(quick) / 720 <= 1.0


def test_slow_noise_and_few_degrees_of_freedom_are_tried(monkeypatch):
    monkeypatch.setattr(coverage, "QUICK", 12)
    monkeypatch.setattr(coverage, "_SLOWER_RECORDS", 64)
    dof = [np.median(draw(np.random.default_rng(1))[1]) for draw in coverage._conditions(5).values()]
    assert dof[0] > dof[1] > 6.0  # slower noise: fewer cosines; never fewer than six
    assert dof[2:] == [6.0, 10.0, 20.0]
    cases = coverage._further(5)
    assert [case.error for case in cases] == [""] * 5
    held = [check.obtained for case in cases for check in case.checks]
    assert len(held) == 40
    assert (
        0.85 < np.mean(held) <= 1.0
    )  # 480 intervals, those of one session hang together: only a coarse bound


def test_intervals_that_are_too_narrow_are_seen(monkeypatch):
    def narrow(observations, method, common):
        found = calibrate.calibrate(observations, method, common)
        return _Narrow(**{name: getattr(found, name) for name in Calibration.__dataclass_fields__})

    class _Narrow(Calibration):
        def budget(self, method):
            found = super().budget(method)
            return replace(found, expanded=0.5 * found.expanded)

    monkeypatch.setattr(coverage, "calibrate", narrow)
    monkeypatch.setattr(coverage, "QUICK", 60)
    monkeypatch.setattr(coverage, "_RECORDS", 64)
    found = coverage.group(silently, full=False, seed=1)
    assert found.cases[0].passed  # the means themselves
    assert not any(case.passed for case in found.cases[1:])


def test_a_solver_that_breaks_is_told(monkeypatch):
    def breaking(observations, method, common):
        raise ValueError("no interval today")

    monkeypatch.setattr(coverage, "calibrate", breaking)
    monkeypatch.setattr(coverage, "_RECORDS", 64)
    found = coverage.group(silently, full=False, seed=1)
    assert [case.error for case in found.cases[1:]] == ["ValueError: no interval today"]
