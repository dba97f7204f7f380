"""Published tables, exact values of simple sequences, and coverage of the intervals."""

import numpy as np
import pytest

from solver.errors import InputError
from solver.signals.allan import allan, allan_deviation, decade_factors, equivalent_dof, octave_factors
from solver.signals.noise_type import noise_exponent

NBS_MONOGRAPH_140 = [892, 809, 823, 798, 671, 644, 883, 903, 677]
"""Nine values of frequency: NBS Monograph 140, annex 8.E; repeated in NIST SP 1065, p. 107."""


def thousand_points() -> np.ndarray:
    """NIST SP 1065, sec. 12.4, p. 107: n ← 16807·n mod 2147483647 from 1234567890, over the modulus."""
    numbers = [1234567890]
    for _ in range(999):
        numbers.append(16807 * numbers[-1] % 2147483647)
    assert numbers[1:4] == [395529916, 1209410747, 633705974]  # printed there as a check
    return np.array(numbers) / 2147483647


@pytest.mark.parametrize(
    ("overlapping", "printed"),
    [(False, ["91.22945", "115.8082"]), (True, ["91.22945", "85.95287"])],
)
def test_nbs_monograph_140(overlapping, printed):
    """NIST SP 1065, table 30, p. 107: τ = 1 and 2, all printed digits."""
    found = allan_deviation(NBS_MONOGRAPH_140, [1, 2], overlapping=overlapping)
    assert [f"{value:.7g}" for value in found] == printed


@pytest.mark.parametrize(
    ("overlapping", "printed"),
    [
        (False, ["2.922319e-01", "9.965736e-02", "3.897804e-02"]),
        (True, ["2.922319e-01", "9.159953e-02", "3.241343e-02"]),
    ],
)
def test_thousand_points(overlapping, printed):
    """NIST SP 1065, table 31, p. 108: τ = 1, 10 and 100, all printed digits."""
    found = allan_deviation(thousand_points(), [1, 10, 100], overlapping=overlapping)
    assert [f"{value:.6e}" for value in found] == printed


def test_it_is_half_the_mean_square_of_adjacent_averages(rng):
    """The definition, written out: no running sum, no second difference."""
    record = rng.standard_normal(101) + 1e3
    for factor in (1, 3, 7, 50):
        averages = np.array([record[i : i + factor].mean() for i in range(101 - factor + 1)])
        steps = averages[factor:] - averages[:-factor]
        # Sums of 101 values near 1000 are exact to some 1e-11.
        assert allan_deviation(record, [factor])[0] == pytest.approx(np.sqrt(np.mean(steps**2) / 2), rel=1e-9)
        plain = np.sqrt(np.mean(steps[::factor] ** 2) / 2)
        assert allan_deviation(record, [factor], overlapping=False)[0] == pytest.approx(plain, rel=1e-9)


def test_a_steady_drift_is_rate_times_tau_over_root_two():
    """IEEE Std 952-1997, C.1.4: rate ramp, σ = R·τ/√2."""
    found = allan(3.0 * np.arange(1000) * 0.005, 0.005)
    assert found.deviation == pytest.approx(3.0 * found.tau / np.sqrt(2), rel=1e-9)


def test_octaves_and_decades_reach_half_the_record():
    assert octave_factors(9).tolist() == [1, 2, 4]
    assert octave_factors(8).tolist() == [1, 2, 4]
    assert octave_factors(12_000)[-1] == 4096
    assert decade_factors(100).tolist() == [1, 2, 5, 10, 20, 50]
    assert decade_factors(99).tolist() == [1, 2, 5, 10, 20]


@pytest.mark.parametrize("factor", [1, 2, 10, 100])
def test_degrees_of_freedom_of_white_noise(factor):
    """SP 1065, sec. 5.4.2: (3(N−1)/2m − 2(N−2)/N)·4m²/(4m² + 5) for N phases, an approximation.

    Against the exact sum it is off by up to 2.5 % (at m = 2), as its source says.
    """
    n = 1001
    printed = (3 * (n - 1) / (2 * factor) - 2 * (n - 2) / n) * 4 * factor**2 / (4 * factor**2 + 5)
    assert equivalent_dof(factor, n - 2 * factor, 0) == pytest.approx(printed, rel=0.025)


