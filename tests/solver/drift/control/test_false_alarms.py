"""Stated rates of false alarms: exact where Student knows them, else against simulated baselines and what follows."""

from collections.abc import Callable

import numpy as np
import pytest
from scipy import special, stats

from solver.drift.control.baseline import Baseline, Limits, freeze, moving_range_dof
from solver.drift.control.charts import individuals
from solver.drift.control.cusum import cusum
from solver.drift.control.false_alarms import expected
from solver.drift.control.run_rules import NELSON, WESTERN_ELECTRIC
from solver.drift.history import History
from solver.errors import InputError

OUTSIDE = 2 * stats.norm.sf(3)
Step = Callable[[np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray]]


def of_values(n: int) -> Baseline:
    return Baseline(0.0, 1.0, n - 1.0, n, "standard-deviation")


def standardised(rng: np.random.Generator, n: int, limits: Limits, runs: int) -> Callable[[], np.ndarray]:
    """Values in control, one for each of so many baselines of n, standardised: Student written out."""
    chosen = rng.normal(size=(runs, n))
    centre, scatter = chosen.mean(axis=1), chosen.std(axis=1, ddof=1)

    def draw() -> np.ndarray:
        apart = (rng.normal(size=runs) - centre) / scatter
        if limits == "three-sigma":
            return apart
        tail = special.stdtr(n - 1, -np.abs(apart) / (1 + 1 / n) ** 0.5)
        return np.asarray(-np.sign(apart) * special.ndtri(tail))

    return draw


def simulated(draw: Callable[[], np.ndarray], runs: int, steps: int, alarm: Step) -> tuple[float, float]:
    """Alarms per value when every chart begins anew after each, and its standard error, from baseline to baseline."""
    alarms, memory = np.zeros(runs), np.zeros((8, runs))
    for _ in range(steps):
        rang, memory = alarm(memory, draw())
        memory[:, rang] = 0.0
        alarms += rang
    return float(alarms.mean() / steps), float(alarms.std() / steps / runs**0.5)


