"""Coefficients of noise that is made without the spectrum: sums, differences, a recursion."""

import numpy as np
import pytest
from scipy import signal

from solver.errors import InputError
from solver.signals.allan import allan
from solver.signals.noise_coefficients import NAMES, allan_variance, noise_coefficients

INTERVAL_S = 0.005
SAMPLES = 12_000


def flicker(random: np.random.Generator, samples: int) -> np.ndarray:
    """Spectrum 1/(2πf) by N. J. Kasdin's recursion, Proc. IEEE 83 (1995), 802; settled."""
    k = np.arange(1, 3 * samples)
    weights = np.cumprod(np.concatenate(([1.0], (k - 0.5) / k)))
    shocks = random.standard_normal(3 * samples)
    return signal.fftconvolve(shocks, weights)[2 * samples : 3 * samples]


def record(
    random: np.random.Generator, q: float, n: float, b: float, k: float, samples: int = SAMPLES
) -> np.ndarray:
    """Samples with Q, N, B, K of IEEE Std 952-1997, annex C."""
    white, walk, error = (random.standard_normal(samples + 1) for _ in range(3))
    made = n / INTERVAL_S**0.5 * white[1:] + k * INTERVAL_S**0.5 * np.cumsum(walk[1:])
    made += q / INTERVAL_S * np.diff(error)
    return made + b * flicker(random, samples) if b else made


def test_intervals_hold_when_everything_is_seen():
    """80 records: a share of 95 % is known within 2.4 %; three of those, and 2 % for the approximation."""
    truth = (0.01, 0.1, 0.3, 0.3)
    random = np.random.default_rng(952)
    found = [noise_coefficients(record(random, *truth), INTERVAL_S) for _ in range(80)]
    for name, value in zip(NAMES, truth, strict=True):
        all_of_it = [getattr(item, name) for item in found]
        assert np.mean([item.low <= value <= item.high for item in all_of_it]) > 0.95 - 0.093, name
        errors = [(item.value - value) / item.standard_uncertainty for item in all_of_it if item.seen]
        # Normalised errors: mean 0 ± 0.11, scatter 1 ± 0.08, four of those.
        assert abs(np.mean(errors)) < 0.45, name
        assert np.std(errors) == pytest.approx(1.0, abs=0.32), name


def test_what_is_not_there_is_not_seen_and_limited():
    """White noise alone, 50 records: false findings 1 % each, at most 4 of 50 (p = 2e-4 for more)."""
    random = np.random.default_rng(953)
    found = [noise_coefficients(record(random, 0, 1.0, 0, 0), INTERVAL_S) for _ in range(50)]
    for name in ("quantisation", "bias_instability", "rate_random_walk"):
        assert sum(getattr(item, name).seen for item in found) <= 4, name
        assert all(getattr(item, name).high > 0 for item in found), name
    inside = [item.angle_random_walk.low <= 1.0 <= item.angle_random_walk.high for item in found]
    assert np.mean(inside) > 0.95 - 0.113  # Three binomial deviations of 3.1 % and 2 %.


def test_limits_hold_for_what_is_too_small_to_be_seen():
    """A walk that 60 s hardly show: interval or limit hold in 95 % of 40 records, less 3 × 3.4 % and 2 %."""
    random = np.random.default_rng(954)
    found = [
        noise_coefficients(record(random, 0, 1.0, 0, 0.3), INTERVAL_S).rate_random_walk for _ in range(80)
    ]
    assert np.mean([item.low <= 0.3 <= item.high for item in found]) > 0.95 - 0.093
    assert np.mean([item.seen for item in found]) < 0.5


def test_the_model_is_that_of_the_allan_deviation(rng):
    """The found coefficients give the Allan deviations, which know nothing of cosines."""
    samples = record(rng, 0.01, 0.1, 0.3, 0.3)
    found = noise_coefficients(samples, INTERVAL_S)
    squares = np.array([(getattr(found, name).value or 0.0) ** 2 for name in NAMES])
    curve = allan(samples, INTERVAL_S)
    model = np.sqrt(allan_variance(squares, curve.tau))
    good = curve.edf > 5
    # Both come from the same samples: closer to each other than to the truth, so inside nearly always.
    assert np.mean((curve.low < model)[good] & (model < curve.high)[good]) >= 0.8
    assert model[good] == pytest.approx(curve.deviation[good], rel=0.25)


