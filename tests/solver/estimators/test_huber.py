"""Huber's estimator beside published results of other programs, and by simulation."""

import numpy as np
import pytest
from scipy import optimize, stats

from solver.errors import NotConverged
from solver.estimators.huber import TUNING, asymptotic_factor, huber, median_scale, normal_factor, weights_of

# K. A. Brownlee, Statistical Theory and Methodology in Science and Engineering, 1965: stack loss of a plant.
STACK_LOSS = np.array([
    [80, 27, 89, 42], [80, 27, 88, 37], [75, 25, 90, 37], [62, 24, 87, 28], [62, 22, 87, 18], [62, 23, 87, 18],
    [62, 24, 93, 19], [62, 24, 93, 20], [58, 23, 87, 15], [58, 18, 80, 14], [58, 18, 89, 14], [58, 17, 88, 13],
    [58, 18, 82, 11], [58, 19, 93, 12], [50, 18, 89, 8], [50, 18, 86, 7], [50, 19, 72, 8], [50, 19, 79, 8],
    [50, 20, 80, 9], [56, 20, 82, 15], [70, 20, 91, 15],
], dtype=float)  # fmt: skip


@pytest.fixture
def stack_loss():
    return np.column_stack((np.ones(21), STACK_LOSS[:, :3])), STACK_LOSS[:, 3]


def test_stack_loss_as_r_finds_it(stack_loss):
    """MASS::rlm of R, psi.huber with k = 1.345 and the plain median, as kept in statsmodels' results_rlm.py.

    R stops when the residuals change by less than 1e-4 of their size.
    """
    fit = huber(*stack_loss, leverages=np.zeros(21))
    np.testing.assert_allclose(fit.values, [-41.02653105, 0.82937387, 0.92610818, -0.12784916], rtol=2e-4)
    assert fit.scale == pytest.approx(2.4407137948148447, rel=2e-4)
    weights = np.ones(21)
    weights[[2, 3, 20]] = 0.7858871, 0.50494094, 0.36814106
    np.testing.assert_allclose(fit.weights, weights, atol=2e-4)


def test_asymptotic_covariance_as_sas_finds_it(stack_loss):
    """PROC ROBUSTREG of SAS, covariance H1, four to five digits, as kept in statsmodels' results_rlm.py."""
    design, right_side = stack_loss
    fit = huber(design, right_side, leverages=np.zeros(21))
    factor = asymptotic_factor((right_side - design @ fit.values) / fit.scale, 4)
    covariance = factor * fit.scale**2 * np.linalg.inv(design.T @ design)
    np.testing.assert_allclose(np.diagonal(covariance), [95.8813, 0.01232, 0.09177, 0.01655], rtol=6e-4)
    np.testing.assert_allclose(covariance[0, 1:], [0.19485, -0.44161, -1.13577], rtol=6e-4)


def test_it_minimises_hubers_sum(stack_loss):
    """Against a general minimiser of Σ ρ, for a known scale."""
    design, right_side = stack_loss
    lengths = np.linalg.norm(design, axis=0)

    def loss(scaled):
        residuals = (right_side - design @ (scaled / lengths)) / 2.5
        size = np.abs(residuals)
        return float(np.sum(np.where(size <= TUNING, size**2 / 2, TUNING * size - TUNING**2 / 2)))

    fit = huber(design, right_side, scale=2.5)
    found = optimize.minimize(loss, fit.values * lengths * 1.01, method="BFGS", options={"gtol": 1e-9})
    np.testing.assert_allclose(fit.values, found.x / lengths, rtol=1e-4)  # BFGS by differences


def test_newtons_steps_end_where_the_weights_do(stack_loss, monkeypatch):
    """The same minimum, and quickly, also where most equations lie beyond k."""
    for scale in (2.5, 0.3, 0.01):
        slow = huber(*stack_loss, scale=scale)
        with monkeypatch.context() as patch:
            patch.setattr("solver.estimators.huber._WEIGHTED_ROUNDS", 0)
            quick = huber(*stack_loss, scale=scale)
        np.testing.assert_allclose(quick.values, slow.values, rtol=1e-6)
        assert quick.rounds < 30


def test_weights_are_one_inside_and_fall_as_one_over_the_size():
    np.testing.assert_allclose(weights_of(np.array([0.0, -1.3, 2.69, -134.5])), [1, 1, 0.5, 0.01])


def test_median_scale_is_consistent_for_normal_noise(rng):
    """The median's own standard deviation is 1.17/√n (efficiency 37 %): four of it."""
    size = 100_000
    found = median_scale(3.0 * rng.standard_normal(size), np.zeros(size))
    assert found == pytest.approx(3.0, rel=4 * 1.17 / np.sqrt(size))


def test_factor_for_normal_noise_is_the_known_efficiency(rng):
    """95 % at k = 1.345 (Huber 1981, sec. 1.7); weights of normal residuals by simulation."""
    assert normal_factor(np.ones(5)) == pytest.approx(1 / 0.95, rel=1e-3)
    weights = weights_of(rng.standard_normal(1_000_000))
    like_equal = np.mean(weights) ** 2 / np.mean(weights**2)
    assert normal_factor(weights) == pytest.approx(like_equal / 0.95, rel=1e-3)


@pytest.mark.parametrize("scale", [1.0, None])
@pytest.mark.parametrize("blunders", [0, 3])
def test_stated_covariance_is_true(scale, blunders):
    """300 simulated problems of 60 equations and 4 unknowns, blunders of 5 to 100 times the noise.

    Errors over u have mean square 1 within 99.99 % of χ² for independent sessions, widened by the
    asymptotic formula's 1/n and, for an estimated scale, by Student's ν/(ν − 2) with ν = 56: 5 %.
    """
    rng = np.random.default_rng(17)
    design = rng.standard_normal((60, 4))
    errors = []
    for _ in range(300):
        noise = rng.standard_normal(60)
        noise[rng.choice(60, blunders, replace=False)] += rng.choice([-1, 1], blunders) * rng.uniform(
            5, 100, blunders
        )
        fit = huber(design, noise, scale=scale)
        gain = np.linalg.solve(design.T @ (fit.weights[:, None] * design), design.T * fit.weights)
        u = fit.scale * np.sqrt(fit.variance_factor * np.diagonal(gain @ gain.T))
        errors.append(fit.values / u)
    low, high = stats.chi2.ppf([0.00005, 0.99995], 4 * 300) / (4 * 300)
    assert low / 1.05 < np.mean(np.square(errors)) < high * 1.05


def test_no_degree_of_freedom_no_variance(rng):
    design = rng.standard_normal((4, 4))
    fit = huber(design, design @ np.arange(4.0))
    np.testing.assert_allclose(fit.values, np.arange(4.0), atol=1e-12)
    assert np.isnan(fit.variance_factor)


def test_exact_equations_have_equal_weights(rng):
    design = rng.standard_normal((9, 2))
    fit = huber(design, design @ [3.0, -2.0])
    np.testing.assert_allclose(fit.values, [3.0, -2.0], rtol=1e-12)
    assert np.all(fit.weights == 1.0)


def test_not_settling_is_a_failure_with_its_history(stack_loss, monkeypatch):
    monkeypatch.setattr("solver.estimators.huber.MOST_ROUNDS", 3)
    with pytest.raises(NotConverged, match="3 rounds") as caught:
        huber(*stack_loss)
    assert caught.value.iterations.shape == (4, 4)
