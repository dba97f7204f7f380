"""Are the stated uncertainties true? Errors of simulated sessions over their u, and χ² itself."""

import numpy as np
import pytest
from scipy import stats

from solver.calibrate import calibrate
from tests.solver.sessions import DEG_PER_H, Setup, truth

SESSIONS = 200


def interval(freedom: int, level: float) -> tuple[float, float]:
    """Where the root mean square of `freedom` independent standard normals lies with probability `level`."""
    tails = ((1 - level) / 2, (1 + level) / 2)
    low, high = np.sqrt(stats.chi2.ppf(tails, freedom) / freedom)
    return float(low), float(high)


def normalised_errors(setup: Setup, seed: int) -> dict[str, np.ndarray]:
    rng = np.random.default_rng(seed)
    errors: dict[str, list[np.ndarray]] = {"least-squares": [], "paper": []}
    for _ in range(SESSIONS):
        result = calibrate(setup.observe(rng))
        for estimate in (result.least_squares, result.paper):
            error = (estimate.values - setup.parameters) / estimate.standard_uncertainties
            errors[estimate.method].append(error)
    return {method: np.array(rows) for method, rows in errors.items()}


@pytest.mark.parametrize("seed", range(5))
def test_given_uncertainties_are_true(seed):
    low, high = interval(SESSIONS, 0.999)
    for errors in normalised_errors(Setup(noise=0.005, u_given=True), seed).values():
        rms = np.sqrt(np.mean(errors**2, axis=0))
        assert np.all((low < rms) & (rms < high))


def test_uncertainties_from_the_scatter_are_true():
    """Errors over u follow Student's t with 24 degrees of freedom, of variance 24/22.

    The variance of t² is 2·ν²·(ν − 1)/((ν − 2)²·(ν − 4)): the mean of 200 scatters by its root over 200;
    four of those.
    """
    nu = 24
    variance = nu / (nu - 2)
    scatter = np.sqrt(2 * nu**2 * (nu - 1) / ((nu - 2) ** 2 * (nu - 4)) / SESSIONS)
    for errors in normalised_errors(Setup(noise=0.005), 7).values():
        assert np.all(np.abs(np.mean(errors**2, axis=0) - variance) < 4 * scatter)


def test_covariance_has_the_true_correlations():
    """The whole vector: the mean of eᵀ·C⁻¹·e over 200 sessions is 8 within 99.9 %."""
    setup, rng = Setup(truth(kxy=400.0), noise=0.005, u_given=True), np.random.default_rng(3)
    distances: dict[str, list[float]] = {"least-squares": [], "paper": []}
    for _ in range(SESSIONS):
        result = calibrate(setup.observe(rng))
        for estimate in (result.least_squares, result.paper):
            u = estimate.standard_uncertainties
            error = (estimate.values - setup.parameters) / u
            correlation = estimate.covariance / np.outer(u, u)
            distances[estimate.method].append(error @ np.linalg.solve(correlation, error))
    low, high = stats.chi2.ppf([0.0005, 0.9995], 8 * SESSIONS) / SESSIONS
    for method in distances.values():
        assert low < np.mean(method) < high


def test_unequal_uncertainties_weigh(rng):
    """With noise ten times larger in y at half of the positions, weighting pays and u stays true."""
    setup = Setup(noise=0.005, u_given=True)
    errors, plain = [], []
    for _ in range(SESSIONS):
        observations = setup.observe(rng)
        for row in range(0, 16, 2):
            extra = np.sqrt(99.0) * observations.u_jy[row]
            observations.jy[row] += extra * rng.standard_normal()
            observations.u_jy[row] *= 10
        weighted = calibrate(observations, "least-squares").least_squares
        errors.append((weighted.values - setup.parameters) / weighted.standard_uncertainties)
        plain.append(weighted.standard_uncertainties)
        assert weighted.fit.rank == 8
    low, high = interval(SESSIONS, 0.999)
    rms = np.sqrt(np.mean(np.square(errors), axis=0))
    assert np.all((low < rms) & (rms < high))
    # x is as good as ever: u(ω0x) is about 0.005/√16 °/h and more, u(ω0y) is that of eight good rows.
    u = np.mean(plain, axis=0) / DEG_PER_H
    assert u[4] < 0.002
    assert u[4] < u[5] < 0.005 / np.sqrt(8) * 1.5


def test_chi_squared_and_p_value_are_those_of_noise(rng):
    """p is uniform (Kolmogorov-Smirnov at 0.1 %) and χ² has 24 degrees of freedom, for both methods."""
    setup = Setup(noise=0.005, u_given=True)
    fits = [calibrate(setup.observe(rng)) for _ in range(SESSIONS)]
    for method in ("least_squares", "paper"):
        found = [getattr(fit, method).fit for fit in fits]
        assert {fit.dof for fit in found} == {24}
        assert stats.kstest([fit.p_value for fit in found], "uniform").pvalue > 1e-3
        np.testing.assert_allclose(
            [fit.p_value for fit in found], stats.chi2.sf([fit.chi2 for fit in found], 24), rtol=1e-9
        )


def test_standardised_residuals_have_unit_variance(rng):
    """Over 200 sessions, each residual by itself (99.9 % each over 64: 99.9999 % interval)."""
    setup = Setup(noise=0.005, u_given=True)
    low, high = interval(SESSIONS, 1 - 1e-6)
    for method in ("least_squares", "paper"):
        rows = [getattr(calibrate(setup.observe(rng)), method).standardised for _ in range(SESSIONS)]
        rms = np.sqrt(np.mean(np.square(rows), axis=0))
        assert np.all((low < rms) & (rms < high))


def test_false_alarms_of_the_outlier_test(rng):
    """At 1 % per session, 400 sessions of good data raise 4 alarms on average; fewer than 14 at 99.99 %."""
    for u_given in (True, False):
        setup = Setup(noise=0.005, u_given=u_given)
        alarms = sum(
            bool(calibrate(setup.observe(rng), "least-squares").least_squares.outliers.any())
            for _ in range(2 * SESSIONS)
        )
        assert alarms < stats.binom.ppf(0.9999, 2 * SESSIONS, 0.01) + 1


def test_least_squares_beats_the_paper_as_stated():
    """On sixteen positions u of K, ωg and ωк is 1.4 to 1.6 times smaller at 48-56°; on eight they agree.

    The ratios are those of the specification of the product.
    """
    for latitude in (48.0, 52.0, 56.0):
        setup = Setup(latitude=latitude, noise=0.005, u_given=True)
        result = calibrate(setup.observe(np.random.default_rng(1)))
        ratio = result.paper.standard_uncertainties / result.least_squares.standard_uncertainties
        assert np.all((ratio[[0, 1, 2, 3, 6, 7]] > 1.35) & (ratio[[0, 1, 2, 3, 6, 7]] < 1.65))
