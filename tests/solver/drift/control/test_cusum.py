"""CUSUM against the published tables and against its recursion, with the shift that it dates and sizes."""

import numpy as np
import pytest
from numpy.typing import ArrayLike

from solver.drift.control.baseline import Baseline
from solver.drift.control.cusum import cusum
from solver.drift.control.run_rules import Violation
from solver.drift.history import History
from solver.errors import InputError

HANDBOOK = [324.925, 324.675, 324.725, 324.350, 325.350, 325.225, 324.125, 324.525, 325.225, 324.600,
            324.625, 325.150, 328.325, 327.250, 327.825, 328.500, 326.675, 327.775, 326.875, 328.350]  # fmt: skip
"""NIST/SEMATECH e-Handbook, 6.3.2.3: twenty means; target 325, σ of a mean 1.27/√4 = 0.635."""
HANDBOOK_HIGH = [0.0, 0.0, 0.0, 0.0, 0.03, 0.0, 0.0, 0.0, 0.0, 0.0,
                 0.0, 0.0, 3.01, 4.94, 7.45, 10.63, 11.99, 14.44, 16.00, 19.04]  # fmt: skip
HANDBOOK_LOW = [0.0, 0.01, 0.0, 0.33, 0.0, 0.0, 0.56, 0.72, 0.17, 0.25, 0.31, *[0.0] * 9]
"""Ibid., tabular form with k = 0.3175 and h = 4.1959, in the data's unit; starred from group 14 on."""
MONTGOMERY = [9.45, 7.99, 9.29, 11.66, 12.16, 10.18, 8.04, 11.46, 9.20, 10.34, 9.03, 11.47, 10.51, 9.40, 10.08,
              9.37, 10.62, 10.31, 8.52, 10.84, 10.90, 9.33, 12.29, 11.50, 10.60,
              11.08, 10.38, 11.62, 11.31, 10.52]  # fmt: skip
MONTGOMERY_HIGH = [0, 0, 0, 1.16, 2.82, 2.50, 0.04, 1.00, 0, 0, 0, 0.97, 0.98, 0, 0,
                   0, 0.12, 0, 0, 0.34, 0.74, 0, 1.79, 2.79, 2.89, 3.47, 3.35, 4.47, 5.28, 5.30]  # fmt: skip
"""D. C. Montgomery, Introduction to Statistical Quality Control, 7th ed., tables 9.1 and 9.2: µ₀ = 10, σ = 1."""


def history(values: ArrayLike, u: ArrayLike | None = None) -> History:
    return History.sorted_from(np.arange(len(np.asarray(values))), values, u)


def known(centre: float, sd: float) -> Baseline:
    """A baseline of which nothing is uncertain."""
    return Baseline(centre, sd, 1e9, 10**9, "standard-deviation")


def test_the_handbooks_table() -> None:
    found = cusum(history(HANDBOOK), known(325.0, 0.635), 0.5, 4.1959 / 0.635, "three-sigma")
    # two digits printed, ties (14.445, 19.035) rounded either way
    assert 0.635 * found.up == pytest.approx(HANDBOOK_HIGH, abs=0.00501)
    assert 0.635 * found.down == pytest.approx(HANDBOOK_LOW, abs=0.00501)
    assert np.flatnonzero(found.signals).tolist() == list(range(13, 20))
    assert found.violations == (Violation("cusum", 12, 19, 13, 1),)


def test_montgomerys_example() -> None:
    """9.1: C⁺ is 5.28 at period 29 and not 0 for N⁺ = 7 periods: shifted between 22 and 23, to 11.25."""
    whole = cusum(history(MONTGOMERY), known(10.0, 1.0), 0.5, 5.0, "three-sigma")
    assert np.round(whole.up, 2).tolist() == MONTGOMERY_HIGH
    assert whole.signals.tolist() == [False] * 28 + [True, True]
    [shift] = cusum(history(MONTGOMERY[:29]), known(10.0, 1.0), 0.5, 5.0, "three-sigma").shifts
    assert shift.violation == Violation("cusum", 22, 28, 28, 1)
    assert round(10.0 + shift.size, 2) == 11.25
    assert shift.u == pytest.approx(7**-0.5, rel=1e-6)  # the centre's is 3e-5


