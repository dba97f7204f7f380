"""Units of noise coefficients, by hand, and what is null."""

import numpy as np
import pytest

from app.exchange.noise import noise_document
from solver.signals.channel_noise import channel_noise

AMPERE_NOISE = 1e-8
INTERVAL_S = 0.005


@pytest.fixture(scope="module")
def noisy():
    samples = np.random.default_rng(4).normal(3e-6, AMPERE_NOISE, 12_000)
    return channel_noise(samples, INTERVAL_S)


def test_currents_are_in_milliamperes(noisy):
    document = noise_document(noisy, None)
    assert document["mean_ma"] == pytest.approx(1000 * noisy.mean.value, rel=1e-15)
    assert document["allan"][0]["deviation_ma"] == pytest.approx(1000 * noisy.allan.deviation[0], rel=1e-15)
    assert document["autocorrelation_time_s"] == pytest.approx(60.0 / noisy.mean.n_eff, rel=1e-12)
    walk = document["coefficients"]["angle_random_walk_ma_sqrt_s"]
    assert walk["value"] == pytest.approx(1000 * noisy.coefficients.angle_random_walk.value, rel=1e-12)
    assert document["coefficients"]["angle_random_walk_deg_per_sqrt_h"] is None


def test_rates_are_in_degrees_and_hours(noisy):
    """With 2 °/h/mA: N °/√h is 2·N(mA·√s)/√3600, B °/h is 2·B, K °/h/√h is 2·K·√3600, Q ″ is 2·Q."""
    found = noise_document(noisy, -2.0)["coefficients"]  # The sign is the direction, not a size.
    for current, rate, factor in (
        ("angle_random_walk_ma_sqrt_s", "angle_random_walk_deg_per_sqrt_h", 2.0 / 60.0),
        ("bias_instability_ma", "bias_instability_deg_per_h", 2.0),
        ("rate_random_walk_ma_per_sqrt_s", "rate_random_walk_deg_per_h_per_sqrt_h", 2.0 * 60.0),
        ("quantisation_ma_s", "quantisation_arcsec", 2.0),  # °/h·s = 3600 arcsec/3600.
    ):
        # Four conversions, each exact to 1e-16.
        assert found[rate]["high"] == pytest.approx(factor * found[current]["high"], rel=1e-12)
        assert found[rate]["seen"] == found[current]["seen"]


def test_a_stuck_channel_is_null():
    document = noise_document(channel_noise(np.full(1000, 1e-6), INTERVAL_S), 2.0)
    for name in ("u_ma", "dof", "n_eff", "autocorrelation_time_s", "u_batches_ma", "u_autocorrelation_ma",
                 "slope", "mean_step", "log_variance_ratio", "resolution_ma", "coefficients"):  # fmt: skip
        assert document[name] is None, name
    assert document["allan"] == []
    assert [item.code for item in document["findings"]] == ["constant-channel"]


def test_steps_of_the_ammeter(noisy):
    coarse = np.rint(np.random.default_rng(5).normal(0.3, 0.3, 12_000)) * 1e-6
    document = noise_document(channel_noise(coarse, INTERVAL_S), None)
    assert document["resolution_ma"] == pytest.approx(1e-3, rel=1e-9)
    assert document["u_resolution_ma"] > 0
    assert noise_document(noisy, None)["resolution_ma"] is None
