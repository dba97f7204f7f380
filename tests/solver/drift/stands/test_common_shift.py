"""A shift that gyros share, beside direct minimisation and beside gyros that change alone."""

import numpy as np
import pytest

from solver.drift.stands.belief import Belief
from solver.drift.stands.common_shift import own_change, shared, split, unturned
from solver.drift.stands.starts import starts_of

PATTERN = np.array([-2.0, -2.0, 0.3, -0.3, -0.2, 0.2, 3.0, -0.5])


def drawn(rng, turn=0.0, own=None, gyros=7, each=40, at=20):
    """Starts of unit scatter; from start `at` on all gyros shift by `turn` times their patterns, gyro 0 by `own`."""
    gyro, start = np.tile(np.arange(gyros), each), np.repeat(np.arange(each), gyros)
    pattern = PATTERN * (1 + 0.1 * gyro[:, None])
    late = (start >= at)[:, None]
    value = 50.0 * gyro[:, None] + rng.standard_normal((len(gyro), 8)) + np.where(late, turn * pattern, 0.0)
    if own is not None:
        value += np.where(late & (gyro[:, None] == 0), own, 0.0)
    zero = np.zeros(len(gyro), np.int64)
    return starts_of(
        np.arange(len(gyro), dtype=float), gyro, zero, zero, start, value, np.full(value.shape, 0.5), pattern
    )


def judged(starts, dates):
    cut = split(starts, np.asarray(dates), Belief())
    signatures = np.array([starts.signature[starts.gyro == gyro].mean(axis=0) for gyro in cut.gyros])[
        :, :, None
    ]
    return cut, shared(cut, signatures, np.eye(1))


def test_information_and_score_are_those_of_two_means(rng):
    starts = drawn(rng)
    cut = split(starts, np.array([100]), Belief())
    mine = starts.gyro == 3
    before, after = mine & (np.arange(280) < 100), mine & (np.arange(280) >= 100)

    def mean(which):
        total = starts.precision[which].sum(axis=0)
        pull = np.einsum("mij,mj->i", starts.precision[which], starts.value[which])
        return np.linalg.solve(total, pull), np.linalg.inv(total)

    (late, c_late), (early, c_early) = mean(after), mean(before)
    np.testing.assert_allclose(np.linalg.inv(cut.information[3, 0]), c_late + c_early, rtol=1e-6, atol=1e-9)
    np.testing.assert_allclose(
        np.linalg.solve(cut.information[3, 0], cut.score[3, 0]), late - early, rtol=1e-6
    )


def test_gyros_without_starts_on_both_sides_tell_nothing(rng):
    starts = drawn(rng)
    cut = split(starts, np.array([1]), Belief())
    assert np.abs(cut.information[1:]).max() < 1e-9
    assert np.abs(cut.own[1:]).max() < 1e-6
    assert cut.information[0].max() > 0.1


def test_a_shared_shift_is_found_with_its_size_and_its_date(rng):
    turn = 0.5
    _, seen = judged(drawn(rng, turn=turn), np.arange(1, 280))
    best = int(np.argmax(seen.log_evidence))
    assert abs(best + 1 - 140) <= 3
    assert seen.log_evidence[best] > 30
    assert abs(seen.value[best, 0] - turn) < 4 * np.sqrt(seen.covariance[best, 0, 0])
    # It does not hang on one gyro of seven.
    assert seen.without[best] > 0.7 * seen.log_evidence[best]


@pytest.mark.parametrize(
    "own", [np.eye(8)[0] * 20, np.eye(8)[6] * 3, np.full(8, 5.0)], ids=["one", "small", "all"]
)
def test_one_gyro_that_changes_lends_the_stand_nothing(own, rng):
    cut, seen = judged(drawn(rng, own=own), np.arange(1, 280))
    assert seen.log_evidence.max() < 2.0
    assert cut.own[0].max() > 10


def test_a_jump_of_thirty_scatters_is_nobody_elses_where_few_starts_are_known(rng):
    """With few degrees of freedom the jump's own evidence is worth less; not so against the stand's."""
    cut, seen = judged(drawn(rng, own=np.eye(8)[6] * 60, gyros=3, each=10, at=5), np.arange(1, 30))
    assert (cut.worth[0] < cut.own[0]).any()
    assert seen.log_evidence.max() < 2.0


def test_one_gyro_that_changes_does_not_hide_a_shared_shift(rng):
    _, seen = judged(drawn(rng, turn=0.5, own=np.eye(8)[4] * 30), [140])
    assert abs(seen.value[0, 0] - 0.5) < 4 * np.sqrt(seen.covariance[0, 0, 0])
    assert seen.log_evidence[0] > 30


def test_one_gyro_that_changes_just_as_a_turn_would_carries_all_of_it(rng):
    _, seen = judged(drawn(rng, own=PATTERN * 1.0), [140])
    assert seen.log_evidence[0] < 2.0 or seen.leading[0] == 0


def test_without_a_shift_the_evidence_is_below_one_on_average(rng):
    """Its expectation is 1 where nothing happens; its logarithm is below 0."""
    found = [judged(drawn(rng), [140])[1].log_evidence[0] for _ in range(20)]
    assert np.mean(found) < 0.0
    assert max(found) < 5.0


def test_evidence_of_an_own_change_is_one_where_nothing_is_known():
    assert own_change(np.zeros((8, 8)), np.zeros(8), 10.0, 100.0) == pytest.approx(0.0, abs=1e-12)


def test_evidence_of_a_change_in_one_parameter_prefers_the_simple(rng):
    information = 20.0 * np.eye(8)
    one, spread = np.zeros(8), np.full(8, 10.0 / np.sqrt(8))
    one[2] = 10.0
    # The same χ², in one parameter or in all.
    evidence = [float(own_change(information, 20.0 * shift, 10.0, 1e9)) for shift in (one, spread)]
    assert evidence[0] > evidence[1] + 5


def test_a_scatter_known_from_few_starts_says_less():
    information, score = 20.0 * np.eye(8), 20.0 * np.eye(8)[1]
    evidence = [float(own_change(information, score, 10.0, dof)) for dof in (2.0, 20.0, 1e9)]
    assert evidence[0] < evidence[1] < evidence[2]
    # χ² = 20 in one parameter, ν = 2: log(1 + 10) − log(1 + 100·20)/2 − log 9, the other terms below it.
    assert evidence[0] == pytest.approx(np.log(11) - np.log(2001) / 2 - np.log(9), abs=1.0)


def test_a_turn_taken_off_leaves_none(rng):
    starts = drawn(rng, turn=0.5)
    _, seen = judged(starts, [140])
    _, rest = judged(unturned(starts, 140, float(seen.value[0, 0])), [140])
    assert abs(rest.value[0, 0]) < 1e-3
    assert rest.log_evidence[0] < 0
