"""Charts of individuals and EWMA against the published examples, and against their definitions point by point."""

import numpy as np
import pytest
from numpy.typing import ArrayLike
from scipy import special

from solver.drift.control.baseline import Baseline, freeze
from solver.drift.control.charts import ewma, individuals
from solver.drift.control.run_rules import NELSON, Violation
from solver.drift.history import History
from solver.errors import InputError

FLOW = [49.6, 47.6, 49.9, 51.3, 47.8, 51.2, 52.6, 52.4, 53.6, 52.1]
"""NIST/SEMATECH e-Handbook, 6.3.2.2: flow rate of ten batches."""
EWMA_DATA = [52.0, 47.0, 53.0, 49.3, 50.1, 47.0, 51.0, 50.1, 51.2, 50.5, *FLOW]
EWMA_PRINTED = [50.60, 49.52, 50.56, 50.18, 50.16, 49.21, 49.75, 49.85, 50.26, 50.33,
                50.11, 49.36, 49.52, 50.05, 49.38, 49.92, 50.73, 51.23, 51.94, 51.99]  # fmt: skip
"""NIST/SEMATECH e-Handbook, 6.3.2.4: data and EWMA with λ = 0.3 from EWMA₀ = 50."""
MONTGOMERY = [9.45, 7.99, 9.29, 11.66, 12.16, 10.18, 8.04, 11.46, 9.20, 10.34, 9.03, 11.47, 10.51, 9.40, 10.08,
              9.37, 10.62, 10.31, 8.52, 10.84, 10.90, 9.33, 12.29, 11.50, 10.60,
              11.08, 10.38, 11.62, 11.31, 10.52]  # fmt: skip
"""D. C. Montgomery, Introduction to Statistical Quality Control, 7th ed., table 9.1: µ₀ = 10, σ = 1."""
MONTGOMERY_EWMA = [9.945, 9.7495, 9.70355, 9.8992, 10.1253, 10.1307, 9.92167, 10.0755, 9.98796, 10.0232,
                   9.92384, 10.0785, 10.1216, 10.0495, 10.0525, 9.98426, 10.0478, 10.074, 9.91864, 10.0108,
                   10.0997, 10.0227, 10.2495, 10.3745, 10.3971, 10.4654, 10.4568, 10.5731,
                   10.6468, 10.6341]  # fmt: skip
"""Ibid., table 9.10: EWMA with λ = 0.1; example 9.2 charts it with L = 2.7."""


def history(values: ArrayLike, u: ArrayLike | None = None) -> History:
    return History.sorted_from(np.arange(len(np.asarray(values))), values, u)


def known(centre: float, sd: float) -> Baseline:
    """A baseline of which nothing is uncertain."""
    return Baseline(centre, sd, 1e9, 10**9, "standard-deviation")


def test_the_handbooks_individuals_are_in_control() -> None:
    """6.3.2.2: limits 55.8041, 50.81, 45.8159; moving ranges 2.0 … 1.5 with the mean 1.8778; nothing outside."""
    found = individuals(history(FLOW), freeze(history(FLOW), "moving-range"), "three-sigma")
    assert set(np.round(found.upper, 4)) == {55.8041}
    assert set(np.round(found.lower, 4)) == {45.8159}
    assert np.isnan(found.moving_range[0])
    assert np.round(found.moving_range[1:], 1).tolist() == [2.0, 2.3, 1.4, 3.5, 3.4, 1.4, 0.2, 1.2, 1.5]
    assert round(float(found.mean_range[1]), 4) == 1.8778
    assert found.range_limit[1] == pytest.approx(
        3.267 * 1.8778, abs=2e-4
    )  # D₄ of table 6.3.2.1, and rounding
    assert (found.violations, found.signals.any(), found.ranges_beyond.any()) == ((), False, False)


