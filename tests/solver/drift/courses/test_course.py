"""Courses: published lines and change points, found and dated changes of simulated gyros, and every odd history."""

import numpy as np
import pytest

from solver.drift.courses.course import Course, describe
from solver.drift.history import History
from solver.errors import InputError

MONTH = 30.4375 * 86400.0
# Annual flow of the Nile at Aswan, 1871-1970, 1e8 m³ (G. W. Cobb, Biometrika 65 (1978) 243-251, table 1).
NILE = """
1120 1160 963 1210 1160 1160 813 1230 1370 1140 995 935 1110 994 1020 960 1180 799 958 1140 1100 1210 1150 1250 1260
1220 1030 1100 774 840 874 694 940 833 701 916 692 1020 1050 969 831 726 456 824 702 1120 1100 832 764 821 768 845 864
862 698 845 744 796 1040 759 781 865 845 944 984 897 822 1010 771 676 649 846 812 742 801 1040 860 874 848 890 744 749
838 1050 918 986 797 923 975 815 1020 906 901 1170 912 746 919 718 714 740
"""


def monthly(value: np.ndarray, u: float = 0.0013) -> History:
    return History.sorted_from(MONTH * np.arange(len(value)), value, np.full(len(value), u))


def told(course: Course) -> list[tuple[str, int]]:
    return [(one.kind, one.index) for one in course.changes]


def test_the_nile_dropped_after_1898() -> None:
    """The well-known change: the last high year is 1898 (Cobb, section 4; breakpoint 28 of 100 in A. Zeileis et al.,
    Comput. Stat. Data Anal. 44 (2003) 109-123, section 5, whose means before and after are 1097.75 and 849.97).
    """
    years = np.arange(1871.0, 1971.0)
    flow = np.array([float(one) for one in NILE.split()])
    course = describe(History.sorted_from(years, flow))
    assert told(course) == [("step", 28)]
    change = course.changes[0]
    assert (change.before, change.time) == (1898.0, 1899.0)
    assert change.p_value < 1e-4
    assert change.size == pytest.approx(849.97 - 1097.75, abs=0.011)  # two printed figures, each to 0.005
    assert course.model == "constant"
    assert course.coefficients[0] == pytest.approx(849.97, abs=0.0051)
    # The sum of squares with one change is printed as 1597457 (strucchange, summary of breakpoints(Nile ~ 1)).
    assert course.scatter**2 * course.dof == pytest.approx(1597457, abs=0.51)
    assert course.dof == 98
    assert dict(change.dates)[28] > 0.5


def test_the_line_of_the_gum() -> None:
    """Calibration of a thermometer, JCGM 100:2008, H.3: slope, intercept, their uncertainties and correlation."""
    t = [21.521, 22.012, 22.512, 23.003, 23.507, 23.999, 24.513, 25.002, 25.503, 26.010, 26.511]
    b = [-0.171, -0.169, -0.166, -0.159, -0.164, -0.165, -0.156, -0.157, -0.159, -0.161, -0.160]
    course = describe(History.sorted_from(t, b), level=0.05)
    assert (course.model, course.changes, course.dof) == ("linear", (), 9)
    level, slope = course.coefficients
    to_20 = np.array([[1.0, 20.0 - course.origin], [0.0, 1.0]])
    spread = to_20 @ course.covariance @ to_20.T
    assert level + slope * (20.0 - course.origin) == pytest.approx(-0.1712, abs=0.00005)
    assert slope == pytest.approx(0.00218, abs=0.000005)
    assert np.sqrt(spread[0, 0]) == pytest.approx(0.0029, abs=0.00005)
    assert np.sqrt(spread[1, 1]) == pytest.approx(0.00067, abs=0.000005)
    assert spread[0, 1] / np.sqrt(spread[0, 0] * spread[1, 1]) == pytest.approx(-0.930, abs=0.0005)
    assert course.scatter == pytest.approx(0.0035, abs=0.00005)
    assert course.slope == pytest.approx(slope)


