import math

import numpy as np
import pytest

from simdevice.ammeter import Ammeter, Channel

RAMP = np.linspace(-3e-6, 3e-6, 10_001)
SILENT = np.zeros_like(RAMP)


def test_an_ideal_channel_shows_the_current() -> None:
    assert np.array_equal(Channel().read(RAMP, SILENT), RAMP)


def test_gain_offset_and_noise_make_the_analogue_value() -> None:
    deviates = np.random.default_rng(1).standard_normal(len(RAMP))
    channel = Channel(gain=1.01, offset=2e-8, noise=5e-9)
    expected = RAMP * 1.01 + 2e-8 + deviates * 5e-9
    # Three roundings of values up to 3e-6.
    np.testing.assert_allclose(channel.read(RAMP, deviates), expected, rtol=0, atol=4 * 2.3e-16 * 3e-6)


def test_quantised_readings_are_whole_steps_at_most_half_a_step_away() -> None:
    step = 7e-9
    readings = Channel(step=step).read(RAMP, SILENT)
    codes = readings / step
    # A code of at most 429 carries a relative rounding of 2 eps: 2e-13.
    np.testing.assert_allclose(codes, np.rint(codes), rtol=0, atol=1e-12)
    assert np.abs(readings - RAMP).max() <= step / 2 * (1 + 1e-9)  # rounding of a tie
    assert (np.diff(readings) >= 0).all()
    # A ramp in steps finer than 7 nA meets every code.
    assert len(np.unique(readings)) == 2 * round(3e-6 / step) + 1


def test_no_reading_is_a_negative_zero() -> None:
    reading = Channel(step=1e-9).read(np.array([-1e-10]), np.zeros(1))
    assert math.copysign(1.0, reading[0]) == 1.0


def test_a_channel_saturates_at_its_limit_on_both_sides() -> None:
    readings = Channel(limit=2e-6).read(RAMP, SILENT)
    inside = np.abs(RAMP) <= 2e-6
    assert np.array_equal(readings[inside], RAMP[inside])
    assert (readings[RAMP > 2e-6] == 2e-6).all()
    assert (readings[RAMP < -2e-6] == -2e-6).all()


@pytest.mark.parametrize(
    ("step", "limit", "largest"),
    [(1e-9, 2e-6, 2000), (3e-7, 1e-6, 3), (1e-7, 3e-7, 3)],  # 3e-7/1e-7 is 2.9999999999999996
)
def test_a_quantised_channel_saturates_at_its_last_whole_step(
    step: float, limit: float, largest: int
) -> None:
    readings = Channel(step=step, limit=limit).read(RAMP, SILENT)
    assert readings.max() == largest * step
    assert readings.min() == -largest * step


def test_noise_does_not_pass_the_limit() -> None:
    deviates = np.random.default_rng(2).standard_normal(1000)
    readings = Channel(step=1e-9, limit=1e-6, noise=1e-7).read(np.full(1000, 1e-6), deviates)
    assert readings.max() == pytest.approx(1e-6, rel=1e-15)
    # Half of the noise is cut off: 500 ± 16 (binomial), here within five of these.
    assert abs(np.count_nonzero(readings == readings.max()) - 500) < 80


@pytest.mark.parametrize(
    "channel",
    [
        Channel(noise=5e-9),
        Channel(gain=1.02, offset=-3e-8, noise=5e-9),
        Channel(step=1e-9, noise=5e-9),  # finer than the noise
        Channel(step=1e-8, noise=5e-9),  # of its size
        Channel(step=4e-8, noise=2e-9),  # far coarser: a bias of up to half a step
        Channel(step=5e-8, limit=1e-6, noise=5e-9),
        Channel(limit=1.01e-6, noise=5e-9),  # half cut off
        Channel(step=1e-8, limit=1.01e-6, noise=5e-9),
        Channel(step=1e-11, limit=1.01e-6, noise=5e-9),
        Channel(limit=9e-7, noise=5e-9),  # wholly saturated
        Channel(step=1e-8, limit=9e-7, noise=5e-9),
    ],
)
def test_moments_are_those_of_the_readings(channel: Channel) -> None:
    current, current_std = 1.0123e-6, 4e-9
    # Independent of the formulas: the readings' distribution over a grid of equally probable
    # cells of ±10 standard deviations, by the rectangle rule.
    z = np.linspace(-10, 10, 2_000_001)
    weights = np.exp(-(z**2) / 2)
    weights /= weights.sum()
    total = np.hypot(channel.gain * current_std, channel.noise)
    alone = Channel(channel.gain, channel.offset, channel.step, channel.limit, float(total))
    readings = alone.read(np.full_like(z, current), z)
    mean = weights @ readings
    std = math.sqrt(weights @ (readings - mean) ** 2)
    got_mean, got_std = channel.moments(current, current_std)
    # A jump of one step falls within a cell of 1e-5·std: the rule errs by less than 1e-5 steps.
    tolerance = 1e-5 * max(float(total), channel.step)
    assert got_mean == pytest.approx(mean, abs=tolerance)
    assert got_std == pytest.approx(std, abs=tolerance)


def test_moments_without_noise_are_the_reading_itself() -> None:
    assert Channel(step=4e-8).moments(1.01e-6, 0.0) == (25 * 4e-8, 0.0)


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"step": -1e-9}, "step and noise"),
        ({"noise": math.nan}, "step and noise"),
        ({"gain": math.inf}, "gain and offset"),
        ({"limit": 0.0}, "limit must be greater"),
        ({"step": 1e-6, "limit": 1e-7}, "limit must be greater"),
    ],
)
def test_impossible_channels_are_refused(values: dict[str, float], words: str) -> None:
    with pytest.raises(ValueError, match=words):
        Channel(**values)


def test_channels_stand_x_first() -> None:
    ammeter = Ammeter(Channel(gain=2.0), Channel(gain=3.0))
    assert [channel.gain for channel in ammeter.channels] == [2.0, 3.0]
