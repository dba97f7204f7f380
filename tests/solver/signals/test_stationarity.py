"""p-values are uniform when nothing changes, small when something does."""

import numpy as np
import pytest
from scipy import signal

from solver.errors import InputError
from solver.signals.stationarity import UNLIKELY, stationarity

INTERVAL_S = 0.005
SAMPLES = 12_000


def markov(random: np.random.Generator, count: int, time_s: float) -> np.ndarray:
    phi = np.exp(-INTERVAL_S / time_s)
    settled = int(10 * time_s / INTERVAL_S)
    shocks = random.standard_normal((count, SAMPLES + settled)) * np.sqrt(1 - phi**2)
    return signal.lfilter([1], [1, -phi], shocks, axis=1)[:, settled:]


@pytest.mark.parametrize("time_s", [0.0, 0.05, 0.5])
def test_steady_records_are_seldom_suspected(time_s):
    """400 records: 5 % of each p below 0.05 within three binomial deviations of 1.1 % and 1.5 % of bias."""
    random = np.random.default_rng(5)
    records = markov(random, 400, time_s) if time_s else random.standard_normal((400, SAMPLES))
    found = [stationarity(record, INTERVAL_S) for record in records]
    for name in ("slope", "mean_step", "log_variance_ratio"):
        p_values = np.array([getattr(item, name).p_value for item in found])
        assert abs(np.mean(p_values < 0.05) - 0.05) < 0.048, name
        assert np.mean(p_values < 0.5) == pytest.approx(0.5, abs=0.1), name
    # At 1 %, with the same allowance: 4 expected.
    assert sum(item.p_value < UNLIKELY for item in found) <= 16


def test_the_slope_has_an_uncertainty_that_holds():
    """(slope − truth)/u has the rms of Student's t with some 50 dof, 1.02; of 200 known within 5 %."""
    random = np.random.default_rng(6)
    ramp = 0.03 * np.arange(SAMPLES) * INTERVAL_S
    found = [stationarity(record + ramp, INTERVAL_S).slope for record in markov(random, 200, 0.05)]
    errors = np.array([(item.value - 0.03) / item.standard_uncertainty for item in found])
    assert np.sqrt(np.mean(errors**2)) == pytest.approx(1.02, abs=0.16)


def test_the_slope_is_that_of_least_squares(rng):
    record = np.cumsum(rng.standard_normal(1000))
    expected = np.polyfit(np.arange(1000) * 0.1, record, 1)[0]
    # Both are exact to some 1e-12 of the largest term.
    assert stationarity(record, 0.1).slope.value == pytest.approx(expected, rel=1e-9)


def test_a_drift_is_told():
    """A line of 10 u of the mean from end to end: its slope is 10/√12 of its own u, p < 0.01/3."""
    random = np.random.default_rng(7)
    record = random.standard_normal(SAMPLES) + 20 / SAMPLES**0.5 * np.linspace(-0.5, 0.5, SAMPLES)
    found = stationarity(record, INTERVAL_S)
    assert found.finding.code == "slope"
    assert found.slope.value * 60.0 == pytest.approx(20 / SAMPLES**0.5, rel=0.7)


def test_a_step_is_told():
    random = np.random.default_rng(8)
    record = random.standard_normal(SAMPLES)
    record[SAMPLES // 2 :] += 0.2
    found = stationarity(record, INTERVAL_S)
    # 0.2 with an uncertainty of 2/√12000 = 0.018, within four of these.
    assert found.mean_step.value == pytest.approx(0.2, abs=0.073)
    assert found.finding.code == "step"


def test_louder_noise_is_told():
    random = np.random.default_rng(9)
    record = random.standard_normal(SAMPLES)
    record[SAMPLES // 2 :] *= 1.2
    found = stationarity(record, INTERVAL_S)
    # ln 1.44 with an uncertainty of √(4/6000) = 0.026, within four of these.
    assert found.log_variance_ratio.value == pytest.approx(np.log(1.44), abs=0.104)
    assert found.finding.code == "noise-changes"


def test_a_steady_record_says_so(rng):
    assert stationarity(rng.standard_normal(SAMPLES), INTERVAL_S).finding.code == "steady"


def test_a_half_that_does_not_change_tells_nothing(rng):
    assert stationarity(np.concatenate((np.zeros(200), rng.standard_normal(200))), INTERVAL_S) is None


def test_two_codes_of_equal_weight_have_a_variance_without_scatter():
    """+1 and −1 in turn: every square is 1, so nothing can be said of the variance."""
    found = stationarity(np.resize([1.0, -1.0], 400), INTERVAL_S)
    assert found.log_variance_ratio.p_value == 1.0


@pytest.mark.parametrize(("samples", "interval"), [(np.arange(127.0), 1.0), (np.arange(200.0), 0.0)])
def test_unusable_input_is_refused(samples, interval):
    with pytest.raises(InputError):
        stationarity(samples, interval)
