import numpy as np
import pytest
from scipy import signal

from solver.errors import InputError
from solver.noise import mean_with_uncertainty


def coverage(records: np.ndarray) -> float:
    """Root mean square of (mean − truth)/u over records of a process with mean zero."""
    results = [mean_with_uncertainty(record) for record in records]
    return float(np.sqrt(np.mean([(item.value / item.standard_uncertainty) ** 2 for item in results])))


def test_white_noise_gives_s_over_root_n(rng):
    record = rng.standard_normal(12_000) + 5.0
    mean, u = mean_with_uncertainty(record)
    assert mean == record.mean()
    # 109 batches give u within 1/√(2·108) = 7 %; four of those.
    assert u == pytest.approx(1 / np.sqrt(12_000), rel=0.28)


def test_u_is_true_for_autocorrelated_samples(rng):
    """A first-order process with a correlation of 10 samples (50 ms at 200 Hz).

    s/√n would be too small by √((1 + φ)/(1 − φ)) = 4.5. Batches of 109 samples miss 2φ/((1 − φ²)·109)
    = 9 % of the variance, 5 % of u; 400 records scatter by 1/√800 = 3.5 %, four of those.
    """
    phi = np.exp(-1 / 10)
    records = signal.lfilter([1], [1, -phi], rng.standard_normal((400, 14_000)), axis=1)[:, 2_000:]
    assert 1.05 - 0.14 < coverage(records) < 1.05 + 0.14


def test_few_samples_are_taken_as_independent(rng):
    record = rng.standard_normal(30)
    mean, u = mean_with_uncertainty(record)
    assert u == pytest.approx(np.std(record, ddof=1) / np.sqrt(30), rel=1e-12)
    assert mean == record.mean()


def test_a_constant_record_has_no_scatter():
    assert mean_with_uncertainty(np.full(100, 0.25)) == (0.25, 0.0)


def test_a_large_offset_does_not_drown_the_scatter(rng):
    record = rng.standard_normal(12_000) * 1e-9
    offset = mean_with_uncertainty(record + 1e-3)
    # Samples of 1e-3 are rounded to 1e-19, 1e-10 of the noise.
    assert offset.standard_uncertainty == pytest.approx(
        mean_with_uncertainty(record).standard_uncertainty, rel=1e-6
    )


@pytest.mark.parametrize("samples", [[], [1.0], [[1.0, 2.0]], [1.0, np.nan, 2.0], [1.0, np.inf]])
def test_unusable_samples_are_refused(samples):
    with pytest.raises(InputError):
        mean_with_uncertainty(samples)
