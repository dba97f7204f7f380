"""Baselines against their definitions, Student's t, the published moving range, and the rate they promise."""

import numpy as np
import pytest
from numpy.typing import ArrayLike
from scipy import special, stats

from solver.drift.control.baseline import Baseline, Estimator, c4, freeze, moving_range_dof
from solver.drift.control.prediction import Prediction
from solver.drift.history import History
from solver.errors import InputError

OUTSIDE = 2 * stats.norm.sf(3)
"""Rate at which a normal value is beyond 3 standard deviations, 0.27 %."""
FLOW = [49.6, 47.6, 49.9, 51.3, 47.8, 51.2, 52.6, 52.4, 53.6, 52.1]
"""NIST/SEMATECH e-Handbook, 6.3.2.2: flow rate of ten batches."""


def history(values: ArrayLike, u: ArrayLike | None = None) -> History:
    return History.sorted_from(np.arange(len(np.asarray(values))), values, u)


def outside(baseline: Baseline, u: float, sd: float) -> float:
    """Probability that a value in control, N(0, sd²), is outside the prediction limits."""
    half = float(baseline.half_width(u, "prediction"))
    return float(special.ndtr((baseline.centre - half) / sd) + special.ndtr(-(baseline.centre + half) / sd))


def rates(
    rng: np.random.Generator, estimator: Estimator, n: int, tau: float, u: float, runs: int
) -> np.ndarray:
    """Rates outside for as many baselines of values with uncertainties around u, of which the new one has twice it."""
    found = np.empty(runs)
    for run in range(runs):
        own = u * rng.uniform(0.5, 2.0, n)
        baseline = freeze(history(rng.normal(size=n) * np.hypot(tau, own), own), estimator)
        found[run] = outside(baseline, 2.0 * u, float(np.hypot(tau, 2.0 * u)))
    return found


def test_the_handbooks_moving_range() -> None:
    """6.3.2.2: mean 50.81, MR̄ 1.8778, limits 55.8041 and 45.8159."""
    found = freeze(history(FLOW), "moving-range")
    half = float(found.half_width(0.0, "three-sigma"))
    assert round(found.centre, 2) == 50.81
    assert round(found.scatter * 1.128, 4) == 1.8778
    assert (round(found.centre + half, 4), round(found.centre - half, 4)) == (55.8041, 45.8159)


def test_the_standard_deviation_is_the_textbooks() -> None:
    found = freeze(history(FLOW, np.full(10, 9.0)), "standard-deviation")
    assert found == Baseline(np.mean(FLOW), np.std(FLOW, ddof=1), 9.0, 10, "standard-deviation")
    assert found.half_width(9.0, "three-sigma") == pytest.approx(3 * np.std(FLOW, ddof=1))  # u is ignored
    assert found.u_centre == pytest.approx(np.std(FLOW, ddof=1) / 10**0.5)


def test_weights_go_with_the_variance() -> None:
    """The weighted mean, its uncertainty and Q = n − 1, written out."""
    u = np.array([0.1, 0.4, 0.2, 0.3, 0.1, 0.9])
    found = freeze(history([1.0, 2.0, 1.4, 0.2, 0.9, 3.0], u), "paule-mandel")
    values, weight = np.array([1.0, 2.0, 1.4, 0.2, 0.9, 3.0]), 1 / (found.scatter**2 + u**2)
    assert found.centre == pytest.approx(np.average(values, weights=weight), rel=1e-12)
    assert weight @ (values - found.centre) ** 2 == pytest.approx(5.0, rel=1e-9)  # the iteration's agreement
    assert found.u_centre == pytest.approx(weight.sum() ** -0.5, rel=1e-12)
    assert found.half_width(u, "three-sigma") == pytest.approx(3 / weight**0.5, rel=1e-12)


