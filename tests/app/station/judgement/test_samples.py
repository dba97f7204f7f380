"""What noise alone does not do: rates of false alarms below their derived bounds, and what is found."""

import numpy as np
import pytest
from scipy.stats import binom

from app.station.judgement.samples import at_a_limit, largest_step, longest_run, outlying, scatter, step_of

N = 1000
RECORDS = 400
RATE = 0.05
"""Of false alarms asked for: large, so that a rate can be told from 400 records."""
MOST = int(binom.ppf(0.9999, RECORDS, RATE))
"""Alarms that a rate of 0.05 exceeds once in 10,000 runs; the seeds are fixed anyway."""
STEPS = [0.0, 0.1, 0.5, 0.7, 1.0, 3.0]
"""Steps of the ammeter, in standard deviations of the noise."""


def records(step: float, seed: int, drift: float = 0.0) -> np.ndarray:
    rng = np.random.default_rng(seed)
    centre = rng.uniform(-5.0, 5.0, (RECORDS, 1))
    values = centre + rng.standard_normal((RECORDS, N)) + drift * np.linspace(-0.5, 0.5, N)
    return np.rint(values / step) * step if step else values


@pytest.mark.parametrize("step", STEPS)
@pytest.mark.parametrize(
    "check", [lambda v: outlying(v, RATE).any(), lambda v: longest_run(v, RATE), lambda v: at_a_limit(v, RATE)],
    ids=["spike", "stuck", "limit"],
)  # fmt: skip
def test_good_noise_is_objected_to_no_more_often_than_said(check, step):
    assert sum(bool(check(values)) for values in records(step, seed=1)) <= MOST


@pytest.mark.parametrize("step", [0.0, 0.1, 1.0])
def test_a_creeping_current_is_no_spike_no_stuck_channel_and_no_limit(step):
    for values in records(step, seed=2, drift=10.0)[:100]:
        assert not outlying(values, 1e-6).any()
        assert not longest_run(values, 1e-6)
        assert not at_a_limit(values, 1e-6)


def test_a_quiet_current_creeping_through_coarse_codes_is_not_stuck():
    rng = np.random.default_rng(3)
    for _ in range(100):
        ramp = np.linspace(0.0, rng.uniform(6.0, 12.0), 12000) + rng.uniform()
        assert not longest_run(np.rint(ramp + 0.2 * rng.standard_normal(12000)), 1e-6)


@pytest.mark.parametrize("step", [0.0, 0.1, 1.0])
def test_a_leap_of_ten_standard_deviations_is_found_and_no_other_sample(step):
    """At 1e-6 the limit for 12,000 samples is 6.6 σ/0.93 = 7.1 σ; a step of 1 σ adds about 2 σ."""
    size = 10.0 + 2.0 * step
    rng = np.random.default_rng(4)
    for number in range(50):
        values = rng.standard_normal(12000)
        values[number * 50] += size * rng.choice([-1.0, 1.0])
        if step:
            values = np.rint(values / step) * step
        assert np.flatnonzero(outlying(values, 1e-6)).tolist() == [number * 50]


@pytest.mark.parametrize("length", [60, 600, 6000, 11990])
def test_a_channel_that_repeats_itself_is_found_and_its_length_told(length):
    rng = np.random.default_rng(5)
    for step in (0.01, 0.3, 1.0):
        values = np.rint(rng.standard_normal(12000) / step) * step
        first = int(rng.integers(0, 12000 - length))
        values[first : first + length] = values[first]
        found = longest_run(values, 1e-6)
        assert length <= found <= length + 10  # neighbours may be equal by chance


def test_a_channel_of_one_value_is_stuck():
    assert longest_run(np.full(500, 0.3), 1e-6) == 500


@pytest.mark.parametrize("limit", [3.0, 2.0, 1.0, 0.0, -1.0])
def test_noise_cut_by_a_limit_is_found_from_a_thousandth_of_the_samples_on(limit):
    """At 3 σ sixteen samples of 12,000 are cut, where 26 are needed: not found yet. At 2 σ there are 270."""
    rng = np.random.default_rng(6)
    for sign in (1.0, -1.0):
        values = sign * np.minimum(np.rint(rng.standard_normal(12000) / 0.01) * 0.01, limit)
        cut = int(np.sum(values == sign * limit))
        assert at_a_limit(values, 1e-6) == (cut if cut >= 26 else 0)


def test_leaps_are_no_limit():
    rng = np.random.default_rng(7)
    values = np.rint(0.3 * rng.standard_normal(12000))
    values[100:110] = np.arange(50.0, 60.0)
    assert at_a_limit(values, 1e-6) == 0


def test_scatter_is_that_of_the_noise_whatever_step_and_drift():
    rng = np.random.default_rng(8)
    for step in (0.0, 0.1, 1.0, 1.5):
        values = rng.standard_normal(12000) + np.linspace(0.0, 30.0, 12000)
        if step:
            values = np.rint(values / step) * step
        # s is off by 1/√(2n) = 0.65 %; five of these.
        assert scatter(values) == pytest.approx(1.0, rel=0.033)


def test_the_step_is_that_of_the_codes():
    rng = np.random.default_rng(9)
    assert step_of(np.rint(rng.standard_normal(5000) / 0.25) * 0.25) == pytest.approx(
        0.25, rel=1e-9
    )  # rounding
    assert step_of(rng.standard_normal(5000)) == 0.0


def test_time_steps_that_only_round_leave_no_room():
    steps = np.diff(np.arange(12000) / 200.0)
    assert largest_step(steps, 1e-6) < 1e-12  # binary rounding of tens of seconds is below 1e-14
