"""Turns of a stand from a series of attitudes, drawn as their information says."""

import numpy as np
import pytest
from scipy import optimize

from solver.drift.stands.belief import YEAR, Belief
from solver.drift.stands.stand_changes import KINDS, Attitudes, differences, stand_turns
from tests.solver.drift.laboratories import ARCMIN


def information_of(rng, count):
    """Sessions of gyros with different ωg: u about 0.5′ and 0.6′, correlated by −0.8 to −0.99999."""
    correlation = -rng.uniform(0.8, 0.99999, count)
    u = np.column_stack((rng.uniform(0.4, 0.9, count), np.full(count, 0.5))) * ARCMIN
    return u, correlation


def drawn(rng, count=200, turn=(0.0, 0.0), at=100, scatter=0.0, u_and_r=None):
    """Attitudes with a turn before session `at`, and a scatter of the stand's own."""
    u, correlation = information_of(rng, count) if u_and_r is None else u_and_r
    time = np.linspace(0.0, 5 * YEAR, count)
    template = Attitudes.of(time, np.zeros(count), np.zeros((count, 2)), u, correlation)
    true = np.where(np.arange(count)[:, None] >= at, turn, 0.0) + scatter * rng.standard_normal((count, 2))
    length, axes = np.linalg.eigh(template.information)
    noise = np.einsum("nij,nj->ni", axes, np.sqrt(np.maximum(length, 0.0)) * rng.standard_normal((count, 2)))
    score = np.einsum("nij,nj->ni", template.information, true) + noise
    return Attitudes.of(time, template.certificate, score * u**2, u, correlation)


@pytest.mark.parametrize(("kind", "turn"), [("level-north", (ARCMIN, 0.0)), ("azimuth", (0.0, -ARCMIN))])
def test_a_turn_is_found_named_sized_and_dated(kind, turn, rng):
    (found,) = stand_turns(drawn(rng, turn=turn), Belief())
    assert KINDS[int(np.argmax(found.kinds))] == kind
    assert found.probability > 0.999
    # Each session shows it by 2 standard deviations.
    assert abs(found.index - 100) <= 5
    z = (found.size - turn)[found.u > 0] / found.u[found.u > 0]
    assert np.abs(z).max() < 4
    assert (found.size[found.u == 0] == 0).all()


def test_a_turn_about_both_is_told_as_both(rng):
    (found,) = stand_turns(drawn(rng, turn=(2 * ARCMIN, 1.5 * ARCMIN)), Belief())
    assert KINDS[int(np.argmax(found.kinds))] == "both"
    assert np.abs((found.size - [2 * ARCMIN, 1.5 * ARCMIN]) / found.u).max() < 4


def test_several_turns_are_found_one_by_one(rng):
    one, other = (drawn(rng, turn=(0.0, ARCMIN), at=60) for _ in range(2))
    score = np.concatenate((one.score, other.score + other.information @ [0.0, ARCMIN]))
    information = np.concatenate((one.information, other.information))
    time = np.linspace(0.0, 10 * YEAR, 400)
    found = stand_turns(Attitudes(time, np.zeros(400, np.int64), information, score), Belief())
    # At 60 and at 260.
    assert np.abs(np.array([item.index for item in found]) - [60, 260]).max() <= 6
    assert [item.size[1] for item in found] == pytest.approx([ARCMIN] * 2, rel=0.3)


def test_the_difference_is_that_of_weighted_least_squares(rng):
    """Beside a minimisation over both levels."""
    attitudes = drawn(rng, count=12, turn=(ARCMIN, -ARCMIN), at=5)
    information, score = differences(attitudes, 0, 12)
    k = 4

    def square(levels):
        x = np.where(np.arange(12)[:, None] >= k + 1, levels[2:], levels[:2]) * ARCMIN
        return -2 * np.sum(x * attitudes.score) + np.einsum("ni,nij,nj->", x, attitudes.information, x)

    best = optimize.minimize(square, np.zeros(4), method="BFGS", options={"gtol": 1e-10})
    expected = (best.x[2:] - best.x[:2]) * ARCMIN
    found = np.linalg.solve(information[k], score[k])
    np.testing.assert_allclose(found, expected, rtol=1e-3, atol=1e-3 * ARCMIN)


def test_a_stands_own_scatter_is_estimated_and_no_turn(rng):
    scattered = drawn(rng, count=400, scatter=2 * ARCMIN)
    assert np.sqrt(scattered.scatter()) == pytest.approx(2 * ARCMIN, rel=0.15)  # 400 values and more: 4 %
    assert stand_turns(scattered, Belief()) == ()
    (found,) = stand_turns(
        drawn(rng, count=400, scatter=2 * ARCMIN, turn=(0.0, 3 * ARCMIN), at=250), Belief()
    )
    # Azimuth by azimuth alone: 2.1′/√150 and 2.1′/√250.
    assert found.u[1] == pytest.approx(2.1 * ARCMIN * np.sqrt(1 / 150 + 1 / 250), rel=0.3)


def test_without_scatter_hardly_any_is_estimated(rng):
    assert np.sqrt(drawn(rng, count=400).scatter()) < 0.2 * ARCMIN


def test_false_alarms_are_rarer_than_the_bound():
    rng, belief = np.random.default_rng(12), Belief(threshold=0.8)
    trials = 150
    alarms = sum(bool(stand_turns(drawn(rng, count=60), belief)) for _ in range(trials))
    bound = belief.false_alarm_bound(5 * YEAR)
    assert alarms / trials < bound


def test_a_certificate_is_a_break_at_a_known_date(rng):
    attitudes = drawn(rng, turn=(0.0, ARCMIN), at=100)
    second = Attitudes(
        attitudes.time, (np.arange(200) >= 100).astype(np.int64), attitudes.information, attitudes.score
    )
    (found,) = stand_turns(second, Belief())
    assert (found.certificate, found.index, found.dates) == (True, 100, ((100, 1.0),))
    assert found.probability > 0.99
    (allowed,) = stand_turns(second, Belief(), np.full((200, 2), 3 * ARCMIN))
    assert allowed.probability < 0.5
    # What it states changes the verdict, not the step.
    assert np.abs(allowed.size - found.size).max() < 1e-3 * ARCMIN


def test_sessions_that_show_nothing_change_nothing(rng):
    attitudes = drawn(rng, turn=(0.0, ARCMIN))
    blind = Attitudes.of([0.0], [0], [[np.nan, np.nan]], [[np.nan, np.nan]], [np.nan])
    assert not blind.information.any()
    assert stand_turns(blind, Belief()) == ()
    every = np.repeat(np.arange(200), 2)
    information, score = attitudes.information[every], attitudes.score[every]
    information[1::2] = 0.0
    score[1::2] = 0.0
    thinned = Attitudes(attitudes.time[every], attitudes.certificate[every], information, score)
    (found,), (expected,) = stand_turns(thinned, Belief()), stand_turns(attitudes, Belief())
    np.testing.assert_allclose(found.size, expected.size, rtol=1e-3)


def test_no_sessions_no_turns():
    none = Attitudes.of(np.zeros(0), np.zeros(0), np.zeros((0, 2)), np.zeros((0, 2)), np.zeros(0))
    assert stand_turns(none, Belief()) == ()