def test_equal_uncertainties_leave_all_degrees_of_freedom() -> None:
    found = freeze(history(FLOW, np.full(10, 0.5)), "paule-mandel")
    assert found.dof == pytest.approx(9.0, rel=1e-12)
    assert (found.scatter, found.u_typical) == pytest.approx(
        ((np.var(FLOW, ddof=1) - 0.25) ** 0.5, 0.5), rel=1e-9
    )


def test_the_variance_of_tau_is_as_the_degrees_of_freedom_say() -> None:
    """2·V²/ν, far from the cut at 0, where it is linear in the values' squares: 5 % bias seen, 4 standard errors."""
    rng, tau, u = np.random.default_rng(4), 1.0, np.tile([0.1, 1.2], 20)
    found = [freeze(history(rng.normal(size=40) * np.hypot(tau, u), u), "paule-mandel") for _ in range(800)]
    tau2 = np.array([item.scatter**2 for item in found])
    weight = 1 / (tau**2 + u**2)
    slope = weight.sum() - (weight**2).sum() / weight.sum()
    assert tau2.var() == pytest.approx(2 * 39 / slope**2, rel=0.05 + 4 * (2 / 800) ** 0.5)
    assert np.mean([item.dof for item in found]) < 39


def test_without_known_uncertainty_limits_are_students() -> None:
    for n in (2, 3, 6, 30):
        limits = Baseline(1.0, 2.0, n - 1.0, n)
        for width in (1.0, 2.0, 3.0):
            expected = 2 * stats.t.ppf(stats.norm.cdf(width), n - 1) * (1 + 1 / n) ** 0.5
            # The sum over χ² is short by its ends, 1e-10, which Student's tail with one degree of freedom feels.
            assert limits.half_width(0.0, "prediction", width) == pytest.approx(
                expected, rel=1e-3 if n == 2 else 1e-6
            )


def test_beyond_three_is_outside_the_limits() -> None:
    """Z of the limits is ±3 with any uncertainty; also where limits are interpolated, to 1e-5 of them."""
    baseline = Baseline(10.0, 0.5, 4.7, 6, "paule-mandel", 0.4)
    for count, precision in ((20, 1e-9), (300, 1e-5)):
        u = np.random.default_rng(1).uniform(0.0, 3.0, count)
        half = baseline.half_width(u, "prediction")
        assert baseline.standardised(10.0 + half, u, "prediction") == pytest.approx(3.0, rel=precision)
        assert baseline.standardised(10.0 - half, u, "prediction") == pytest.approx(-3.0, rel=precision)
    assert baseline.standardised([10.0, 1e9], [0.1, 0.1], "prediction").tolist() == pytest.approx(
        [0.0, 37.0], abs=0.1
    )


def test_a_well_known_baseline_has_the_textbooks_limits() -> None:
    baseline = Baseline(0.0, 0.5, 1e6, 10**6, "paule-mandel", 0.4)
    u = np.array([0.1, 0.4, 2.0])
    # A million values: the centre adds 5e-7 of V, Student's t 3e-6.
    assert baseline.half_width(u, "prediction") == pytest.approx(
        baseline.half_width(u, "three-sigma"), rel=1e-5
    )


@pytest.mark.parametrize("n", [2, 3, 6, 20])
@pytest.mark.parametrize("estimator", ["standard-deviation", "moving-range"])
def test_the_rate_is_as_stated_whatever_the_number_of_values(estimator: Estimator, n: int) -> None:
    """Over 200 000 baselines at once; the limits have the scatter's scale. 2 %: what is said of the moving range."""
    rng, runs = np.random.default_rng([3, n]), 200_000
    values = rng.normal(size=(runs, n))
    dof = n - 1.0 if estimator == "standard-deviation" else moving_range_dof(n)
    factor = float(Baseline(0.0, 1.0, dof, n, estimator).half_width(0.0, "prediction"))
    ranges = np.abs(np.diff(values, axis=1)).mean(axis=1) / 1.128
    half = factor * (values.std(axis=1, ddof=1) if estimator == "standard-deviation" else ranges)
    centre = values.mean(axis=1)
    found = special.ndtr(centre - half) + special.ndtr(-centre - half)
    assert found.mean() == pytest.approx(OUTSIDE, rel=0.02, abs=4 * found.std() / runs**0.5)