def summing(memory: np.ndarray, z: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """CUSUM, k = 0.5 and h = 5."""
    memory[0] = np.maximum(memory[0] + z - 0.5, 0.0)
    memory[1] = np.maximum(memory[1] - z - 0.5, 0.0)
    return memory[:2].max(axis=0) > 5.0, memory


def zoning(memory: np.ndarray, z: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Western Electric's rules; the last eight values, 0 for none yet."""
    memory = np.vstack((memory[1:], z))
    rang = np.abs(z) > 3.0
    for side in (1.0, -1.0):
        seen = side * memory
        rang |= (seen > 0.0).all(axis=0)
        rang |= ((seen[-3:] > 2.0).sum(axis=0) >= 2) | ((seen[-5:] > 1.0).sum(axis=0) >= 4)
    return rang, memory


@pytest.mark.parametrize("n", [3, 6, 25])
def test_single_values_outside_prediction_limits_are_one_in_370(n: int) -> None:
    for baseline in (of_values(n), Baseline(0.0, 1.0, moving_range_dof(n), n, "moving-range")):
        # dof to a quarter: both Student's factor and the scatter's distribution follow it
        assert expected(baseline, rules=["nelson-1"]).rate == pytest.approx(OUTSIDE, rel=1e-3)


@pytest.mark.parametrize("n", [3, 6, 25])
def test_single_values_outside_three_sigma_limits_are_students(n: int) -> None:
    found = expected(of_values(n), "three-sigma", rules=["nelson-1"]).individuals
    assert found == pytest.approx(2 * stats.t.sf(3 / (1 + 1 / n) ** 0.5, n - 1), rel=1e-6)


@pytest.mark.parametrize(("n", "limits"), [(6, "prediction"), (6, "three-sigma"), (20, "prediction")])
def test_of_estimated_baselines(n: int, limits: Limits) -> None:
    """Within four standard errors of 1200 baselines with 300 values each, and 2 % for where the last run was cut."""
    runs, steps = 1200, 300
    draw = standardised(np.random.default_rng([14, n]), n, limits, runs)
    for alarm, stated in (
        (summing, expected(of_values(n), limits, cusum=(0.5, 5.0)).cusum),
        (zoning, expected(of_values(n), limits, rules=WESTERN_ELECTRIC).individuals),
    ):
        rate, u = simulated(draw, runs, steps, alarm)
        assert rate == pytest.approx(stated, abs=4 * u, rel=0.02)


@pytest.mark.parametrize("limits", ["prediction", "three-sigma"])
def test_an_average_with_an_estimated_baseline(limits: Limits) -> None:
    """As above, λ = 0.3 and L = 2.5 with the exact limits since each fresh start; six values."""
    rng, runs, steps, n = np.random.default_rng(15), 2000, 400, 6
    chosen = rng.normal(size=(runs, n))
    centre, scatter = chosen.mean(axis=1), chosen.std(axis=1, ddof=1)
    average, since, alarms = np.zeros(runs), np.zeros(runs), np.zeros(runs)
    factor = 2.5 if limits == "three-sigma" else stats.t.ppf(stats.norm.cdf(2.5), n - 1)
    for _ in range(steps):
        average, since = 0.7 * average + 0.3 * (rng.normal(size=runs) - centre), since + 1
        variance = 0.3 / 1.7 * (1 - 0.49**since) + (limits == "prediction") * (1 - 0.7**since) ** 2 / n
        rang = np.abs(average) > factor * scatter * variance**0.5
        average[rang] = since[rang] = 0.0
        alarms += rang
    stated = expected(of_values(n), limits, ewma=(0.3, 2.5)).ewma
    assert alarms.mean() / steps == pytest.approx(stated, abs=4 * alarms.std() / steps / runs**0.5, rel=0.02)


def test_with_known_parameters() -> None:
    """The published ARLs (see the tests of run lengths): 91.75, 465, and nearly 500 for an EWMA of 0.1 and 2.814."""
    found = expected(None, rules=WESTERN_ELECTRIC, ewma=(0.1, 2.814), cusum=(0.5, 5.0))
    assert round(1 / found.individuals, 2) == 91.75
    assert round(1 / found.cusum) == 465
    # Exact limits are narrower at first than those of the table
    assert 480 < 1 / found.ewma < 500
    assert found.values_between == pytest.approx(1 / (found.individuals + found.ewma + found.cusum))
    many = expected(
        of_values(100_000), "three-sigma", rules=WESTERN_ELECTRIC, ewma=(0.1, 2.814), cusum=(0.5, 5.0)
    )
    assert many.rate == pytest.approx(found.rate, rel=2e-3)


def test_all_of_nelsons_rules_stay_within_the_rate() -> None:
    """The rates of zones and of orders added: the simulated rate of both is at most that, and nearly so."""
    rng, runs, alarms = np.random.default_rng(16), 40, 0
    stated = expected(None, rules=NELSON).rate
    for _ in range(runs):
        values = History.sorted_from(np.arange(2000), rng.normal(size=2000))
        found = individuals(
            values, Baseline(0.0, 1.0, 1e9, 10**9, "standard-deviation"), "three-sigma", NELSON
        )
        # begun anew after each alarm: only violations that lie wholly after the last one count
        last = -1
        for item in found.violations:
            if item.first > last:
                alarms, last = alarms + 1, item.raised
    rate = alarms / (runs * 2000)
    assert rate < stated + 4 * (stated / (runs * 2000)) ** 0.5
    assert rate > 0.8 * stated


def test_a_cusum_of_values_with_uncertainties_stays_within_the_rate() -> None:
    """Baselines of ten values whose u differ by a factor of four: at most as stated, by four standard errors."""
    rng, runs, steps = np.random.default_rng(17), 60, 400
    alarms = np.zeros(runs)
    stated = expected(of_values(10), cusum=(0.5, 5.0)).rate
    for run in range(runs):
        u = rng.choice([0.3, 1.2], 10 + steps)
        values = History.sorted_from(np.arange(10 + steps), rng.normal(size=10 + steps) * np.hypot(0.8, u), u)
        baseline = freeze(values[:10], "paule-mandel")
        alarms[run] = len(cusum(values[10:], baseline).violations)
    assert alarms.mean() / steps < stated + 4 * alarms.std() / steps / runs**0.5


def test_nothing_chosen_alarms_never() -> None:
    assert expected(of_values(6)).values_between == float("inf")


def test_what_cannot_be_is_refused() -> None:
    with pytest.raises(InputError, match="no run rule called nelson-9"):
        expected(None, rules=["nelson-9"])
    for ewma, cusum_ in (((0.0, 3.0), None), ((0.2, -1.0), None), (None, (0.5, 0.0)), (None, (-1.0, 4.0))):
        with pytest.raises(InputError, match="An EWMA has a weight"):
            expected(None, ewma=ewma, cusum=cusum_)