def test_the_handbooks_ewma() -> None:
    """6.3.2.4: EWMA₀ = 50, s = 2.0539, λ = 0.3: limits 52.5884 and 47.4115 (of 0.4201 for √(0.3/1.7)), in control."""
    found = ewma(history(EWMA_DATA), known(50.0, 2.0539), 0.3, 3.0, "three-sigma", asymptotic=True)
    assert np.round(found.statistic, 2).tolist() == EWMA_PRINTED
    assert found.upper == pytest.approx(np.full(20, 52.5884), abs=6e-5)
    assert found.lower == pytest.approx(np.full(20, 47.4115), abs=1.1e-4)  # it is 47.41157, printed cut off
    assert (found.violations, found.signals.any()) == ((), False)


def test_montgomerys_ewma() -> None:
    """Example 9.2: limits 10.27 and 9.73 at first, 10.36 next, 10.62 and 9.38 in the end; the last two signal."""
    found = ewma(history(MONTGOMERY), known(10.0, 1.0), 0.1, 2.7, "three-sigma")
    assert found.statistic == pytest.approx(MONTGOMERY_EWMA, rel=6e-6)  # six digits printed
    assert (round(found.upper[0], 2), round(found.lower[0], 2), round(found.upper[1], 2)) == (
        10.27,
        9.73,
        10.36,
    )
    assert (round(found.upper[-1], 2), round(found.lower[-1], 2)) == (10.62, 9.38)
    assert found.violations == (Violation("ewma", 28, 29, 28, 1),)
    assert np.flatnonzero(found.signals).tolist() == [28, 29]


def test_a_weight_of_one_is_the_chart_of_individuals() -> None:
    rng = np.random.default_rng(1)
    u = rng.uniform(0.0, 1.0, 40)
    baseline = Baseline(3.0, 0.7, 6.2, 8, "paule-mandel", 0.4)
    values = history(3.0 + 2.0 * rng.normal(size=40), u)
    for limits in ("prediction", "three-sigma"):
        single, average = individuals(values, baseline, limits), ewma(values, baseline, 1.0, 3.0, limits)
        assert average.statistic == pytest.approx(values.value, rel=1e-12)
        assert average.upper == pytest.approx(single.upper, rel=1e-9)
        assert average.signals.tolist() == (np.abs(single.z) > 3.0).tolist()
        assert single.signals.tolist() == average.signals.tolist()


def test_variances_of_an_average_are_sums_over_the_values() -> None:
    """Against the weights λ·(1 − λ)^(i−j) written out, for values of unlike u and an uncertain centre."""
    u, weight, n = np.array([0.1, 2.0, 0.5, 0.0, 1.0]), 0.3, 400
    baseline = Baseline(0.0, 0.8, 1e9, n, "paule-mandel", 0.6)
    weights = np.array([[weight * 0.7 ** (i - j) if j <= i else 0.0 for j in range(5)] for i in range(5)])
    variance = weights**2 @ (0.64 + np.where(u > 0, u, 0.6) ** 2)
    centre = weights.sum(axis=1) ** 2 * (0.64 + 0.36) / n
    values = history(np.zeros(5), u)
    assert ewma(values, baseline, weight, 2.5, "three-sigma").upper == pytest.approx(
        2.5 * variance**0.5, rel=1e-12
    )
    # 1e9 degrees of freedom are as many as infinitely many to 1e-8
    assert ewma(values, baseline, weight, 2.5).upper == pytest.approx(
        2.5 * (variance + centre) ** 0.5, rel=1e-6
    )


def test_limits_are_those_of_the_values_variance() -> None:
    u = np.array([0.1, 1.0, 3.0])
    found = individuals(
        history([0.0, 0.0, 9.4], u), Baseline(0.0, 1.0, 1e9, 10**9, "paule-mandel"), "three-sigma"
    )
    assert found.upper == pytest.approx(3 * (1 + u**2) ** 0.5)
    assert found.violations == ()  # 9.4 would be far beyond the limits of the others
    # E|x₂ − x₁| = √(2/π)·√(V₁ + V₂), and D₄/d₂ of it as for equal ones
    expected = (2 / np.pi * (2 + u[1] ** 2 + u[2] ** 2)) ** 0.5
    assert found.mean_range[2] == pytest.approx(expected, rel=4e-4)  # 1.128 of the tables for 2/√π
    assert found.range_limit[2] == pytest.approx(3.267 * expected, rel=4e-4)


