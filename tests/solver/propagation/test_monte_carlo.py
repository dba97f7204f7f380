import gc
import tracemalloc

import numpy as np
import pytest

from solver.errors import SolverError
from solver.propagation.comparison import compare
from solver.propagation.monte_carlo import PROBABILITIES, numerical_tolerance, run
from solver.propagation.uncertainty import propagate


def normal(rng, count):
    return 10 + 2 * rng.standard_normal((count, 1))


def additive_rectangular(rng, count):
    """JCGM 101, 9.2.3: sum of four rectangular quantities of u = 1."""
    return rng.uniform(-np.sqrt(3), np.sqrt(3), (count, 4)).sum(axis=1, keepdims=True)


def additive_unequal(rng, count):
    """JCGM 101, 9.2.4: the same with one quantity of u = 10."""
    return rng.uniform(-np.sqrt(3), np.sqrt(3), (count, 4)) @ np.array([[1.0], [1], [1], [10]])


def mass(rng, count):
    """JCGM 101, 9.3: calibration of a mass standard, mg; deviation from 100 g."""
    m_rc = rng.normal(100_000.000, 0.050, count)
    added = rng.normal(1.234, 0.020, count)
    air = rng.uniform(1.10, 1.30, count)
    rho_w, rho_r = rng.uniform(7e3, 9e3, count), rng.uniform(7.95e3, 8.05e3, count)
    return ((m_rc + added) * (1 + (air - 1.2) * (1 / rho_w - 1 / rho_r)) - 1e5)[:, None]


def test_numerical_tolerance_of_7_9_2():
    """JCGM 101, 7.9.2, examples: u = 0.00035 g gives δ = ½·10⁻⁵ g with two digits, u = 2 K with one ½ K."""
    assert float(numerical_tolerance(0.00035, 2)) == pytest.approx(0.5e-5)
    assert float(numerical_tolerance(2, 1)) == pytest.approx(0.5)


def test_numerical_tolerance_of_a_value_that_rounds_up():
    assert float(numerical_tolerance(0.0996, 2)) == pytest.approx(0.005)  # 0.10 = 10·10⁻²
    assert float(numerical_tolerance(0.0994, 2)) == pytest.approx(0.0005)  # 0.099


def test_numerical_tolerance_counts_digits_in_the_unit():
    degree = np.pi / 180
    assert float(numerical_tolerance(0.035 * degree, 2, degree)) == pytest.approx(0.0005 * degree)
    assert float(numerical_tolerance(0.0, 2)) == 0


def test_four_rectangular_quantities_of_9_2_3():
    """JCGM 101, table 3: u = 2.00, symmetric and shortest 95 % interval ±3.88."""
    found = run(additive_rectangular, trials=1_000_000, seed=3)
    assert found.standard_uncertainties[0] == pytest.approx(2.00, abs=0.006)  # 4·u/√(2M)
    # 4 standard errors of an end, √(pq/M)/f with f ≈ 0.03, and the table's rounding
    np.testing.assert_allclose(found.symmetric, [[-3.88, 3.88]], atol=0.025)
    np.testing.assert_allclose(np.diff(found.shortest), 7.76, atol=0.03)


def test_one_dominant_rectangular_quantity_of_9_2_4():
    """JCGM 101, table 4: u = 10.1, symmetric 95 % interval ±17.0; the GUM's is ±19.9, and not validated."""
    found = run(additive_unequal, trials=1_000_000, seed=4)
    assert found.standard_uncertainties[0] == pytest.approx(10.15, abs=0.05)
    np.testing.assert_allclose(found.symmetric, [[-17.0, 17.0]], atol=0.05)
    first_order = propagate([1.0, 1, 1, 10], np.eye(4))
    judged = compare(
        found, np.zeros(1), first_order.standard_uncertainties, first_order.expanded(), names=["Y"]
    )
    assert judged.verdict == "disagree"
    assert judged.low[0] == pytest.approx(2.9, abs=0.1)


def test_mass_calibration_of_9_3():
    """JCGM 101, table 6: 1.2341 mg, u = 0.0754 mg, shortest 95 % interval 1.0834 to 1.3825 mg.

    The GUM to first order has u = 0.0539 mg and [1.1285, 1.3395] mg: not validated (9.3.2.4).
    """
    found = run(mass, trials=1_000_000, seed=5)
    assert found.mean[0] == pytest.approx(1.2341, abs=4 * 0.0754e-3 + 5e-5)  # 4 standard errors, rounding
    assert found.standard_uncertainties[0] == pytest.approx(0.0754, abs=3e-4)
    np.testing.assert_allclose(
        found.shortest, [[1.0834, 1.3825]], atol=5e-3
    )  # its ends are vague: length is flat
    judged = compare(
        found, np.array([1.2340]), np.array([0.0539]), np.array([0.10555]), names=["δm"], digits=1
    )
    assert judged.verdict == "disagree"
    assert judged.low[0] == pytest.approx(0.045, abs=0.002)  # table 7: 0.0451 and 0.0430
    assert judged.high[0] == pytest.approx(0.043, abs=0.002)


