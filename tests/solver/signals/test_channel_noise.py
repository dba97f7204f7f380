import numpy as np
import pytest

from solver.signals.channel_noise import channel_noise
from solver.signals.noise import mean_with_uncertainty

INTERVAL_S = 0.005


def codes(record: np.ndarray) -> list[str]:
    return [item.code for item in channel_noise(record, INTERVAL_S).findings]


def test_a_good_record_is_called_steady(rng):
    record = rng.standard_normal(12_000)
    found = channel_noise(record, INTERVAL_S)
    assert [item.code for item in found.findings] == ["steady"]
    assert found.mean == mean_with_uncertainty(record)
    assert found.by_batches.value == found.by_correlation.value == found.mean.value
    assert found.coefficients.angle_random_walk.seen
    # n lags of white noise, two standard deviations of 1/√n.
    assert found.correlogram.chance == pytest.approx(2 / 12_000**0.5, rel=1e-12)
    assert np.mean(np.abs(found.correlogram.value[1:]) < found.correlogram.chance) > 0.8
    assert found.correlogram.lag[1] == INTERVAL_S
    assert found.allan.duration == pytest.approx(60.0, rel=1e-12)


def test_a_stuck_channel_is_named():
    found = channel_noise(np.full(12_000, 1e-6), INTERVAL_S)
    assert [item.code for item in found.findings] == ["constant-channel"]
    assert (found.allan, found.coefficients, found.correlogram, found.stationarity) == (None,) * 4
    assert found.mean.dof == 0.0


def test_drift_is_named_and_taken_for_no_walk(rng):
    record = rng.standard_normal(12_000) + np.linspace(0.0, 0.5, 12_000)
    found = channel_noise(record, INTERVAL_S)
    assert found.findings[0].code == "slope"
    assert not found.coefficients.rate_random_walk.seen


def test_coarse_steps_are_named(rng):
    """Steps of four standard deviations: their error is not in the scatter."""
    assert "coarse-resolution" in codes(4.0 * np.rint(0.3 + rng.standard_normal(12_000) / 4.0))


def test_fine_steps_are_not(rng):
    assert codes(np.rint(10.0 * rng.standard_normal(12_000))) == ["steady"]


@pytest.mark.parametrize("samples", [2, 3, 63, 127, 255])
def test_short_records_say_what_they_can(rng, samples):
    found = channel_noise(rng.standard_normal(samples), INTERVAL_S)
    assert found.samples == samples
    assert found.findings
    assert (found.stationarity is None) == (samples < 128)
    assert found.coefficients is None


def test_a_lonely_tone_is_not_the_model():
    """A sine of 7 Hz with next to no noise."""
    record = np.sin(2 * np.pi * 0.3 * np.arange(12_000) * INTERVAL_S) + 1e-9 * np.arange(12_000) % 1e-8
    assert "noise-not-modelled" in codes(record)
