import numpy as np
import pytest

from solver.errors import InputError
from solver.signals.resolution import resolution


@pytest.mark.parametrize("noise", [0.1, 0.2, 0.3, 0.4, 0.5])
def test_the_uncertainty_holds_the_bias_of_the_mean(noise):
    """The truth lies anywhere between two steps; noise in units of a step.

    The rms of the errors of 300 means, less what the noise leaves after 20,000 samples, stays below the
    stated uncertainty, and above a fifth of it while the bias counts: the statement is no wild guess
    (near the middle of a step the codes scatter less than σ² + q²/12, so more is stated than is there).
    """
    random = np.random.default_rng(12)
    errors, stated = [], []
    for truth in random.uniform(0.0, 1.0, 300):
        record = np.rint(truth + noise * random.standard_normal(20_000))
        found = resolution(record)
        if found is None:  # One code alone: nothing is known of the step.
            continue
        assert found.step == 1.0
        errors.append(record.mean() - truth)
        stated.append(found.uncertainty)
    biases = np.sqrt(np.mean(np.square(errors)))
    left = np.hypot(noise, 12**-0.5) / 20_000**0.5
    allowed = np.sqrt(np.mean(np.square(stated)))
    assert biases < 1.05 * np.hypot(allowed, left)  # 300 errors know their rms to 4 %.
    if allowed > 5 * left:
        assert biases > allowed / 5


def test_steps_are_found_despite_rounding_of_their_codes(rng):
    """0.1·k is not exact in binary: 0.1·3 and 0.3 differ by 5.6e-17."""
    codes = rng.integers(-5, 6, 5000) * 0.1
    codes[::2] = np.round(codes[::2], 1)
    found = resolution(codes)
    assert found is not None
    assert found.step == pytest.approx(0.1, rel=1e-9)


def test_fine_samples_have_no_steps(rng):
    assert resolution(rng.standard_normal(1000)) is None


def test_one_code_tells_no_step():
    assert resolution(np.full(1000, 0.25)) is None


def test_unusable_samples_are_refused():
    with pytest.raises(InputError):
        resolution([1.0, np.nan])
