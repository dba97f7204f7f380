"""Bands that hold as often as they say, and the date of leaving the limits."""

from collections.abc import Callable

import numpy as np
import pytest

from solver.drift.courses.course import describe
from solver.drift.courses.forecast import leaves, predict
from solver.drift.history import History

MONTH = 30.4375 * 86400.0
SD = float(np.hypot(0.02, 0.0013))
"""Of one session of a bias: start-to-start scatter 0.02 °/h, noise 0.0013 °/h."""


def test_the_correction_of_the_gum_at_30_degrees() -> None:
    """JCGM 100:2008, H.3.4: b(30 °C) = −0.1494 with u = 0.0041, of the line among the paths."""
    t = [21.521, 22.012, 22.512, 23.003, 23.507, 23.999, 24.513, 25.002, 25.503, 26.010, 26.511]
    b = [-0.171, -0.169, -0.166, -0.159, -0.164, -0.165, -0.156, -0.157, -0.159, -0.161, -0.160]
    course = describe(History.sorted_from(t, b), level=0.05)
    line = course.paths[-1]
    assert line.time_constant == np.inf
    columns = line.columns(np.array([30.0]))
    assert float((columns @ line.coefficients)[0]) == pytest.approx(-0.1494, abs=0.00005)
    assert float(np.sqrt(columns @ line.covariance @ columns.T)[0, 0]) == pytest.approx(0.0041, abs=0.00005)


def coverage(
    course: Callable[[np.random.Generator], np.ndarray],
    count: int,
    seed: int,
    tau: float = 0.02,
    u: float = 0.0013,
) -> float:
    """Share of values 1, 6 and 12 months ahead beyond their 95 % band."""
    rng = np.random.default_rng(seed)
    ahead = np.array([0, 5, 11])
    out = 0
    for _ in range(count):
        value = course(rng) + np.hypot(tau, u) * rng.normal(size=72)
        done = describe(History.sorted_from(MONTH * np.arange(60), value[:60], np.full(60, u)))
        band = predict(done, MONTH * (60 + ahead), u)
        out += int(np.sum((value[60 + ahead] < band.low) | (value[60 + ahead] > band.high)))
    return out / (3 * count)


PLACES = np.arange(72.0)


def with_step(rng: np.random.Generator) -> np.ndarray:
    return 0.001 * PLACES + 5 * SD * rng.choice([-1.0, 1.0]) * (rng.integers(3, 58) <= PLACES)


def test_the_band_is_left_as_often_as_it_says() -> None:
    """Constant, without scatter, a drift hardly to be seen, ageing, a drift with a step: 50 gyros of each, 750 values.

    The three values of a gyro share its course: the standard error lies between the binomial 0.8 % and √3
    times it; four of 1.1 % are allowed.
    """
    truths: list[tuple[Callable[[np.random.Generator], np.ndarray], float, float]] = [
        (lambda _: 0.0 * PLACES, 0.02, 0.0013),
        (lambda _: 0.0 * PLACES, 0.0, 0.003),
        (lambda _: 2.5 * SD / 134.0 * PLACES, 0.02, 0.0013),  # 2.5 standard uncertainties of a slope
        (lambda _: 10 * SD * np.exp(-PLACES / 24.0), 0.02, 0.0013),
        (with_step, 0.02, 0.0013),
    ]
    shares = [coverage(one, 50, seed, tau, u) for seed, (one, tau, u) in enumerate(truths)]
    assert abs(np.mean(shares) - 0.05) < 4 * 0.011


def test_a_plain_line_has_the_band_of_the_textbook() -> None:
    """ŷ ± t·s·√(1 + 1/n + (x − x̄)²/Σ(x − x̄)²) (NIST/SEMATECH e-Handbook, 4.5.1.2), where only a line is possible."""
    x, y = np.arange(5.0), np.array([0.1, 1.3, 1.8, 3.4, 3.9])
    course = describe(History.sorted_from(x, y))
    band = predict(course, [7.0], probability=0.9)
    slope, level = np.polyfit(x, y, 1)
    s = np.sqrt(np.sum((y - level - slope * x) ** 2) / 3)
    half = 2.353363 * s * np.sqrt(1 + 1 / 5 + 25 / 10)  # Student's t, 3 degrees of freedom, 95 %
    assert len(course.paths) == 1
    assert float(band.value[0]) == pytest.approx(level + 7 * slope)
    assert float(band.high[0] - band.value[0]) == pytest.approx(half, rel=1e-6)