def test_a_step_in_a_drift_is_dated() -> None:
    """Steps of five standard deviations, 3 to 57 of 60 sessions, with a slow drift: dated to the session in 95 %.

    100 histories; the truth's own likelihood has another maximum in 1.5 % of them.
    """
    rng = np.random.default_rng(2)
    sd = np.hypot(0.02, 0.0013)
    right, places = 0, np.arange(60)
    for _ in range(100):
        when = int(rng.integers(3, 58))
        step = rng.choice([-5.0, 5.0]) * sd
        value = 0.001 * places + step * (places >= when) + sd * rng.normal(size=60)
        right += ("step", when) in told(describe(monthly(value)))
    assert right >= 95


def test_a_steady_gyro_is_left_in_peace() -> None:
    """Changes, wild values and trends in at most 1 % each of 200 steady histories: four standard errors of 0.7 %."""
    rng = np.random.default_rng(3)
    courses = [describe(monthly(rng.normal(size=60), u)) for u in (0.05, 1.0) for _ in range(100)]
    for found in (
        sum(bool(one.changes) for one in courses),
        sum(bool(one.outliers) for one in courses),
        sum(one.model != "constant" for one in courses),
    ):
        assert found <= 200 * (0.01 + 4 * 0.007)


def test_a_bend_is_found() -> None:
    places = np.arange(60)
    value = 0.5 * np.maximum(places - 30, 0) + np.random.default_rng(4).normal(size=60)
    course = describe(monthly(value, 0.1))
    assert [one.kind for one in course.changes] == ["bend"]
    bend = course.changes[0]
    assert abs(bend.index - 31) <= 3  # 0.5 a session: three sessions are worth 1.5 standard deviations
    assert abs(bend.size * MONTH - 0.5) < 4 * bend.u * MONTH
    assert course.slope == pytest.approx(bend.size, abs=4 * bend.u)
    assert course.since == bend.index


def test_two_steps_and_what_lies_between() -> None:
    rng = np.random.default_rng(5)
    value = rng.normal(size=60)
    value[15:] += 8.0
    value[40:] -= 12.0
    course = describe(monthly(value, 0.1))
    assert told(course) == [("step", 15), ("step", 40)]
    assert [one.size for one in course.changes] == pytest.approx(
        [8.0, -12.0], abs=4 * np.sqrt(1 / 15 + 1 / 20)
    )
    assert course.since_time == 40 * MONTH
    assert course.count == 20
    assert course.fitted[50] - course.fitted[30] == pytest.approx(course.changes[1].size, rel=1e-6)


@pytest.mark.parametrize("place", [0, 20, 55, 59])
def test_a_wild_value_is_not_a_step(place: int) -> None:
    value = np.random.default_rng([6, place]).normal(size=60)
    value[place] += 12.0
    course = describe(monthly(value, 0.1))
    assert course.changes == ()
    assert [one.index for one in course.outliers] == [place]
    wild = course.outliers[0]
    assert wild.p_value < 0.01
    assert abs(wild.size - 12.0) < 4 * wild.u
    assert course.scatter < 1.5  # a wild value that counted would add 12²/60


def test_at_a_break_the_level_may_change() -> None:
    """A known event is fitted, sized and tested at its own date, and never found; without a change its p is large."""
    rng = np.random.default_rng(7)
    value = rng.normal(size=60)
    value[30:] += 1.5
    course = describe(monthly(value, 0.1), breaks=[10 * MONTH - 1.0, 30 * MONTH, -5.0, 99 * MONTH])
    assert told(course) == [("step", 10), ("step", 30)]
    nothing, repair = course.changes
    assert nothing.at_break
    assert repair.at_break
    assert repair.dates == ((30, 1.0),)
    assert abs(repair.size - 1.5) < 4 * repair.u
    assert repair.u == pytest.approx(np.sqrt(1 / 20 + 1 / 30), rel=0.3)  # s² of 57 degrees of freedom
    assert repair.p_value < 0.01 < nothing.p_value


def test_ageing_is_told_from_drift_and_from_bends() -> None:
    places = np.arange(60)
    value = 12.0 * np.exp(-places / 15.0) + np.random.default_rng(8).normal(size=60)
    course = describe(monthly(value, 0.1))
    assert course.model == "exponential"
    assert course.changes == ()
    assert course.time_constant is not None
    assert abs(course.time_constant - 15 * MONTH) < 4 * np.sqrt(course.covariance[2, 2])
    assert course.origin == 0.0
    assert [one.model for one in course.tests] == ["linear", "exponential", "exponential"]
    aged = course.coefficients[1] * np.exp(-places * MONTH / course.coefficients[2])
    np.testing.assert_allclose(course.fitted, course.coefficients[0] + aged, rtol=1e-8)


