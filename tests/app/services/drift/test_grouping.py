"""Weighted means of groups, and the reduction that loses no extreme."""

from datetime import UTC, datetime, timedelta

import numpy as np
import pytest

from app.services.drift.grouping import grouped, reduced
from app.services.drift.series import SeriesTable, aware, moment

BEGIN = datetime(2024, 1, 31, 23, 0, tzinfo=UTC)


def _table(times, values, noise, start=None, u=None):
    count = len(times)
    return SeriesTable(
        {
            "session": np.arange(count), "calibration": np.arange(count) + 100,
            "start": np.arange(count) if start is None else np.array(start),
            "measured_at": np.array([moment(at) for at in times], "datetime64[us]"),
            "w0x.value": np.array(values, float), "w0x.u": np.array(noise if u is None else u, float),
            "w0x.k": np.full(count, 2.0), "w0x.u_noise": np.array(noise, float),
        }
    )  # fmt: skip


def test_the_weighted_mean_of_two_has_the_weights_of_their_variances():
    table = _table([BEGIN, BEGIN + timedelta(minutes=30)], [1.0, 2.0], [0.3, 0.6])
    (group,) = grouped(table, "day", "w0x")
    # Weights 1/0.09 and 1/0.36, four to one: (4·1 + 2)/5. External: Σw(x − x̄)² = 0.04/0.09 + 0.64/0.36 = 20/9,
    # Σw = 125/9, so √((20/9)/(125/9)) = 0.4, more than the internal 1/√(125/9) = 0.268.
    assert group.value == pytest.approx(1.2, rel=1e-14)
    assert group.u == pytest.approx(0.4, rel=1e-14)
    assert group.scatter == pytest.approx(np.sqrt(0.5), rel=1e-14)


def test_equal_values_leave_the_internal_part_and_what_is_common():
    # Noise 3 of a total of 5 leaves 4 that all have in common; of nine values the noise is 3/√9 = 1.
    table = _table([BEGIN] * 9, [7.0] * 9, [3.0] * 9, u=[5.0] * 9)
    (group,) = grouped(table, "day", "w0x")
    assert group.u == pytest.approx(np.sqrt(1.0 + 16.0), rel=1e-14)


@pytest.mark.parametrize(
    ("by", "sizes"),
    [("session", [1] * 5), ("start", [2, 3]), ("day", [1, 4]), ("month", [1, 4]), ("year", [5])],
)
def test_groups_by_start_and_by_the_calendar_in_utc(by, sizes):
    times = [BEGIN + timedelta(hours=hours) for hours in (0, 2, 3, 4, 5)]
    table = _table(times, [1, 2, 3, 4, 5], [1] * 5, start=[1, 1, 2, 2, 2])
    found = list(grouped(table, by, "w0x"))
    assert [group.sessions for group in found] == sizes
    assert found[0].first == 0
    assert found[-1].last == 4


def test_the_reduction_keeps_ends_and_extremes_and_no_more_than_asked():
    draw = np.random.default_rng(3)
    values = draw.normal(size=10_000)
    values[[1234, 7777]] = (9.0, -9.0)
    values[5000] = np.nan
    table = _table([BEGIN + timedelta(hours=n) for n in range(10_000)], values, np.ones(10_000))
    for most in (3, 10, 200):
        kept = reduced(table, "w0x", most)
        assert len(kept) <= max(most, 4)
        assert {0, 9999, 1234, 7777} <= set(kept.tolist())
        assert (np.diff(kept) > 0).all()
    assert len(reduced(table, "w0x", 10_000)) == 9_999


def test_each_span_of_time_keeps_its_own_extremes():
    values = np.sin(np.arange(1000) / 7.0)
    times = [BEGIN + timedelta(hours=n) for n in range(1000)]
    kept = reduced(_table(times, values, np.ones(1000)), "w0x", 100)
    spans = [values[begin : begin + 100] for begin in range(0, 1000, 100)]
    shown = [values[[row for row in kept if begin <= row < begin + 100]] for begin in range(0, 1000, 100)]
    for whole, part in zip(spans, shown, strict=True):
        assert (part.min(), part.max()) == (whole.min(), whole.max())


def test_nothing_determined_gives_no_group():
    table = _table([BEGIN], [np.nan], [1.0])
    assert list(grouped(table, "month", "w0x")) == []
    assert aware(table["measured_at"][0]) == BEGIN


def test_what_broke_a_rule_is_shown_and_each_statistic_by_its_own_extremes():
    """One in a hundred broke a rule, in the middle of what the others do; the averages peak elsewhere."""
    draw = np.random.default_rng(4)
    times = [BEGIN + timedelta(hours=n) for n in range(4_000)]
    values, average = draw.normal(size=4_000), draw.normal(size=4_000)
    average[[77, 3_456]] = (9.0, np.nan)
    broken = np.arange(50, 4_000, 100)
    values[broken] = 0.0
    signals = np.full(4_000, "", object)
    signals[broken] = "nelson-2"
    table = _table(times, values, np.ones(4_000)).with_columns({"w0x.ewma": average, "w0x.signals": signals})
    kept = set(reduced(table, "w0x", 60).tolist())
    assert set(broken.tolist()) <= kept
    assert len(kept) <= 60 + len(broken)
    assert 77 not in kept
    other = set(reduced(table, "w0x", 60, "ewma").tolist())
    assert {77, *broken.tolist()} <= other
    assert 3_456 not in other


def test_where_nearly_all_break_a_rule_they_are_reduced_too():
    times = [BEGIN + timedelta(hours=n) for n in range(4_000)]
    table = _table(times, np.arange(4_000.0), np.ones(4_000))
    table = table.with_columns({"w0x.signals": np.full(4_000, "ewma", object)})
    assert len(reduced(table, "w0x", 60)) <= 120