def test_points_not_judged_raise_nothing_and_are_in_no_run_or_average() -> None:
    values = np.array([0.0, 50.0, 0.0, 0.5, 0.5, 0.5, 0.5, 9.0, 0.5, 0.5, 0.5, 0.5, 0.5])
    judged = np.ones(13, bool)
    judged[[1, 7]] = False
    found = individuals(history(values), known(0.0, 1.0), "three-sigma", NELSON, judged)
    assert found.violations == ()
    assert found.z[1] == pytest.approx(50.0)
    # neither a range to a value that is not judged
    assert not found.ranges_beyond.any()
    average = ewma(history(values), known(0.0, 1.0), judged=judged)
    assert np.isnan(average.statistic[[1, 7]]).all()
    without = ewma(history(values[judged]), known(0.0, 1.0))
    assert average.statistic[judged].tolist() == without.statistic.tolist()
    assert average.upper[judged].tolist() == without.upper.tolist()


def test_moving_ranges_signal() -> None:
    found = individuals(history([0.0, 0.1, 4.0, 4.1]), known(0.0, 1.0), "three-sigma")
    assert found.ranges_beyond.tolist() == [False, False, True, False]


def test_nothing_to_judge() -> None:
    empty = history([])
    assert individuals(empty, known(0.0, 1.0)).violations == ()
    assert ewma(empty, known(0.0, 1.0)).violations == ()
    none = ewma(history([1.0, 2.0]), known(0.0, 1.0), judged=np.zeros(2, bool))
    assert (none.violations, none.signals.tolist()) == ((), [False, False])


@pytest.mark.parametrize(("weight", "width"), [(0.0, 3.0), (1.1, 3.0), (0.2, 0.0), (float("nan"), 3.0)])
def test_settings_out_of_range_are_refused(weight: float, width: float) -> None:
    with pytest.raises(InputError, match="weight of an EWMA"):
        ewma(history([1.0]), known(0.0, 1.0), weight, width)


@pytest.mark.parametrize("n", [6, 30])
def test_an_average_is_outside_as_often_as_stated(n: int) -> None:
    """After 12 values in control, of the baseline's own making: P = 0.27 % whatever n, four standard errors."""
    rng, runs, weight = np.random.default_rng([9, n]), 100_000, 0.2
    chosen, after = rng.normal(size=(runs, n)), rng.normal(size=(runs, 12))
    centre, scatter = chosen.mean(axis=1), chosen.std(axis=1, ddof=1)
    unit = ewma(history(np.zeros(12)), Baseline(0.0, 1.0, n - 1.0, n, "standard-deviation"), weight)
    average = (after - centre[:, None]) @ (weight * (1 - weight) ** np.arange(11, -1, -1))
    rate = float(np.mean(np.abs(average) > unit.upper[-1] * scatter))
    stated = 2 * special.ndtr(-3.0)
    assert rate == pytest.approx(stated, abs=4 * (stated / runs) ** 0.5)


def test_false_alarms_of_values_with_uncertainties_stay_within_the_rate() -> None:
    """Three-sigma limits of a long baseline: 0.27 % of 20 000 values, four standard errors and 1 % for the baseline."""
    rng = np.random.default_rng(10)
    u = rng.choice([0.1, 0.5, 2.0], 24_000)
    values = history(rng.normal(5.0, np.hypot(0.7, u)), u)
    baseline = freeze(values[:4000], "paule-mandel")
    found = individuals(values[4000:], baseline, "three-sigma")
    for own in (0.1, 0.5, 2.0):
        z = found.z[values.u[4000:] == own]
        stated = 2 * special.ndtr(-3.0)
        assert np.mean(np.abs(z) > 3.0) == pytest.approx(
            stated, abs=4 * (stated / len(z)) ** 0.5 + 0.1 * stated
        )
