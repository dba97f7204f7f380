import numpy as np
import pytest
from scipy import signal

from solver.signals.autocorrelation import autocorrelation, integrated_time


def test_it_is_the_sum_of_products(rng):
    """The definition, written out."""
    record = rng.standard_normal(50) + 3.0
    centred = record - record.mean()
    expected = [np.sum(centred[: 50 - lag] * centred[lag:]) / np.sum(centred**2) for lag in range(50)]
    # Sums of 50 products are exact to some 1e-15.
    assert np.allclose(autocorrelation(record), expected, rtol=0, atol=1e-13)


@pytest.mark.parametrize(("phi", "expected"), [(0.0, 1.0), (0.5, 3.0), (0.9, 19.0)])
def test_integrated_time_of_a_markov_process(phi, expected):
    """τ = (1 + φ)/(1 − φ); the errors in units of its own uncertainty scatter by about one.

    The mean of 300 is known within 0.06 of these units: four of those, and for what the window leaves
    out of an exponential, e^−5·τ, less than one hundredth. Their scatter is known within 0.04; it is up
    to a fifth smaller, because the window follows the sum and stops early where that is small.
    """
    random = np.random.default_rng(1989)
    records = signal.lfilter([1], [1, -phi], random.standard_normal((300, 21_000)), axis=1)[:, 1000:]
    found = [integrated_time(autocorrelation(record)) for record in records]
    errors = np.array([(time.samples - expected) / time.standard_uncertainty for time in found])
    assert abs(errors.mean()) < 0.3
    assert 0.7 < errors.std() < 1.16


def test_anticorrelated_samples_do_not_give_zero(rng):
    record = np.diff(rng.standard_normal(2001))
    assert integrated_time(autocorrelation(record)).samples > 0


def test_a_record_shorter_than_its_window():
    """A ramp is correlated to its end."""
    found = integrated_time(autocorrelation(np.arange(40.0)))
    assert found.window <= 39
    assert found.dof > 0