def test_units_and_origins_do_not_matter() -> None:
    rng = np.random.default_rng(9)
    value = rng.normal(size=60) + 6.0 * (np.arange(60) >= 25) + 0.05 * np.arange(60)
    plain = describe(monthly(value, 0.1))
    time = 1.7e9 + MONTH * np.arange(60)
    other = describe(History.sorted_from(time, 100.0 + 1e-7 * value, np.full(60, 1e-8)))
    assert told(other) == told(plain)
    assert other.scatter == pytest.approx(1e-7 * plain.scatter, rel=1e-4)  # 100's rounding is 1e-7 of 1e-7
    assert other.slope == pytest.approx(1e-7 * plain.slope, rel=1e-4)


@pytest.mark.parametrize(
    ("time", "value", "u"),
    [
        ([0.0], [3.0], [0.1]),
        ([0.0, 1.0], [3.0, 4.0], [0.0, 0.0]),
        ([0.0, 1.0, 2.0], [3.0, 4.0, 7.0], [0.1, 0.1, 0.1]),
        (range(30), [5.0] * 30, [0.0] * 30),
        (range(30), [0.0] * 30, [0.0] * 30),
        (range(30), [0.0] * 30, [0.2] * 30),
        ([4.0] * 30, np.sin(np.arange(30.0)), [0.1] * 30),
        ([1.0] * 15 + [2.0] * 15, np.sin(np.arange(30.0)), [0.1] * 30),
        (range(30), np.arange(30.0), [0.0] * 30),
        (range(30), np.repeat([0.0, 1.0], 15), [0.0] * 30),
        (range(30), np.exp(-np.arange(30.0) / 6.0), [0.0] * 30),
        (range(30), np.where(np.arange(30) == 12, 9.0, 0.0), [0.0] * 30),
        (range(30), np.sin(np.arange(30.0)), [0.0] + [0.5] * 29),
        (range(30), 1e-300 * np.arange(30.0), [0.0] * 30),
    ],
)
def test_odd_histories_are_described(time: object, value: object, u: object) -> None:
    """Finite numbers everywhere, whatever comes; with breaks as well."""
    history = History.sorted_from(time, value, u)
    for breaks in ((), (0.5, 1.0, 2.0, 14.5)):
        course = describe(history, breaks)
        numbers = [*course.coefficients, *course.covariance.ravel(), *course.fitted, *course.u_fitted]
        numbers += [course.slope, course.u_slope, course.slope_p, course.scatter, course.agreement]
        numbers += [x for one in course.changes for x in (one.size, one.u, one.p_value)]
        numbers += [x for one in course.outliers for x in (one.size, one.u, one.p_value)]
        numbers += [x for one in course.tests for x in (one.f, one.p_value)]
        numbers += [
            x for one in course.paths for x in (one.probability, *one.coefficients, *one.covariance.ravel())
        ]
        assert np.isfinite(numbers).all()
        assert sum(one.probability for one in course.paths) == pytest.approx(1.0)


def test_exact_steps_and_lines_are_seen_without_noise() -> None:
    places = np.arange(30.0)
    assert told(describe(History.sorted_from(places, np.repeat([0.0, 1.0], 15)))) == [("step", 15)]
    line = describe(History.sorted_from(places, 2.0 * places))
    assert (line.model, line.changes, line.outliers) == ("linear", (), ())
    assert line.slope == pytest.approx(2.0, rel=1e-12)


def test_ten_thousand_values() -> None:
    """Every date of a long history is tried: 4 steps in 10,000 values."""
    rng = np.random.default_rng(10)
    where = np.array([700, 3000, 3900, 9100])
    level = np.searchsorted(where, np.arange(10_000), side="right") % 2
    value = 4.0 * level + rng.normal(size=10_000)
    course = describe(History.sorted_from(86400.0 * np.arange(10_000), value, np.full(10_000, 0.5)))
    assert [one.kind for one in course.changes] == ["step"] * len(where)
    assert max(abs(one.index - two) for one, two in zip(course.changes, where, strict=True)) <= 3


def test_nothing_is_refused() -> None:
    with pytest.raises(InputError, match="no value"):
        describe(History.sorted_from([], []))
