"""Bias instability and rate random walk: their Allan deviations, and that a value is its moment's alone."""

import multiprocessing
from concurrent.futures import ProcessPoolExecutor
from functools import partial

import allantools
import numpy as np
import pytest
from scipy.stats import chi2

from simdevice import slow
from simdevice.noise import RateNoise
from simdevice.slow import wander

B, K = 3e-9, 2e-11
BOTH = RateNoise(bias_instability=B, rate_random_walk=K)


def allan(values: np.ndarray, rate: float, alpha: int, averaged: list[int]) -> tuple[np.ndarray, np.ndarray]:
    """Overlapping Allan deviations of a rate, and the equivalent degrees of freedom of their squares.

    Degrees of freedom after Greenhall and Riley, for the noise of exponent `alpha`.
    """
    taus = np.array(averaged) / rate
    found, deviations, _, _ = allantools.oadev(values, rate=rate, data_type="freq", taus=taus)
    assert found == pytest.approx(taus)
    dof = [allantools.edf_greenhall(alpha, 2, m, len(values) + 1, overlapping=True) for m in averaged]
    return deviations, np.array(dof)


@pytest.mark.parametrize("seed", [1, 2])
def test_the_allan_floor_is_0_664_times_the_flicker_coefficient(seed: int) -> None:
    """2^17 knots, 9 hours: at τ from 8 to 1024 s the square over (0.664·B)² is χ² over its dof.

    The band that is stated takes up to 1 % of the deviation, 2 % of the square.
    """
    rates = wander(RateNoise(bias_instability=B), seed, 0, np.arange(2**17) * slow.KNOT)
    averaged = [32, 128, 512, 2048, 4096]
    for values in rates:
        deviations, dof = allan(values, 1 / slow.KNOT, -1, averaged)
        squares = (deviations / (np.sqrt(2 * np.log(2) / np.pi) * B)) ** 2
        # Of 20 such numbers none beyond 1 in 5000 on either side.
        assert (chi2.ppf(2e-4, dof) / dof * 0.98 < squares).all()
        assert (squares < chi2.ppf(1 - 2e-4, dof) / dof * 1.02).all()


def allan_variance(tau: np.ndarray) -> np.ndarray:
    """Of the sum, for B = 1: that of a first-order Gauss–Markov process (IEEE 952, annex C) for each."""
    t = 4.0 ** np.arange(10)
    variance = np.log(4) / np.pi * np.where(t == 1.0, 4 / 3, 1.0)
    tau = tau[:, None]
    each = 2 * variance * t / tau * (1 - t / (2 * tau) * (3 - 4 * np.exp(-tau / t) + np.exp(-2 * tau / t)))
    return np.sum(each, axis=1)


def test_the_processes_make_the_floor_over_the_band_that_is_stated() -> None:
    assert np.sqrt(allan_variance(np.geomspace(8.0, 2e4, 50))) == pytest.approx(0.664, rel=0.01)
    # Outside of it there is less: the statement of the band is not vacuous.
    assert (np.sqrt(allan_variance(np.array([1.0, 5e5]))) < 0.6).all()


def test_flicker_is_stationary_from_power_up_on() -> None:
    """Variance 31/3·s² = 4.56·B² at power-up and 15 minutes later, over 300 seeds: χ² with 300 dof."""
    at = np.array(
        [wander(RateNoise(bias_instability=1.0), seed, 0, np.array([0.0, 900.0]))[0] for seed in range(300)]
    )
    squares = np.sum(at**2, axis=0) / (31 / 3 * np.log(4) / np.pi)
    low, high = chi2.ppf([1e-3, 1 - 1e-3], 300)
    assert ((low < squares) & (squares < high)).all()


@pytest.mark.parametrize("seed", [1, 2])
def test_rate_random_walk_rises_with_the_root_of_time(seed: int) -> None:
    """Allan deviation K·√(τ/3) at τ from 16 to 1024 s: a slope of +1/2 within the bounds of χ².

    Means over m ≥ 64 knots differ from the integral's by 1/(2·m²) of the square.
    """
    rates = wander(RateNoise(rate_random_walk=K), seed, 0, np.arange(2**17) * slow.KNOT)
    averaged = [64, 256, 1024, 4096]
    for values in rates:
        deviations, dof = allan(values, 1 / slow.KNOT, -2, averaged)
        squares = deviations**2 / (K**2 * np.array(averaged) * slow.KNOT / 3)
        assert (chi2.ppf(2e-4, dof) / dof < squares).all()
        assert (squares < chi2.ppf(1 - 2e-4, dof) / dof).all()


def test_a_walk_begins_at_zero_and_is_straight_between_knots() -> None:
    walk = RateNoise(rate_random_walk=1.0)
    values = wander(walk, 3, 0, np.array([0.0, 0.25, 0.5, 0.375]))
    assert (values[:, 0] == 0).all()
    assert values[:, 3] == pytest.approx((values[:, 1] + values[:, 2]) / 2, rel=1e-14)  # one rounding each


def test_a_value_depends_on_its_moment_alone() -> None:
    t = np.arange(0.0, 4000.0, 0.7)  # four blocks of knots
    whole = wander(BOTH, 5, 0, t)
    rng = np.random.default_rng(1)
    for _ in range(3):
        slow._axis.cache_clear()  # nothing that was asked for before helps or harms
        some = rng.permutation(len(t))[:200]
        assert wander(BOTH, 5, 0, t[some]).tobytes() == np.ascontiguousarray(whole[:, some]).tobytes()


def test_what_was_forgotten_is_drawn_again_alike(monkeypatch: pytest.MonkeyPatch) -> None:
    t = np.arange(0.0, 9000.0, 1.0)
    whole = wander(BOTH, 5, 0, t)
    slow._axis.cache_clear()
    monkeypatch.setattr(slow, "_BLOCKS_KEPT", 1)
    again = np.concatenate(
        [wander(BOTH, 5, 0, t[part]) for part in (slice(5000, None), slice(0, 5000))], axis=1
    )
    assert again[:, 4000:].tobytes() == whole[:, :5000].tobytes()
    assert again[:, :4000].tobytes() == whole[:, 5000:].tobytes()
    slow._axis.cache_clear()


def test_another_process_finds_the_same_values() -> None:
    t = np.linspace(1500.0, 1600.0, 50)
    with ProcessPoolExecutor(1, mp_context=multiprocessing.get_context("spawn")) as pool:
        assert (
            pool.submit(partial(wander, BOTH, 5, 0), t).result().tobytes() == wander(BOTH, 5, 0, t).tobytes()
        )


def test_parts_axes_seeds_and_starts_are_independent() -> None:
    t = np.arange(0.0, 1000.0, 1.0)
    flicker, walk = (
        wander(noise, 5, 0, t) for noise in (RateNoise(bias_instability=B), RateNoise(rate_random_walk=K))
    )
    # Sums of numbers of 1e-9 in another order: a few roundings of 1e-25.
    np.testing.assert_allclose(wander(BOTH, 5, 0, t), flicker + walk, rtol=0, atol=1e-24)
    others = [wander(BOTH, *which, t) for which in ((5, 0), (6, 0), (5, 1))]
    firsts = {float(rates[axis, 500]) for rates in others for axis in range(2)}
    assert len(firsts) == 6


def test_there_is_no_noise_before_power_up() -> None:
    with pytest.raises(ValueError, match="before power-up"):
        wander(BOTH, 5, 0, np.array([-0.001, 1.0]))
    assert wander(BOTH, 5, 0, np.array([])).shape == (2, 0)