def test_fast_noise_that_a_filter_cuts_off_is_left_out():
    """White noise through a lag of 20 ms: a corner at 8 Hz. N is that of the slow part, known within 4 %."""
    random = np.random.default_rng(955)
    phi = np.exp(-INTERVAL_S / 0.02)
    white = record(random, 0, 1.0, 0, 0, SAMPLES + 1000)
    found = noise_coefficients(signal.lfilter([1 - phi], [1, -phi], white)[1000:], INTERVAL_S)
    assert found.highest_frequency < 8.0
    assert found.fits
    assert found.angle_random_walk.value == pytest.approx(1.0, abs=0.2)


def test_a_drift_is_no_random_walk():
    """A drift of 30 u of the mean from end to end."""
    random = np.random.default_rng(956)
    samples = record(random, 0, 1.0, 0, 0) + 4.0 * np.linspace(0.0, 1.0, SAMPLES)
    seen = noise_coefficients(samples, INTERVAL_S)
    assert seen.rate_random_walk.seen or seen.bias_instability.seen
    free = noise_coefficients(samples, INTERVAL_S, without_drift=True)
    assert not free.rate_random_walk.seen
    assert not free.bias_instability.seen
    without = noise_coefficients(
        samples - 4.0 * np.linspace(0.0, 1.0, SAMPLES), INTERVAL_S, without_drift=True
    )
    # The cosines that are left see next to nothing of a line: to 1e-6 of its power.
    assert free.angle_random_walk.value == pytest.approx(without.angle_random_walk.value, rel=1e-4)


def test_the_unit_of_time_is_respected(rng):
    """Sampled half as often, the same numbers have N √2, B 1, K 1/√2 times as large."""
    samples = record(rng, 0.0, 0.1, 0.3, 0.3)
    first, second = (noise_coefficients(samples, interval) for interval in (INTERVAL_S, 2 * INTERVAL_S))
    for name, factor in (
        ("angle_random_walk", 2**0.5),
        ("bias_instability", 1.0),
        ("rate_random_walk", 0.5**0.5),
    ):
        # The ends of the intervals are found to 1 % of the likelihood's fall, the values to 1e-3 of it.
        assert getattr(second, name).value == pytest.approx(factor * getattr(first, name).value, rel=1e-3)


def test_constant_samples_have_none():
    assert noise_coefficients(np.full(300, 0.25), INTERVAL_S) is None


@pytest.mark.parametrize(
    "samples",
    [
        np.resize([1.0, -1.0], 400), np.resize([1.0, 1.0, -1.0], 300), np.arange(300.0), np.eye(1, 300, 7)[0],
        np.sin(np.arange(300.0)), 1e100 * np.sin(np.arange(300.0)) + 1.0, np.repeat([0.0, 1.0], 150),
        np.arange(300.0) ** 2,
    ],
)  # fmt: skip
def test_what_is_no_noise_gives_no_nonsense(samples):
    """Numbers or none, no warning: lines, sines, spikes and steps follow no law of noise."""
    for without_drift in (False, True):
        found = noise_coefficients(samples, INTERVAL_S, without_drift=without_drift)
        for name in NAMES:
            item = getattr(found, name)
            assert 0 <= item.low <= item.high < np.inf, name
            assert item.value is None or item.low <= item.value <= item.high, name


@pytest.mark.parametrize("samples", [256, 257, 1021])
def test_any_length_will_do(rng, samples):
    found = noise_coefficients(rng.standard_normal(samples), 1.0)
    # N = 1 for unit samples every second, within five of its own uncertainty, at least 1/√(2·256).
    assert found.angle_random_walk.value == pytest.approx(1.0, abs=5 * 0.045)


@pytest.mark.parametrize(("samples", "interval"), [(np.arange(255.0), 1.0), (np.arange(300.0), 0.0)])
def test_unusable_input_is_refused(samples, interval):
    with pytest.raises(InputError):
        noise_coefficients(samples, interval)