@pytest.mark.parametrize(("tau", "u", "n"), [(1.0, 0.3, 6), (0.3, 1.0, 6), (1.0, 1.0, 4), (1.0, 0.5, 20)])
def test_values_with_uncertainties_are_outside_no_oftener(tau: float, u: float, n: int) -> None:
    """At most the stated rate, by four standard errors; at 20 values no less than half of it."""
    found = rates(np.random.default_rng(5), "paule-mandel", n, tau, u, 150)
    assert found.mean() < OUTSIDE + 4 * found.std() / 150**0.5
    if n == 20:
        assert found.mean() > OUTSIDE / 2


def test_textbook_limits_of_few_values_raise_more() -> None:
    """Student again: six values and 3·s give 2·P(t₅ > 3/√(7/6)), fourteen times the stated rate."""
    rng = np.random.default_rng(6)
    found = []
    for _ in range(2000):
        baseline = freeze(history(rng.normal(size=6)), "standard-deviation")
        half = float(baseline.half_width(0.0, "three-sigma"))
        found.append(special.ndtr(baseline.centre - half) + special.ndtr(-baseline.centre - half))
    assert np.mean(found) == pytest.approx(
        2 * stats.t.sf(3 / (7 / 6) ** 0.5, 5), abs=4 * np.std(found) / 2000**0.5
    )


def test_a_value_without_uncertainty_is_taken_for_a_typical_one() -> None:
    baseline = Baseline(0.0, 0.0, 5.0, 6, "paule-mandel", 0.4)
    assert baseline.half_width([0.0, 0.4], "three-sigma") == pytest.approx([1.2, 1.2])
    found = freeze(history([1.0, 1.1, 0.9, 1.05], [0.5, 0.0, 0.5, 0.5]), "paule-mandel")
    assert (found.scatter, found.u_typical) == (0.0, pytest.approx(0.5))


def test_degrees_of_freedom_of_a_moving_range() -> None:
    """One for two values; for many Patnaik's: Var(MR̄)/E² → (0.5708 + 2·0.1278)/n, so 0.605·n (0.8 more as fitted)."""
    assert moving_range_dof(2) == pytest.approx(1.0, rel=1e-9)
    slope = (moving_range_dof(2000) - moving_range_dof(1000)) / 1000
    assert slope == pytest.approx(1 / (2 * (0.5708 + 2 * 0.1278)), rel=1e-3)  # four digits of the constants


def test_the_mean_of_a_standard_deviation() -> None:
    """c₄ as tabled for samples of 2, 5 and 10: 0.7979, 0.9400, 0.9727 (e.g. NIST e-Handbook, 6.3.2.1)."""
    assert [round(c4(n - 1), 4) for n in (2, 5, 10)] == [0.7979, 0.94, 0.9727]


def test_weights_of_a_prediction_are_probabilities() -> None:
    for known in (0.0, 0.1, 1.0):
        found = Prediction.of(1.0, 5.0, known)
        assert found.weight.sum() == pytest.approx(1.0)
        assert (found.weight > 0).all()
        certain = found.weight[found.variance == 0.0].sum()
        assert certain == pytest.approx(stats.chi2.sf(5.0 / known, 5) if known else 0.0, abs=1e-8)


@pytest.mark.parametrize("estimator", ["paule-mandel", "moving-range", "standard-deviation"])
def test_what_makes_no_baseline_is_refused(estimator: Estimator) -> None:
    with pytest.raises(InputError, match="at least two values, not 1"):
        freeze(history([1.0]), estimator)
    with pytest.raises(InputError, match="do not scatter"):
        freeze(history([0.1 + 0.2, 0.3, 0.3]), estimator)


def test_an_unknown_estimator_is_refused() -> None:
    with pytest.raises(InputError, match="no estimator of a baseline called range"):
        freeze(history([1.0, 2.0]), "range")
