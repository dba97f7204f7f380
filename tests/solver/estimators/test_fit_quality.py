import numpy as np
import pytest
from scipy import stats

from solver.estimators.fit_quality import FALSE_ALARM, judge


@pytest.fixture
def line(rng):
    """A straight line through twelve points: design, S and residuals of unit noise."""
    design = np.column_stack((np.ones(12), np.arange(12.0)))
    sensitivity = np.eye(12) - design @ np.linalg.pinv(design)
    return sensitivity, rng.standard_normal(12)


def test_standardised_residuals_by_the_hat_matrix(line):
    sensitivity, noise = line
    residuals = sensitivity @ noise
    judged = judge(residuals, sensitivity, np.eye(12), None)
    np.testing.assert_allclose(judged.standardised, residuals / np.sqrt(np.diagonal(sensitivity)), rtol=1e-12)
    assert not judged.outliers.any()


@pytest.mark.parametrize("places", [[5], [0], [3, 4], [0, 11]])
def test_outliers_are_marked_without_their_neighbours(places, line):
    sensitivity, noise = line
    noise[places] += 100.0
    judged = judge(sensitivity @ noise, sensitivity, np.eye(12), None)
    assert np.flatnonzero(judged.outliers).tolist() == places


def test_estimated_noise_uses_the_deleted_residual(line):
    """The largest deleted residual is compared with Student's t of one degree less, by hand here."""
    sensitivity, noise = line
    noise[7] += 8.0
    residuals = sensitivity @ noise
    variance = residuals @ residuals / 10
    judged = judge(residuals, sensitivity, variance * np.eye(12), 10)
    without = np.delete(np.arange(12), 7)
    line_without = np.polynomial.Polynomial.fit(without, noise[without], 1)
    rest = noise[without] - line_without(without)
    spread = 1 + 1 / 11 + (7 - without.mean()) ** 2 / np.sum((without - without.mean()) ** 2)
    deleted = (noise[7] - line_without(7)) / np.sqrt(spread * (rest @ rest) / 9)
    assert deleted > stats.t.isf(FALSE_ALARM / 24, 9)
    assert np.flatnonzero(judged.outliers).tolist() == [7]


def test_threshold_is_that_of_bonferroni():
    """One residual just below and just above the normal quantile of 1 % over twelve, two-sided."""
    limit = stats.norm.isf(FALSE_ALARM / 24)
    for factor, marked in ((0.999, False), (1.001, True)):
        residuals = np.zeros(12)
        residuals[4] = factor * limit
        assert judge(residuals, np.eye(12), np.eye(12), None).outliers[4] == marked


def test_a_residual_that_cannot_be_seen_is_not_judged():
    """A point that the model passes through whatever it is has no residual of its own."""
    sensitivity = np.eye(3)
    sensitivity[0, 0] = 0.0
    judged = judge(np.array([0.0, 1.0, -1.0]), sensitivity, np.eye(3), None)
    assert np.isnan(judged.standardised[0])
    assert not judged.outliers.any()


def test_one_residual_that_explains_all_scatter():
    residuals = np.array([0.0, 0.0, 6.0, 0.0])
    judged = judge(residuals, np.eye(4), np.eye(4) * 36 / 4, 4)
    assert np.flatnonzero(judged.outliers).tolist() == [2]


def test_no_freedom_no_test():
    assert not judge(np.array([5.0, 0.1]), np.eye(2), np.eye(2), 1).outliers.any()
