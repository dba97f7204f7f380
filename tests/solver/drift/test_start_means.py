"""Sessions of one start as one value, and that nothing finds changes among them which starts alone make."""

import numpy as np
import pytest

from solver.drift.control.baseline import freeze
from solver.drift.control.charts import individuals
from solver.drift.courses.course import describe
from solver.drift.courses.forecast import predict
from solver.drift.history import History
from solver.drift.start_means import occasions, start_means

MONTH = 30 * 86_400.0
BETWEEN, WITHIN, NOISE = 0.02, 0.005, 0.0016
"""Scatter of starts and of the sessions of one, and the sessions' own u, °/h."""


def laid(rng: np.random.Generator, starts: int, each: int) -> History:
    """A steady gyro measured monthly, two hours apart within a start."""
    start = np.repeat(np.arange(starts), each)
    time = MONTH * start + 7200.0 * np.tile(np.arange(each), starts)
    own = rng.normal(0.0, np.hypot(WITHIN, NOISE), len(start))
    return History.sorted_from(
        time, rng.normal(0.0, BETWEEN, starts)[start] + own, np.full(len(start), NOISE), start
    )


def test_a_start_of_its_own_for_each_value_changes_nothing() -> None:
    history = laid(np.random.default_rng(1), 30, 1)
    means = start_means(history)
    assert means.history is history
    assert means.within == 0.0
    np.testing.assert_array_equal(means.member, np.arange(30))


def test_a_mean_is_the_best_linear_estimate_of_its_start() -> None:
    """Against generalised least squares with the covariance written out, unequal u and counts."""
    rng = np.random.default_rng(2)
    start = np.repeat([7, 3, 5], [4, 1, 2])
    u = rng.uniform(0.5, 2.0, 7)
    history = History.sorted_from(np.arange(7.0), rng.normal(5.0, 3.0, 7), u, start)
    means = start_means(history, within=0.7)
    design = (start[:, None] == np.array([7, 3, 5])).astype(float)
    precision = np.diag(1.0 / (u**2 + 0.7**2))
    covariance = np.linalg.inv(design.T @ precision @ design)
    expected = covariance @ design.T @ precision @ history.value
    np.testing.assert_allclose(means.history.value, expected, rtol=1e-14)  # a few roundings
    np.testing.assert_allclose(means.history.u, np.sqrt(np.diagonal(covariance)), rtol=1e-14)
    assert means.first.tolist() == [0, 4, 5]
    assert means.member.tolist() == [0, 0, 0, 0, 1, 2, 2]


def test_the_scatter_within_a_start_comes_back() -> None:
    rng = np.random.default_rng(3)
    found = [start_means(laid(rng, 40, 4)).within ** 2 for _ in range(200)]
    # The mean square of 120 degrees of freedom has the relative standard deviation √(2/120), of 200 of them 0.9 %.
    assert np.mean(found) == pytest.approx(WITHIN**2, rel=5 * 0.009 * (1 + NOISE**2 / WITHIN**2))


def test_starts_that_overlap_are_kept_apart_and_in_order() -> None:
    history = History.sorted_from([0.0, 1.0, 2.0, 9.0], [1.0, 10.0, 12.0, 3.0], None, [1, 2, 2, 1])
    means = start_means(history, within=0.0)
    assert means.history.time.tolist() == [1.5, 4.5]
    assert means.history.value.tolist() == [11.0, 2.0]
    assert means.member.tolist() == [1, 0, 0, 1]
    assert means.first.tolist() == [1, 0]


def test_one_start_alone_tells_nothing_of_others() -> None:
    assert occasions(np.array([4, 4, 4])).tolist() == [0, 1, 2]
    assert occasions(np.array([4, 4, 2])).tolist() == [1, 1, 0]
    assert occasions(np.array([], np.int64)).tolist() == []


@pytest.mark.parametrize("each", [2, 4, 10])
def test_steady_gyros_measured_several_times_a_start_are_left_in_peace(each: int) -> None:
    """Values taken for independent gave steps with p < 0.001 in 8, 26 and 40 of 40 such histories."""
    rng = np.random.default_rng(each)
    steps = left = 0
    for _ in range(40):
        whole = laid(rng, 41, each)
        known, new = whole[: 40 * each], whole[40 * each :]
        course = describe(known)
        steps += any(change.p_value < 1e-3 for change in course.changes)
        band = predict(course, new.time[:1], NOISE)
        left += not band.low[0] <= new.value[0] <= band.high[0]
    assert steps <= 1  # expected 0.04
    assert left <= 8  # expected 2, standard deviation 1.4: beyond 8 once in 10 000


def test_a_step_is_dated_to_the_first_session_of_a_start() -> None:
    rng = np.random.default_rng(8)
    history = laid(rng, 30, 3)
    value = history.value + np.where(history.start >= 12, 0.2, 0.0)
    (step,) = describe(History(history.time, value, history.u, history.start)).changes
    assert (step.index, step.time, step.before) == (36, history.time[36], history.time[35])
    assert dict(step.dates)[36] > 0.9


def test_points_of_a_chart_are_beyond_as_often_as_stated() -> None:
    """Each baseline of 25 starts with four sessions judges 40 more; 0.27 % of 8,000 points, correlated by baseline."""
    rng = np.random.default_rng(11)
    beyond = 0
    for _ in range(200):
        means = start_means(laid(rng, 65, 4)).history
        chart = individuals(means[25:], freeze(means[:25], "paule-mandel"), "prediction")
        beyond += int(np.count_nonzero(np.abs(chart.z) > 3.0))
    assert 8 <= beyond <= 42  # 21.6 expected; the variance of a baseline's rate about doubles Poisson's