@pytest.mark.parametrize("limits", ["prediction", "three-sigma"])
def test_is_its_recursion(limits: str) -> None:
    rng = np.random.default_rng(2)
    u = rng.uniform(0.0, 1.0, 300)
    values = history(rng.normal(0.4, 1.2, 300), u)
    baseline = Baseline(0.1, 0.6, 7.0, 8, "paule-mandel", 0.5)
    found = cusum(values, baseline, 0.4, 3.0, limits)
    up = down = 0.0
    ups, downs = [], []
    for z in baseline.standardised(values.value, u, limits):
        up, down = max(0.0, up + z - 0.4), max(0.0, down - z - 0.4)
        ups.append(up)
        downs.append(down)
    # sums of 300 values differ by their rounding
    assert found.up == pytest.approx(ups, abs=1e-11)
    assert found.down == pytest.approx(downs, abs=1e-11)
    assert found.signals.tolist() == [max(pair) > 3.0 for pair in zip(ups, downs, strict=True)]
    for shift in found.shifts:
        total = ups if shift.violation.side > 0 else downs
        assert total[shift.violation.first - 1] == 0.0
        assert min(total[shift.violation.first : shift.violation.last + 1]) > 0.0
        assert total[shift.violation.raised] > 3.0
        assert max(total[shift.violation.first : shift.violation.raised], default=0.0) <= 3.0


def test_a_shift_down_and_one_up_are_told_apart() -> None:
    values = np.concatenate((np.zeros(10), np.full(10, -2.0), np.full(20, 2.0)))
    first, second = cusum(history(values), known(0.0, 1.0), limits="three-sigma").shifts
    assert (first.violation.first, first.violation.side, second.violation.side) == (10, -1, 1)
    assert (first.violation.raised, second.violation.first, second.violation.raised) == (13, 20, 23)
    assert second.size == pytest.approx(2.0)


def test_the_size_of_a_shift_is_the_weighted_mean() -> None:
    u = np.array([0.1, 3.0, 0.1, 3.0, 0.1, 0.1])
    values = np.array([5.0, 9.0, 5.0, 9.0, 5.0, 5.0])
    baseline = Baseline(0.0, 1.0, 9.0, 10, "paule-mandel", 0.5)
    [shift] = cusum(history(values, u), baseline, limits="three-sigma").shifts
    weight = 1 / (1 + u**2)
    assert shift.size == pytest.approx(np.average(values, weights=weight))
    assert shift.u == pytest.approx((1 / weight.sum() + 1.25 / 10) ** 0.5)


def test_points_not_judged_are_in_no_sum() -> None:
    values = np.array([0.0, 99.0, 2.0, 2.0, -99.0, 2.0, 2.0])
    judged = np.abs(values) < 9
    found = cusum(history(values), known(0.0, 1.0), limits="three-sigma", judged=judged)
    assert np.isnan(found.up[~judged]).all()
    assert found.up[judged].tolist() == [0.0, 1.5, 3.0, 4.5, 6.0]
    assert found.violations == (Violation("cusum", 2, 6, 6, 1),)
    assert found.shifts[0].size == pytest.approx(2.0)
    assert cusum(history([]), known(0.0, 1.0)).shifts == ()


@pytest.mark.parametrize(("allowance", "decision"), [(-0.1, 5.0), (0.5, 0.0), (float("nan"), 5.0)])
def test_settings_out_of_range_are_refused(allowance: float, decision: float) -> None:
    with pytest.raises(InputError, match="allowance of a CUSUM"):
        cusum(history([1.0]), known(0.0, 1.0), allowance, decision)