def test_own_noise_widens_the_band() -> None:
    value = np.random.default_rng(2).normal(size=60)
    course = describe(History.sorted_from(MONTH * np.arange(60), value, np.full(60, 0.1)))
    narrow, wide = predict(course, [62 * MONTH], 0.0), predict(course, [62 * MONTH], 5.0)
    extra = float(wide.high[0] - wide.low[0]) ** 2 - float(narrow.high[0] - narrow.low[0]) ** 2
    assert extra == pytest.approx(
        (2 * 2.0 * 5.0) ** 2, rel=0.06
    )  # t of 58 degrees of freedom is 2.002, s² by paths


def drifting(seed: int = 3) -> History:
    value = 0.02 * np.arange(60) + 0.1 * np.random.default_rng(seed).normal(size=60)
    return History.sorted_from(MONTH * np.arange(60), value, np.full(60, 0.01))


def test_leaving_the_upper_limit() -> None:
    course = describe(drifting())
    found = leaves(course, -1.0, 1.5, until=200 * MONTH)
    assert found is not None
    assert (found.side, found.limit) == ("high", 1.5)
    assert found.latest is not None
    assert found.earliest < found.date < found.latest
    band = predict(course, [found.date])
    assert float(band.value[0]) == pytest.approx(
        1.5, abs=1e-4
    )  # between two of a thousand moments, by a line
    assert leaves(course, -1.0, 1.5, until=found.date - MONTH) is None
    mirrored = History.sorted_from(drifting().time, -drifting().value, drifting().u)
    other = leaves(describe(mirrored), -1.5, 1.0, until=200 * MONTH)
    assert other is not None
    assert (other.side, other.date) == ("low", pytest.approx(found.date, rel=1e-9))


def test_the_interval_of_the_date_holds_as_often_as_it_says() -> None:
    """The true date, 75 months, within [earliest, latest] for 80 % of 60 gyros; four standard errors: 21 %."""
    inside = 0
    for seed in range(60):
        found = leaves(describe(drifting(seed)), None, 1.5, until=400 * MONTH, probability=0.8)
        assert found is not None
        inside += found.earliest <= 75 * MONTH <= (found.latest or np.inf)
    assert abs(inside / 60 - 0.8) < 0.21


def test_a_steady_course_leads_nowhere_but_may_be_outside() -> None:
    value = np.random.default_rng(4).normal(size=60)
    course = describe(History.sorted_from(MONTH * np.arange(60), value, np.full(60, 0.1)))
    assert course.model == "constant"
    assert leaves(course, -3.0, 3.0, until=1e4 * MONTH) is None
    outside = leaves(course, -9.0, -5.0, until=1e4 * MONTH)
    assert outside is not None
    assert (outside.side, outside.date) == ("high", 59 * MONTH)


def test_one_value_bounds_nothing() -> None:
    band = predict(describe(History.sorted_from([0.0], [3.0], [0.1])), [1.0, 2.0])
    assert list(band.value) == [3.0, 3.0]
    assert (np.isneginf(band.low) & np.isposinf(band.high)).all()


@pytest.mark.parametrize("value", [[5.0] * 30, list(range(30)), [0.0] * 15 + [1.0] * 15])
def test_exact_histories_have_finite_bands(value: list[float]) -> None:
    course = describe(History.sorted_from(range(30), value))
    band = predict(course, [30.0, 60.0], 0.0)
    assert np.isfinite([band.value, band.low, band.high]).all()
    assert (band.low <= band.value).all()
    assert (band.value <= band.high).all()
