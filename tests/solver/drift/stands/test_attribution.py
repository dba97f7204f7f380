"""Gyro or stand, on laboratories whose truth is known."""

from dataclasses import replace

import numpy as np
import pytest

from simdevice.fleet import YEAR, Jump
from simdevice.laboratory_life import Move, Recertification, draw_laboratory
from solver.drift.stands.attribution import attribute
from solver.drift.stands.belief import Belief
from tests.solver.drift.laboratories import ARCMIN, DEG_PER_H, SCATTER, stand_histories, with_changing_gyros

MOVED = 2.3 * YEAR
TURNS = {"azimuth": (0.0, 0.0, ARCMIN), "level-north": (0.0, -ARCMIN, 0.0), "level-east": (ARCMIN, 0.0, 0.0)}


@pytest.fixture(scope="module")
def moved():
    """Twenty gyros on three stands for five years; each stand moves by 1′ about another axis."""
    moves = {number: [Move(MOVED, turn)] for number, turn in enumerate(TURNS.values())}
    return stand_histories(draw_laboratory(11, moves=moves))


def cut(history, which):
    """Some of the sessions."""
    return type(history)(*(getattr(history, name)[which] for name in history.__slots__))


def shortened(history, last):
    """The history as it was after so many sessions."""
    return cut(history, slice(last))


@pytest.mark.parametrize(("number", "direction"), list(enumerate(TURNS)))
def test_a_stand_that_moved_by_an_arcminute_is_found_to_have(moved, number, direction):
    history = moved[number]
    (finding,) = attribute(history)
    size = sum(TURNS[direction])
    assert (finding.verdict, finding.direction) == ("stand", direction)
    assert finding.probability["stand"] > 0.99
    # Four standard deviations, 6e-5.
    assert abs(finding.size - size) < 4 * finding.u < 0.5 * ARCMIN
    # Seven sessions a month, each of about 2 standard deviations: a month either way holds the date.
    true = int(np.searchsorted(history.time, MOVED))
    assert abs(finding.session - true) <= 7
    assert sum(p for _, p in finding.dates) == pytest.approx(1.0, abs=0.05)
    assert true in [session for session, _ in finding.dates]


def test_it_is_told_from_the_move_on_and_not_before(moved):
    history = moved[0]
    true = int(np.searchsorted(history.time, MOVED))
    assert attribute(shortened(history, true)) == ()
    # Azimuth shows by 2 standard deviations per session: a quarter of a year tells it by 2·√20.
    assert [finding.verdict for finding in attribute(shortened(history, true + 20))] == ["stand"]


def test_nothing_is_found_where_nothing_happened_whenever_one_looks():
    history = stand_histories(draw_laboratory(5, gyros=5, stands=1, years=3.0))[0]
    # The bound for three kinds of findings of six things over three years is below 1 for all looks together; each is
    # far less likely (tests/benchmarks/drift_findings.py).
    for last in range(1, len(history.time) + 1, 6):
        assert attribute(shortened(history, last)) == ()


@pytest.mark.parametrize("seed", [1, 2])
def test_a_gyros_own_change_is_never_the_stands(seed):
    """Sixty of them at 2 % would give 1.2; here none of 40 is."""
    laboratory = with_changing_gyros(draw_laboratory(100 + seed), np.random.default_rng(seed))
    findings = [finding for history in stand_histories(laboratory) for finding in attribute(history)]
    assert {"stand", "unclear"}.isdisjoint(finding.verdict for finding in findings)
    own = {finding.gyro for finding in findings if finding.verdict == "gyro"}
    # Those of 5 scatters and more, half of them, are clear.
    assert len(own) >= 8


def test_a_gyros_change_is_told_with_gyro_size_and_date():
    laboratory = draw_laboratory(21, gyros=6, stands=1, years=3.0)
    gyros = list(laboratory.gyros)
    size = 0.3 * DEG_PER_H
    gyros[4] = replace(gyros[4], jumps=(Jump(1.5 * YEAR, {"w0x": size}),))
    (history,) = stand_histories(replace(laboratory, gyros=tuple(gyros)))
    (finding,) = attribute(history)
    assert (finding.verdict, finding.direction, finding.gyro) == ("gyro", "own", 4)
    mine = np.flatnonzero(history.gyro == 4)
    assert finding.session == mine[np.searchsorted(history.time[mine], 1.5 * YEAR)]
    assert np.isnan(finding.size)
    z = (finding.shift - np.array([size if name == "w0x" else 0.0 for name in SCATTER])) / finding.u_shift
    # Eight normal deviates, 4.5: p = 5e-5.
    assert np.abs(z).max() < 4.5


