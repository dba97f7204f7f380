"""Odds of a change: closed forms beside integration, and the bound on false alarms beside simulation."""

import numpy as np
import pytest
from scipy import integrate, stats

from solver.drift.stands.belief import YEAR, Belief, gaussian_evidence, log_date_odds, odds


def test_the_evidence_is_the_average_likelihood_ratio():
    information, score, size = 7.0, 4.0, 0.6

    def weighted(d: float) -> float:
        return float(np.exp(d * score - d * information * d / 2) * stats.norm.pdf(d, 0, size))

    expected, error = integrate.quad(weighted, -6, 6, epsabs=1e-12)
    found = gaussian_evidence(np.array([[information]]), np.array([score]), size)
    assert np.exp(found) == pytest.approx(expected, abs=10 * error)


def test_in_two_dimensions_likewise():
    """By sums over a grid, which for a smooth bell converge faster than any power of its step."""
    information, score = np.array([[5.0, 2.0], [2.0, 3.0]]), np.array([1.5, -1.0])
    d = np.stack(np.meshgrid(*[np.linspace(-6, 6, 401)] * 2), axis=-1)
    ratio = np.exp(d @ score - 0.5 * np.einsum("xyi,ij,xyj->xy", d, information, d))
    expected = np.sum(ratio * np.prod(stats.norm.pdf(d, 0, 0.8), axis=-1)) * (12 / 400) ** 2
    assert np.exp(gaussian_evidence(information, score, 0.8)) == pytest.approx(expected, rel=1e-9)


def test_nothing_measured_is_no_evidence():
    assert gaussian_evidence(np.zeros((3, 2, 2)), np.zeros((3, 2)), 1.0).tolist() == [0.0] * 3


def test_prior_odds_of_dates_are_those_of_a_constant_rate():
    time = np.array([0.0, 1.0, 1.0, 4.0]) * YEAR
    found = np.exp(log_date_odds(time, 0.2 / YEAR))
    # Two sessions of one moment: nothing can happen between them.
    np.testing.assert_allclose(found, [1 - np.exp(-0.2), 0.0, np.exp(-0.2) - np.exp(-0.8)], atol=1e-15)


def test_odds_share_among_dates_and_kinds():
    told = odds(np.log([[2.0, 6.0], [0.0 + 1e-300, 4.0]]), np.log([0.1, 0.1]))
    assert np.exp(told.log) == pytest.approx(1.2, rel=1e-12)
    assert told.probability == pytest.approx(1.2 / 2.2, rel=1e-12)
    np.testing.assert_allclose(told.dates, [2 / 12, 10 / 12], rtol=1e-12)
    np.testing.assert_allclose(told.kinds, [8 / 12, 4 / 12], rtol=1e-12)


def test_no_date_no_odds():
    told = odds(np.zeros((3, 0)), np.zeros(0))
    assert (told.log, told.probability, len(told.dates)) == (-np.inf, 0.0, 0)


def test_looking_after_every_session_is_within_the_bound():
    """White sessions of a stand that never changes, looked at after each one: the threshold at 0.9, to have alarms."""
    rng = np.random.default_rng(4)
    belief = Belief(threshold=0.9, move_size=1.0)
    count, trials = 40, 2000
    time = np.linspace(0.0, 5 * YEAR, count)
    z = rng.standard_normal((trials, count))
    alarmed = np.zeros(trials, dtype=bool)
    for last in range(2, count + 1):
        after = np.arange(last - 1, 0, -1.0)
        information = after * (last - after) / last
        tail = np.cumsum(z[:, :last][:, ::-1], axis=1)[:, ::-1][:, 1:]
        score = tail - after / last * z[:, :last].sum(axis=1, keepdims=True)
        evidence = gaussian_evidence(
            np.broadcast_to(information[:, None, None], (trials, last - 1, 1, 1)), score[..., None], 1.0
        )
        joint = np.logaddexp.reduce(evidence + log_date_odds(time[:last], belief.moves), axis=1)
        alarmed |= joint >= belief.log_odds
    bound = belief.false_alarm_bound(5 * YEAR)
    assert bound == pytest.approx(0.1 / 0.9 * (1 - np.exp(-0.5)), rel=1e-9)
    # At most the bound, three binomial standard deviations allowed; but not nothing, or this would test nothing.
    assert 0.0 < alarmed.mean() < bound + 3 * np.sqrt(bound * (1 - bound) / trials)
