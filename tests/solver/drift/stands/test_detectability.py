"""The smallest turn that is found: the formula beside simulated stands."""

import numpy as np
import pytest

from simdevice.laboratory_life import Move, draw_laboratory
from solver.drift.stands.attribution import attribute
from solver.drift.stands.belief import Belief
from solver.drift.stands.detectability import detectable
from solver.drift.stands.stand_changes import Attitudes, stand_turns
from tests.solver.drift.laboratories import ARCMIN, stand_histories


@pytest.fixture(scope="module")
def history():
    return stand_histories(draw_laboratory(4, gyros=7, stands=1))[0]


@pytest.mark.parametrize("power", [0.5, 0.95])
@pytest.mark.parametrize("axis", [0, 1])
def test_turns_of_that_size_are_found_as_often_as_said(history, power, axis):
    found = detectable(history, power=power)
    turn = np.zeros(2)
    turn[axis] = (found.level_north, found.azimuth)[axis]
    rng, trials = np.random.default_rng(3), 100
    information = history.attitudes.information
    root = np.linalg.cholesky(information + 1e-9 * np.eye(2) * information.max())
    after = np.arange(len(history.time)) >= found.session
    mean = np.where(after[:, None], information @ turn, 0.0)
    hits = 0
    for _ in range(trials):
        score = mean + np.einsum("nij,nj->ni", root, rng.standard_normal(mean.shape))
        drawn = Attitudes(history.time, history.certificate, information, score)
        hits += bool(stand_turns(drawn, Belief()))
    # Binomial, 3.3 standard deviations; other dates and kinds, which the formula leaves out, add some.
    error = 3.3 * np.sqrt(power * (1 - power) / trials)
    assert power - error < hits / trials < power + error + 0.12


def test_it_falls_with_sessions_and_rises_with_power(history):
    whole, careful = detectable(history), detectable(history, power=0.999)
    half = type(history)(*(getattr(history, name)[::2] for name in history.__slots__))
    fewer = detectable(half)
    for name in ("azimuth", "level_north", "level_east"):
        assert getattr(whole, name) < getattr(careful, name)
        # Half of the sessions tell 1/√2 of it; the odds of a date change by their logarithm only.
        assert getattr(fewer, name) / getattr(whole, name) == pytest.approx(np.sqrt(2), rel=0.15)
        assert getattr(whole, name) < ARCMIN
    late = detectable(history, session=len(history.time) - 10)
    assert late.azimuth > 2 * whole.azimuth
    assert late.session == len(history.time) - 10


def test_without_sessions_on_both_sides_nothing_is_detectable(history):
    for session in (0, len(history.time)):
        found = detectable(history, session=session)
        assert {found.azimuth, found.level_north, found.level_east} == {np.inf}


def test_a_scatter_known_from_nothing_shows_no_turn_about_east(history):
    few = type(history)(*(getattr(history, name)[:9] for name in history.__slots__))
    found = detectable(few, session=5)
    assert found.level_east == np.inf
    assert found.azimuth < np.inf


def test_a_turn_about_east_of_that_size_is_found():
    """Of 1.3 times the size by which 95 % are found, three of three stands are (p = 1 − 0.995³ otherwise)."""
    still = [detectable(one) for one in stand_histories(draw_laboratory(77))]
    moves = {}
    for number, one in enumerate(stand_histories(draw_laboratory(77))):
        at = float(one.time[still[number].session]) - 1.0
        moves[number] = [Move(at, (1.3 * still[number].level_east, 0.0, 0.0))]
    for one in stand_histories(draw_laboratory(77, moves=moves)):
        assert [(item.verdict, item.direction) for item in attribute(one)] == [("stand", "level-east")]