def test_what_one_gyro_alone_shows_of_a_turn_about_east_is_unclear():
    """After the last visit of the others, nobody can say whether the stand moved or this gyro changed so."""
    laboratory = draw_laboratory(
        31, gyros=4, stands=1, years=4.0, moves={0: [Move(2.0 * YEAR, (4 * ARCMIN, 0.0, 0.0))]}
    )
    (history,) = stand_histories(laboratory)
    kept = (history.gyro == 0) | (history.time < 2.0 * YEAR)
    alone = cut(history, kept)
    (unclear,) = attribute(alone)
    assert (unclear.verdict, unclear.direction, unclear.gyro) == ("unclear", "level-east", 0)
    # What is left are the rates of change that were believed before: 0.1 and 0.3 a year.
    assert unclear.probability["stand"] == pytest.approx(0.25, abs=1e-3)
    (clear,) = attribute(history)
    assert (clear.verdict, clear.direction) == ("stand", "level-east")


def recertified(moves):
    """Six gyros for four years on a stand with a new certificate after two, uncertain by 0.5″."""
    laboratory = draw_laboratory(
        41,
        gyros=6,
        stands=1,
        years=4.0,
        moves={0: moves},
        recertifications={0: [Recertification(2 * YEAR, 7)]},
    )
    return stand_histories(laboratory)[0]


def test_a_good_new_certificate_is_said_to_change_nothing():
    history = recertified([])
    place = int(np.searchsorted(history.time, 2 * YEAR))
    findings = attribute(history)
    assert {(finding.verdict, finding.session) for finding in findings} == {("none", place)}
    assert {finding.direction for finding in findings} >= {"certificate"}


def test_a_new_certificate_that_errs_is_told_unless_it_says_so():
    """It errs by 1′ in azimuth at every position, and by 2e-4 in the parameters."""
    history = recertified([Move(2 * YEAR, (0.0, 0.0, ARCMIN))])
    later = history.certificate == 1
    history = replace(history, value=history.value * np.where(later, 1.0 + 3e-4, 1.0)[:, None])
    found = {finding.direction: finding for finding in attribute(history)}
    assert {found[name].verdict for name in ("azimuth", "certificate")} == {"certificate"}
    # Four standard deviations; the shift of Kx is 3e-4 of it, of the biases nothing to speak of.
    assert abs(found["azimuth"].size - ARCMIN) < 4 * found["azimuth"].u < ARCMIN
    shift, u = found["certificate"].shift, found["certificate"].u_shift
    assert abs(shift[0] - 3e-4 * np.median(history.value[~later, 0])) < 4 * u[0]
    stated = replace(history, u_certificate=np.full_like(history.u_certificate, 3 * ARCMIN))
    forgiven = {finding.direction: finding for finding in attribute(stated)}
    assert all(finding.verdict == "none" for name, finding in forgiven.items() if name != "certificate")


def test_a_session_with_a_blunder_tells_nothing_of_the_stand():
    """A wrong reading of one position by 3 °/h: 60 of noise in an equation, 15 in azimuth."""
    laboratory = draw_laboratory(51, gyros=4, stands=1, years=2.0)
    (history,) = stand_histories(laboratory)
    turn, chi2 = history.turn.copy(), history.chi2.copy()
    turn[-2:, 1] += 15 * history.u_turn[-2:, 1]
    turn[-2:, 0] += 15 * history.u_turn[-2:, 0] * history.correlation[-2:]
    # As the base would have turned: all of it explained.
    chi2[-2:] += 15**2
    moved = replace(history, turn=turn, chi2=chi2)
    assert [finding.direction for finding in attribute(moved)] == ["azimuth"]
    chi2[-2:] += 60**2 - 15**2
    assert attribute(replace(history, turn=turn, chi2=chi2)) == ()


def test_a_larger_threshold_finds_less(moved):
    history = moved[2]
    true = int(np.searchsorted(history.time, MOVED))
    early = shortened(history, true + 9)
    bold, careful = (attribute(early, Belief(threshold=p)) for p in (0.5, 1 - 1e-12))
    assert len(bold) >= 1
    assert careful == ()


def test_sessions_of_one_start_count_as_one_start(moved):
    """The same means given three times in one start: no start more, and the scatter of starts the same."""
    history = moved[1]
    every = np.repeat(np.arange(len(history.time)), 3)
    tripled = cut(history, every)
    once, thrice = history.starts, tripled.starts
    assert len(thrice.time) == len(once.time)
    np.testing.assert_allclose(thrice.value * thrice.scale, once.value * once.scale, rtol=1e-12)