def test_the_same_seed_gives_the_same_bits():
    one, other = (run(mass, trials=123_456, seed=7) for _ in range(2))
    for name in ("mean", "covariance", "symmetric", "shortest", "quantiles", "errors"):
        assert getattr(one, name).tobytes() == getattr(other, name).tobytes()
    assert run(mass, trials=123_456, seed=8).mean[0] != one.mean[0]


def test_a_block_depends_on_the_seed_and_its_number_alone():
    """A longer run begins with the draws of a shorter, and what a model draws in excess disturbs no other block."""
    seen = {}

    def wasteful(rng, count):
        values = normal(rng, count)
        rng.standard_normal(17)
        seen.setdefault("wasteful", []).append(values)
        return values

    def plain(rng, count):
        values = normal(rng, count)
        seen.setdefault("plain", []).append(values)
        return values

    run(wasteful, trials=50_000, seed=1)
    run(plain, trials=20_000, seed=1)
    np.testing.assert_array_equal(seen["wasteful"][1], seen["plain"][1])
    assert not np.array_equal(seen["plain"][0], seen["plain"][1])


def test_adaptive_run_stops_when_the_digits_are_sure():
    found = run(normal, trials=None, digits=2, seed=1)
    ended = found.adaptive
    assert ended is not None
    assert ended.reached
    assert ended.tolerance[0] == pytest.approx(0.05)  # u = 2.0: 20·10⁻¹
    assert ended.error[0] <= 0.05
    # an end of a block of 10⁴ has √(pq/M)/f·u = 0.0534; twice it over √h is within 0.05 from h ≈ 5 on,
    # ten blocks are the fewest
    assert found.trials == 100_000
    np.testing.assert_allclose(found.symmetric, [[10 - 3.92, 10 + 3.92]], atol=0.05 + 0.05)
    assert run(normal, trials=50_000).adaptive is None


def test_adaptive_run_needs_more_for_a_tighter_tolerance():
    found = run(normal, trials=None, digits=2, seed=1, tighten=5)
    # 2·0.0534/√h ≤ 0.01 from h ≈ 114 on; the standard deviation of h blocks is known to 1/√(2h), 7 %
    assert 80 <= found.trials / 10_000 <= 150
    assert found.adaptive is not None
    assert found.adaptive.tolerance[0] == pytest.approx(0.01)


def test_adaptive_run_gives_up():
    found = run(normal, trials=None, digits=4, most=110_000)
    assert found.trials == 110_000
    assert found.adaptive is not None
    assert not found.adaptive.reached


def test_adaptive_run_of_a_certain_output():
    found = run(lambda rng, count: np.zeros((count, 1)), trials=None)
    assert found.adaptive is not None
    assert found.adaptive.reached
    np.testing.assert_array_equal(found.errors, 0)


def test_errors_of_the_ends_are_what_repeated_runs_show():
    runs = [run(additive_rectangular, trials=20_000, seed=seed) for seed in range(60)]
    observed = np.std([found.symmetric[0] for found in runs], axis=0, ddof=1)
    stated = np.mean([found.errors[0] for found in runs], axis=0)
    # a standard deviation from 60 is known to 1/√(2·59) = 9 %; 3 of it, and 10 % for the density
    np.testing.assert_allclose(observed, stated, rtol=0.37)


@pytest.mark.parametrize("trials", [35_000, None])
def test_progress_rises_to_one(trials):
    told = []
    run(normal, trials=trials, report=told.append)
    assert told == sorted(told)
    assert told[-1] == 1
    assert 0 < told[0] < 1


def test_cancelled_run_leaves_nothing_behind():
    """What `report` raises comes out, and the run's memory is free again."""

    class Cancelled(Exception):
        pass

    calls = []

    def report(fraction):
        if len(calls) == 3:
            raise Cancelled
        calls.append(fraction)

    def cancelled():
        with pytest.raises(Cancelled):
            run(normal, trials=1_000_000, report=report)

    cancelled()
    calls.clear()
    gc.collect()
    tracemalloc.start()
    before = tracemalloc.get_traced_memory()[0]
    cancelled()
    gc.collect()
    left = tracemalloc.get_traced_memory()[0] - before
    tracemalloc.stop()
    assert calls == [0.01, 0.02, 0.03]
    assert left < 100_000  # a histogram alone has 327,680 bytes


def test_memory_does_not_grow_with_the_number_of_draws():
    def peak(trials):
        tracemalloc.start()
        run(normal, trials=trials)
        most = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        return most

    few, many = peak(20_000), peak(1_000_000)
    assert many < few + 200_000  # all draws would need 8,000,000 bytes


def test_a_draw_that_is_not_finite_is_told():
    def model(rng, count):
        values = normal(rng, count)
        values[count // 2] = np.inf
        return values

    with pytest.raises(SolverError) as caught:
        run(model, trials=10_000)
    assert caught.value.message.code == "draw-not-finite"


def test_distribution_function_to_be_drawn():
    found = run(normal, trials=100_000)
    assert found.quantiles.shape == (1, len(PROBABILITIES))
    middle = found.quantiles[0, np.searchsorted(PROBABILITIES, 0.5)]
    assert middle == pytest.approx(10, abs=4 * 2 * 1.2533 / np.sqrt(1e5))  # 4 standard errors of a median


def test_needs_two_trials():
    with pytest.raises(ValueError, match="two trials"):
        run(normal, trials=1)
