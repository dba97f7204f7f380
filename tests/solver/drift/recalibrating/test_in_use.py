"""Calendar and use told apart, and the time until a limit, against plain least squares and simulation."""

import numpy as np
import pytest
from scipy import stats

from solver.drift.recalibrating.in_use import Use, band_meets, follow_use
from solver.errors import InputError


def used_gyro(rng, count=20, per_day=0.001, per_start=0.05, scatter=0.1):
    days = np.sort(rng.uniform(0, 1000, count))
    used = np.cumsum(rng.poisson(5, count)).astype(float)
    return days, used, 2.0 + per_day * days + per_start * used + rng.normal(0, scatter, count)


def test_coefficients_and_p_are_those_of_two_nested_fits():
    days, used, value = used_gyro(np.random.default_rng(1))
    found = follow_use(Use("w0x", days, used, value, None, None, 0.1), 1000)
    columns = np.column_stack((np.ones(20), days, used))
    full, rest = np.linalg.lstsq(columns, value)[:2]
    without = np.linalg.lstsq(columns[:, :2], value)[1]
    assert (found.per_day, found.per_use) == pytest.approx(full[1:], rel=1e-9)
    assert found.scatter == pytest.approx((rest[0] / 17) ** 0.5, rel=1e-9)
    f = (without[0] - rest[0]) / (rest[0] / 17)
    assert found.p_value == pytest.approx(stats.f.sf(f, 1, 17), rel=1e-6)
    assert found.apart
    assert (found.days, found.uses) == (None, None)


def test_the_time_is_up_where_the_band_meets_the_limit():
    days, used, value = used_gyro(np.random.default_rng(2))
    found = follow_use(Use("w0x", days, used, value, None, 12.0, 0.2), 3000)
    columns = np.column_stack((np.ones(20), days, used))
    q = np.linalg.lstsq(columns, value)[0]

    def upper(t):
        x = np.array([1.0, days[-1] + t, used[-1] + 0.2 * t])
        spread = 1 + x @ np.linalg.inv(columns.T @ columns) @ x
        return x @ q + stats.t.ppf(0.975, 17) * found.scatter * spread**0.5

    assert upper(found.days) == pytest.approx(
        12.0, abs=1e-4
    )  # a straight line between moments 1.5 days apart
    assert found.uses == pytest.approx(0.2 * found.days)


def test_a_new_value_lies_beyond_as_often_as_stated():
    """When the time is up, the next value lies beyond the upper limit in half of 5 %, not before."""
    rng = np.random.default_rng(3)
    beyond = []
    for _ in range(800):
        days, used, value = used_gyro(rng, count=12)
        found = follow_use(Use("w0x", days, used, value, None, 12.0, 0.2), 5000)
        mean = 2.0 + 0.001 * (days[-1] + found.days) + 0.05 * (used[-1] + found.uses)
        beyond.append(mean + rng.normal(0, 0.1) > 12.0)
    assert np.mean(beyond) == pytest.approx(0.025, abs=4 * (0.025 * 0.975 / 800) ** 0.5)


def test_use_that_goes_with_the_calendar_takes_it_all():
    days = np.arange(10.0) * 30
    value = 0.01 * days + np.tile([0.05, -0.05], 5)
    found = follow_use(Use("w0x", days, days / 10, value, None, 5.0, 0.1), 3000)
    assert not found.apart
    assert found.per_day == 0.0
    assert found.per_use == pytest.approx(0.1, rel=0.05)  # ±0.05 of scatter on a range of 2.7


def test_too_little_to_go_by():
    assert follow_use(Use("w0x", [1, 2, 3, 4], [1, 2, 3, 4], [0, 0, 0, 1], None, 2.0, 1.0), 100) is None
    assert follow_use(Use("w0x", range(6), [3] * 6, range(6), None, 9.0, 1.0), 100) is None


def test_a_band_meets_the_nearer_limit():
    days = np.array([0.0, 10.0, 20.0])
    low, high = np.array([-1.0, -2.0, -3.0]), np.array([1.0, 3.0, 5.0])
    assert band_meets(days, low, high, None, 4.0) == pytest.approx(15.0)
    assert band_meets(days, low, high, -1.5, 4.0) == pytest.approx(5.0)
    assert band_meets(days, low, high, -9.0, 9.0) is None
    assert band_meets(days, low, high, None, 0.5) == 0.0
    assert band_meets(days, low, high, None, None) is None
    assert (
        band_meets(days, low, np.array([1.0, np.inf, np.inf]), None, 4.0) == 0.0
    )  # nothing is known from there on


@pytest.mark.parametrize("change", [{"used": [1.0]}, {"value": [np.nan] * 6}, {"rate": -1.0}])
def test_what_does_not_fit_is_refused(change):
    good = {"days": range(6), "used": range(6), "value": range(6), "rate": 1.0}
    with pytest.raises(InputError, match="equally many"):
        follow_use(Use(parameter="w0x", low=None, high=1.0, **{**good, **change}), 100)