def fractional(random: np.random.Generator, count: int, n: int, exponent: int) -> np.ndarray:
    """Noise with a spectrum f^exponent by the recursion of N. J. Kasdin, Proc. IEEE 83 (1995), 802."""
    k = np.arange(1, 5 * n)
    weights = np.cumprod(np.concatenate(([1.0], (k - 1 - exponent / 2) / k)))
    spectrum = np.fft.rfft(random.standard_normal((count, 5 * n)), 10 * n) * np.fft.rfft(weights, 10 * n)
    return np.fft.irfft(spectrum, 10 * n)[:, 4 * n : 5 * n]


def shaped(random: np.random.Generator, count: int, n: int, exponent: int) -> np.ndarray:
    """Averages over an interval of a rate that goes on between the samples."""
    if exponent == 2:
        return np.diff(random.standard_normal((count, n + 1)), axis=1)
    if exponent == 1:
        phase = fractional(random, count, 4 * (n + 1), -1).reshape(count, n + 1, 4).mean(axis=2)
        return np.diff(phase, axis=1)
    if exponent == -1:
        return fractional(random, count, n, -1)
    if exponent == -2:
        return np.cumsum(random.standard_normal((count, 8 * n)), axis=1).reshape(count, n, 8).mean(axis=2)
    return random.standard_normal((count, n))


@pytest.mark.parametrize("overlapping", [True, False])
@pytest.mark.parametrize("exponent", [2, 1, 0, -1, -2])
def test_degrees_of_freedom_of_simulated_noise(exponent, overlapping):
    """2·E²/Var of the variances of many records is the number of degrees of freedom.

    The relative variance of 2/edf is known from N records within √(2/N)·√(1 + 6/edf): with four of
    those, and 5 % for flicker noise, whose simulation begins somewhere and is never quite f^−1.
    """
    random = np.random.default_rng(952)
    n, count = 400, 500 if exponent == 1 else 2000
    records = shaped(random, count, n, exponent)
    for factor in (1, 8, 40):
        variances = np.array(
            [allan_deviation(record, [factor], overlapping=overlapping)[0] ** 2 for record in records]
        )
        obtained = 2.0 * variances.mean() ** 2 / variances.var(ddof=1)
        stride = 1 if overlapping else factor
        terms = len(range(0, n - 2 * factor + 1, stride))
        expected = equivalent_dof(factor, terms, exponent, stride)
        bound = 4 * np.sqrt(2 / count * (1 + 6 / expected)) + (0.05 if exponent in (1, -1) else 0.0)
        assert obtained == pytest.approx(expected, rel=bound)


@pytest.mark.parametrize("exponent", [2, 1, 0, -1, -2])
def test_the_noise_is_told(exponent):
    records = fractional(np.random.default_rng(7), 20, 2000, exponent)
    assert [noise_exponent(record, 1) for record in records] == [exponent] * 20


def test_intervals_cover(rng):
    """White noise has σ(τ) = 1/√m; 95 % intervals of 1,000 records, four binomial deviations of 0.7 %."""
    inside = np.zeros(3)
    for record in rng.standard_normal((1000, 600)):
        found = allan(record, 1.0, [1, 16, 128])
        truth = 1 / np.sqrt(found.factors)
        inside += (found.low < truth) & (truth < found.high)
    # The equivalent χ² is an approximation where few degrees of freedom are left (m = 128: 4).
    assert np.all(np.abs(inside / 1000 - 0.95) < 0.028)


def test_constant_samples_have_no_deviation():
    found = allan(np.full(100, 0.25), 1.0)
    assert not found.deviation.any()
    assert not found.high.any()


@pytest.mark.parametrize(
    ("samples", "factors"),
    [([1.0, 2.0], [1]), ([1.0, np.nan, 2.0], [1]), ([[1.0, 2.0, 3.0]], [1]), ([1.0, 2.0, 4.0], [2]),
     ([1.0, 2.0, 4.0], [0])],
)  # fmt: skip
def test_unusable_input_is_refused(samples, factors):
    with pytest.raises(InputError):
        allan_deviation(samples, factors)


def test_an_interval_must_be_positive():
    with pytest.raises(InputError):
        allan([1.0, 2.0, 4.0], 0.0)
