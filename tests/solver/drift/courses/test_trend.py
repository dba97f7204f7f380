"""Trend: a certified exponential fit of NIST, F against two plain fits, and how often chance alone makes a trend."""

import numpy as np
import pytest
from scipy import stats

from solver.drift.courses.course import describe
from solver.drift.courses.regression import LINE, Series, Structure, design
from solver.drift.courses.trend import ageing_tests, profile, slope_test
from solver.drift.history import History

# NIST StRD, Nonlinear Regression, Misra1a (D. Misra, NIST, 1978): y = b1·(1 − exp(−b2·x)); certified values with their
# standard deviations.
MISRA1A = {
    "y": [10.07, 14.73, 17.94, 23.93, 29.61, 35.18, 40.02, 44.82, 50.76, 55.05, 61.01, 66.40, 75.47, 81.78],
    "x": [77.6, 114.9, 141.1, 190.8, 239.9, 289.0, 332.8, 378.4, 434.8, 477.3, 536.8, 593.1, 689.1, 760.0],
    "b": (2.3894212918e02, 5.5015643181e-04),
    "sd": (2.7070075241e00, 7.2668688436e-06),
}


def test_certified_exponential() -> None:
    """The certified curve passes through the origin: a value 0 there with a very small u makes A = −B = b1, T = 1/b2.

    The other u are larger than the scatter, so that τ² = 0 and Birge's factor scales the covariance to s².
    1e-6 is what the origin's u, 1e-5 of the others', leaves free.
    """
    x, y = [0.0, *MISRA1A["x"]], [0.0, *MISRA1A["y"]]
    course = describe(History.sorted_from(x, y, [2e-6, *[0.2] * 14]), level=1e-4)
    assert course.model == "exponential"
    assert course.changes == ()
    level, amplitude, constant = course.coefficients
    b1, b2 = MISRA1A["b"]
    assert level == pytest.approx(b1, rel=1e-6)
    assert amplitude == pytest.approx(-b1, rel=1e-6)
    assert 1.0 / constant == pytest.approx(b2, rel=1e-6)
    u_level, _, u_constant = np.sqrt(np.diag(course.covariance))
    assert u_level == pytest.approx(MISRA1A["sd"][0], rel=1e-5)
    assert u_constant / constant**2 == pytest.approx(MISRA1A["sd"][1], rel=1e-5)
    assert course.dof == 12
    assert 0.2 * np.sqrt(course.agreement) == pytest.approx(
        1.0187876330e-01, rel=1e-5
    )  # residual standard deviation


def noisy(seed: int, n: int = 30) -> Series:
    rng = np.random.default_rng(seed)
    x = np.sort(rng.uniform(-1.0, 0.0, n))
    x[0], x[-1] = -1.0, 0.0
    u = rng.uniform(0.1, 0.3, n)
    return Series(x, np.exp(-(x + 1.0) / 0.3) + u * rng.normal(size=n), u**2)


def test_gains_and_f_against_plain_fits() -> None:
    data, structure = noisy(1), Structure(breaks=(9,))
    root = 1.0 / np.sqrt(data.known)
    flat = design(data.x, structure, None)

    def squares(*more: np.ndarray) -> float:
        matrix = np.column_stack((flat, *more)) * root[:, None]
        answer = np.linalg.lstsq(matrix, data.y * root, rcond=None)[0]
        return float(np.sum((data.y * root - matrix @ answer) ** 2))

    found = profile(data, flat, 0.0)
    constants = np.geomspace(found.time_constant[0], 3.0, 4000)
    aged = [squares(np.exp(-(data.x + 1.0) / one)) for one in constants]
    assert found.best == pytest.approx(constants[int(np.argmin(aged))], rel=2e-3)  # the comparison's own grid
    none, line, curve = squares(), squares(data.x), min(aged)
    test = slope_test(found.squares, float(found.gain[-1]), found.dof)
    assert (test.f, test.dof) == (pytest.approx((none - line) / (line / 27), rel=1e-9), (1, 27))
    assert test.p_value == pytest.approx(float(stats.f.sf(test.f, 1, 27)), rel=1e-9)
    whole, beyond = ageing_tests(found)
    assert (whole.f, whole.dof) == (pytest.approx((none - curve) / 2 / (curve / 26), rel=1e-6), (2, 26))
    assert (beyond.f, beyond.dof) == (pytest.approx((line - curve) / (curve / 26), rel=1e-6), (1, 26))
    assert beyond.p_value == pytest.approx(float(stats.f.sf(beyond.f, 1, 26)), rel=1e-6)


def test_paths_are_the_fits_of_their_time_constants() -> None:
    """Level, factor and their covariance of each time constant, out of one factorisation, against plain fits."""
    data, flat = noisy(2), design(noisy(2).x, Structure(), None)
    found = profile(data, flat, 0.0)
    root = 1.0 / np.sqrt(data.known)
    for place in (0, 10, len(found.time_constant) - 1):
        constant = found.time_constant[place]
        shape = data.x if constant == LINE else np.exp(-(data.x + 1.0) / constant)
        matrix = np.column_stack((np.ones(len(shape)), shape)) * root[:, None]
        answer = np.linalg.lstsq(matrix, data.y * root, rcond=None)[0]
        spread = np.linalg.inv(matrix.T @ matrix)
        assert found.factor[place] == pytest.approx(answer[1], rel=1e-8)
        assert found.level - found.lean[place] * found.factor[place] == pytest.approx(
            answer[0], rel=1e-8, abs=1e-10
        )
        assert found.length[place] ** -2 == pytest.approx(spread[1, 1], rel=1e-8)


def test_a_trend_by_chance_is_as_rare_as_said() -> None:
    """1000 histories of 24 values without trend: p below 5 % in 5 % for the slope, in no more for ageing.

    Four binomial standard errors of 0.69 % are allowed.
    """
    rng = np.random.default_rng(5)
    x = np.linspace(-1.0, 0.0, 24)
    flat = design(x, Structure(), None)
    low = np.zeros(3)
    for _ in range(1000):
        found = profile(Series(x, rng.normal(size=24), np.ones(24)), flat, 0.0, closely=False)
        tests = (slope_test(found.squares, float(found.gain[-1]), found.dof), *ageing_tests(found))
        low += [one.p_value < 0.05 for one in tests]
    assert abs(low[0] / 1000 - 0.05) < 4 * 0.0069
    assert low[1] / 1000 < 0.05 + 4 * 0.0069
    assert low[1] / 1000 > 0.015  # not a bound that never fires
