"""Rest told from drift by the slope's own uncertainty."""

import numpy as np
import pytest
from scipy.stats import binom, linregress

from app.station.judgement.settling import RestRule, RestWatch, slopes

NA_PER_MA = 1e6
RULE = RestRule(window_s=2.0, limit_na_per_s=100.0, confidence=0.99)


def fed(
    rule: RestRule, current_na, *, noise_na: float, every_s: float = 0.1, until_s: float = 60.0, seed: int = 0
):
    """When the watch says that both channels rest, s, or None; x follows `current_na`, y only scatters."""
    rng = np.random.default_rng(seed)
    watch = RestWatch(rule)
    for t_s in np.arange(0.0, until_s, every_s).tolist():
        x, y = rng.normal([current_na(t_s), 0.0], noise_na) / NA_PER_MA
        if watch.add(t_s, x, y).settled:
            return t_s
    return None


def test_slope_and_its_uncertainty_are_those_of_scipy():
    rng = np.random.default_rng(1)
    t = np.sort(rng.uniform(0.0, 5.0, 30))
    currents = 3e-3 + np.outer(t, [2e-5, -4e-5]) + 1e-5 * rng.standard_normal((30, 2))
    for found, current in zip(slopes(t, currents), currents.T, strict=True):
        peer = linregress(t, current)
        # Two ways of summing thirty numbers of four digits in common.
        assert found.value == pytest.approx(peer.slope, rel=1e-10)
        assert found.u == pytest.approx(peer.stderr, rel=1e-10)
        assert found.dof == 28


def test_nothing_is_said_before_the_window_is_full_and_ten_readings_are_there():
    watch = RestWatch(RULE)
    said = [watch.add(0.1 * number, 1.0, 1.0) for number in range(25)]
    assert [rest.settled for rest in said[:20]] == [None] * 20
    assert said[20].settled
    sparse = RestWatch(RULE)
    said = [sparse.add(2.0 * number, 1.0, 1.0) for number in range(10)]
    assert [rest.settled for rest in said] == [None] * 9 + [True]


@pytest.mark.parametrize("every_s", [0.02, 0.1, 0.5, 2.0])
@pytest.mark.parametrize("noise_na", [0.0, 5.0, 28.0, 190.0])
def test_a_current_at_rest_settles_however_noisy_and_however_often_read(noise_na, every_s):
    assert fed(RULE, lambda t: 3000.0, noise_na=noise_na, every_s=every_s) is not None


@pytest.mark.parametrize("noise_na", [0.0, 28.0, 190.0])
def test_a_transient_is_waited_for(noise_na):
    """5 µA that decay with 1 s have a slope of 100 nA/s after ln(5000/100) = 3.9 s; the window lies behind that."""
    settled_s = fed(RULE, lambda t: 5000.0 * np.exp(-t), noise_na=noise_na, seed=2)
    assert settled_s is not None
    assert settled_s > 3.9


def test_a_step_within_the_window_is_no_rest():
    """The last k of n readings, h apart, higher by H: b = 6·H·k·(n − k)/(h·n·(n² − 1)), by the sums of the line."""
    watch = RestWatch(RULE)
    for number in range(60):
        watch.add(0.1 * number, 0.0, 0.0)
    said = [watch.add(6.0 + 0.1 * number, 0.0, 1e-3) for number in range(30)]
    assert said[10].settled is False
    # Twenty-one readings; their times are sums of tenths, which double precision rounds.
    assert said[10].y.value == pytest.approx(6e-3 * 11 * 10 / (0.1 * 21 * 440), rel=1e-9)
    assert said[-1].settled


def test_a_drift_above_the_limit_does_not_settle():
    """At twice the limit, in ten runs of 300 looks each: what noise hides is waited for, not believed."""
    for seed in range(10):
        assert fed(RULE, lambda t: 200.0 * t, noise_na=28.0, until_s=30.0, seed=seed) is None


def test_a_drift_at_the_limit_is_believed_to_be_rest_in_one_look_of_a_hundred():
    """The chance that the rule names; 24 of 1000 looks would exceed it once in 10,000 runs."""
    rng = np.random.default_rng(11)
    believed = 0
    t_s = np.linspace(0.0, 2.0, 21).tolist()
    for _ in range(1000):
        watch = RestWatch(RULE)
        for t, noise in zip(t_s, rng.normal(0.0, 28.0, 21).tolist(), strict=True):
            watch.add(t, (100.0 * t + noise) / NA_PER_MA, 0.0)
        believed += watch.judged().settled is True
    assert believed <= binom.ppf(0.9999, 1000, 0.01)


def test_the_watch_tells_which_channel_drifts():
    watch = RestWatch(RULE)
    for number in range(40):
        rest = watch.add(0.1 * number, 0.0, 5e-4 * 0.1 * number)
    assert rest.settled is False
    assert rest.x.value == 0.0
    assert rest.y.value == pytest.approx(5e-4, rel=1e-9)  # a straight line, but for rounding


def test_what_was_before_a_move_is_forgotten():
    watch = RestWatch(RULE)
    for number in range(30):
        watch.add(0.1 * number, 0.0, 0.0)
    assert watch.judged().settled
    watch.clear()
    assert watch.judged().settled is None
    assert watch.add(3.1, 5.0, 5.0).settled is None


def test_a_watch_of_hours_keeps_only_what_its_windows_reach():
    watch = RestWatch(RestRule(window_s=2.0, limit_na_per_s=1e-6))
    for number in range(4000):
        rest = watch.add(0.1 * number, float(number % 7), 0.0)
    assert rest.settled is None or not rest.settled
    assert (
        watch._rows.nbytes <= 2 * 3 * 8 * 1024
    )  # 80 s of readings ten times a second are 800, in powers of two


def test_a_warm_up_is_waited_for_until_little_is_left():
    """A GVK-6: 145 nA too much, 600 s. At 0.01 nA/s, ln(24) time constants, 6 nA are left; the windows lie behind."""
    rule = RestRule(window_s=600.0, limit_na_per_s=0.01, confidence=0.99)
    for seed in range(3):
        warm_s = fed(
            rule, lambda t: 145.0 * np.exp(-t / 600.0), noise_na=28.0, every_s=2.0, until_s=14400.0, seed=seed
        )
        assert warm_s is not None
        assert 145.0 * np.exp(-warm_s / 600.0) < 6.0
