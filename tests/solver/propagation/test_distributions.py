"""First order, Monte Carlo and simulated truth: three ways to the same uncertainty."""

from dataclasses import replace

import numpy as np
import pytest

from solver.calibrate import calibrate
from solver.error_model import observation_equations
from solver.errors import InputError
from solver.estimators.estimation import least_squares, paper
from solver.estimators.generalised import generalised
from solver.estimators.rate_noise import whitening_of
from solver.estimators.robust import robust
from solver.inputs import COMMON, CommonUncertainty
from solver.least_squares import solve_batch
from solver.propagation.budget import make_budget
from solver.propagation.distributions import compare_with_budget, model_of, propagate_distributions
from solver.records import PARAMETERS
from tests.solver.propagation.test_budget import ARCSEC, COEFFICIENTS, EVERYTHING, session
from tests.solver.propagation.test_input_draws import EARTH, back
from tests.solver.sessions import DEG_PER_H, LAB, Setup, grid, to_case, truth

CORRELATED = {("azimuth", "latitude"): 0.9, ("gain_x", "gain_y"): 0.8, ("alpha", "level_1"): -0.7}
LARGE_COMMON = {
    "gain_x": 3e-4, "gain_y": 3e-4, "offset_x": 4e-12, "offset_y": 4e-12, "alpha": 40 * ARCSEC, "beta": 40 * ARCSEC,
    "gamma": 60 * ARCSEC, "level_1": 40 * ARCSEC, "level_2": 60 * ARCSEC, "azimuth": 90 * ARCSEC,
    "latitude": 60 * ARCSEC, "gravity": 3e-4, "temperature": 0.5,
}  # fmt: skip
"""So large that what is in common weighs as much as the currents' noise."""


def common_of(standard, correlation=None):
    return CommonUncertainty.of(standard, correlation=correlation, temperature_coefficients=COEFFICIENTS)


def solve_by(method, observations, common):
    return method(observation_equations(observations), observations, common)


def budget_of(solved, level=0.95):
    at = solved.linearise()
    return make_budget(at.gain, at.inputs, scatter=at.scatter, scatter_dof=at.scatter_dof, level=level)


@pytest.mark.parametrize("method", [least_squares, paper, generalised, robust])
def test_first_order_and_monte_carlo_agree_on_the_same_inputs(rng, method):
    """100,000 draws know an end to 0.0085 u, one digit of u asks for 0.05 u at least."""
    solved = solve_by(method, session(rng, 10.0), common_of(LARGE_COMMON, CORRELATED))
    budget = budget_of(solved)
    found = propagate_distributions(solved, trials=100_000, seed=1)
    judged = compare_with_budget(solved, budget, found, digits=1)
    assert judged.verdict == "agree", judged.message.text
    assert min(budget.shares[:-1].sum(axis=1)) < 7  # no line is everything
    u = budget.standard_uncertainties
    # 5 standard errors: 1/√(2M) of a standard deviation, 1/√M of a mean
    np.testing.assert_allclose(found.standard_uncertainties / u, 1, atol=5 / np.sqrt(2e5))
    np.testing.assert_array_less(np.abs(found.mean - solved.values) / u, 5 / np.sqrt(1e5) + 0.01)
    correlation = found.covariance / np.outer(*2 * [found.standard_uncertainties])
    expected = budget.covariance / np.outer(u, u)
    np.testing.assert_allclose(correlation, expected, atol=5 / np.sqrt(1e5))


def simulated(rng, observations, common, count):
    """Currents (count, n, 2) that the ammeter shows of a gyro whose every circumstance differs from what is assumed.

    Orientations by scipy's rotations, steady currents from the error model written out.
    """
    n, at = len(observations), observations
    z = dict(zip(COMMON, np.linalg.cholesky(common.covariance + 1e-40 * np.eye(13)) @ rng.standard_normal((13, count)),
                 strict=True))  # fmt: skip

    def of_position(name):
        u = getattr(at, f"u_{name}")
        return (getattr(at, name) + u * rng.standard_normal((count, n)) + z[name][:, None]).ravel()

    misalignment = np.stack([of_position(name) for name in ("alpha", "beta", "gamma")], axis=1)
    angles = np.tile(np.stack((at.theta, at.psi), axis=1), (count, 1))
    base = back(2, z["azimuth"]) * back(1, z["level_2"]) * back(0, z["level_1"])
    turn = to_case(angles, misalignment).reshape(count, n, 3, 3) @ base.as_matrix()[:, None]
    latitude = at.latitude + z["latitude"]
    earth_vector = EARTH * np.stack((0 * latitude, np.cos(latitude), np.sin(latitude)), axis=1)
    earth = np.einsum("knij,kj->kni", turn, earth_vector)
    up = turn[..., 2] * (1 + z["gravity"])[:, None, None]
    values = truth()[:, None] + common.temperature_coefficients[:, None] * z["temperature"]
    kx, ky, kxy, kyx, w0x, w0y, wg, wk = values[..., None]
    x = earth[..., 0] - w0x - wg * up[..., 0] + wk * up[..., 1]
    y = earth[..., 1] - w0y - wk * up[..., 0] - wg * up[..., 1]
    determinant = kx * ky - kxy * kyx
    true = np.stack(((ky * x - kxy * y) / determinant, (kx * y - kyx * x) / determinant), axis=2)
    shown = np.empty_like(true)
    for channel, u in enumerate((at.u_jx, at.u_jy)):
        axis = "xy"[channel]
        exact = (true[..., channel] - z[f"offset_{axis}"][:, None]) / (1 + z[f"gain_{axis}"][:, None])
        shown[..., channel] = exact + u * rng.standard_normal((count, n))
    return shown


@pytest.mark.parametrize(
    "standard", [EVERYTHING, LARGE_COMMON], ids=["noise dominates", "common terms count"]
)
def test_sessions_with_every_input_wrong_by_its_uncertainty(rng, standard):
    """3,000 simulated sessions: errors over u have unit rms, and U covers 95 % of them."""
    count = 3_000
    observations = session(rng, 10.0)
    common = common_of(standard, CORRELATED)
    solved = solve_by(least_squares, observations, common)
    budget = budget_of(solved)
    u_currents = np.stack((observations.u_jx, observations.u_jy), axis=1)
    whitening = whitening_of(truth(), u_currents)
    shown = simulated(rng, observations, common, count)
    equations = observation_equations(observations)
    designs = np.repeat(equations.design.reshape(1, -1, 2, 8), count, axis=0)
    designs[:, :, 0, 0] = designs[:, :, 1, 3] = shown[..., 0]
    designs[:, :, 0, 2] = designs[:, :, 1, 1] = shown[..., 1]
    right = np.broadcast_to(whitening @ equations.right_side.reshape(-1, 2, 1), (count, 16, 2, 1))
    found, _ = solve_batch((whitening @ designs).reshape(count, 32, 8), right.reshape(count, 32))
    error = found - truth()
    rms = np.sqrt(np.mean((error / budget.standard_uncertainties) ** 2, axis=0))
    # standard error of an rms 1/√(2·3000) = 1.3 %, 4 of them, and u itself from one noisy session
    np.testing.assert_allclose(rms, 1, atol=0.055)
    covered = np.mean(np.abs(error) < budget.expanded, axis=0)
    # √(0.95·0.05/3000) = 0.4 %, 4 of them
    np.testing.assert_allclose(covered, 0.95, atol=0.016)


def test_common_terms_count_where_they_should(rng):
    budget = budget_of(solve_by(least_squares, session(rng, 10.0), common_of(LARGE_COMMON, CORRELATED)))
    assert (budget.shares[0] < 0.75).sum() >= 4  # else the cases above would test the currents' noise alone


@pytest.mark.parametrize(
    ("circumstances", "standard"),
    [({"noise": 0.5}, {}), ({"noise": 0.005}, {"level_1": np.radians(3), "azimuth": np.radians(3)})],
    ids=["much noise", "base known to 3 degrees"],
)
def test_where_first_order_fails_the_comparison_says_so(rng, circumstances, standard):
    """Noise in the design pulls the scale factors, and makes them skewed; large rotations shorten the components."""
    solved = solve_by(least_squares, session(rng, 0.0, **circumstances), common_of(standard))
    budget = budget_of(solved)
    found = propagate_distributions(solved, trials=50_000, seed=1)
    judged = compare_with_budget(solved, budget, found, digits=1)
    assert judged.verdict == "disagree"
    assert judged.message.code == "first-order-refuted"
    assert judged.message.values["names"]
    assert all(name in PARAMETERS for name in judged.message.values["names"].split(", "))
    bias = (found.mean - solved.values) / found.standard_uncertainties
    assert np.abs(bias).max() > 0.05  # first order knows no bias; sampling would give 0.0045
    assert "degrees of freedom" not in judged.message.text


@pytest.mark.parametrize("method", [least_squares, generalised])
def test_few_degrees_of_freedom_are_named_as_the_cause(rng, method):
    """What is in common, of ν = 6 each: the deviation of a t-distribution is √(6/4) u, and the draws' with it."""
    standard = {
        name: LARGE_COMMON[name] for name in ("level_1", "level_2", "azimuth", "gain_x", "gain_y", "gravity")
    }
    common = CommonUncertainty.of(standard, dof=dict.fromkeys(standard, 6.0))
    solved = solve_by(method, session(rng, 0.0), common)
    found = propagate_distributions(solved, trials=50_000, seed=1)
    judged = compare_with_budget(solved, budget_of(solved), found, digits=2)
    assert judged.verdict == "disagree"
    assert "degrees of freedom" in judged.message.text


def test_noise_in_the_design_pulls_the_scale_factors_by_the_known_amount(rng):
    """Errors in variables, second order: E δK/K = −(n − p/2 − 1)·u²·(DᵀD)⁻¹.

    Of the n = 16 x equations −n·u² is the attenuation; half of the trace of the projection, p/2 = 4, and
    one for the product of both errors of an equation come back (expanding (D + Δ)⁺·right_side twice).
    """
    setup = Setup(parameters=truth(kxy=0.0, kyx=0.0), noise=0.3, u_given=True, misalignment=0.0)
    observations = setup.observe(rng)
    solved = solve_by(least_squares, observations, None)
    design = observation_equations(observations).design[::2, [0, 2, 4, 6, 7]]
    found = propagate_distributions(solved, trials=100_000, seed=2)
    pull = -(16 - 4 - 1) * setup.u_current**2 * np.linalg.inv(design.T @ design)[0, 0]
    # sampling 0.0158/√1e5 is 1.5 % of it, 3 of them; ωg and ωк come from both channels, which the formula leaves out
    assert found.mean[0] / solved.values[0] - 1 == pytest.approx(pull, rel=0.08)


def test_scatter_gives_the_t_distribution(rng):
    """JCGM 101, 6.4.9: √(ν/(ν − 2)) times first order's u, here ν = 24."""
    solved = solve_by(least_squares, session(rng, u_given=False), None)
    budget = budget_of(solved)
    found = propagate_distributions(solved, trials=100_000, seed=3)
    ratio = found.standard_uncertainties / budget.standard_uncertainties
    np.testing.assert_allclose(ratio, np.sqrt(24 / 22), atol=6 / np.sqrt(2e5))
    assert compare_with_budget(solved, budget, found, digits=1).verdict == "agree"  # k is Student's too


def test_repeats_share_the_angles_in_both(rng):
    """Angles of 60″ and hardly any noise: four repeats of a position are no better than one."""
    uncertainties = {}
    for repeats in (1, 4):
        observations = session(rng, 60.0, noise=1e-4, repeats=repeats)
        solved = solve_by(least_squares, observations, None)
        first_order = budget_of(solved).standard_uncertainties
        found = propagate_distributions(solved, trials=20_000, seed=4).standard_uncertainties
        np.testing.assert_allclose(found / first_order, 1, atol=5 / np.sqrt(4e4))
        uncertainties[repeats] = first_order
    # the two sessions' certified angles differ by 20″, 1e-4
    np.testing.assert_allclose(uncertainties[4] / uncertainties[1], 1, rtol=1e-2)


def test_the_same_seed_gives_the_same_bits(rng):
    solved = solve_by(least_squares, session(rng), common_of(EVERYTHING, CORRELATED))
    one, other = (propagate_distributions(solved, trials=25_000, seed=6) for _ in range(2))
    assert one.covariance.tobytes() == other.covariance.tobytes()
    assert one.symmetric.tobytes() == other.symmetric.tobytes()


def test_cancel(rng):
    class Cancelled(Exception):
        pass

    def report(fraction):
        raise Cancelled

    solved = solve_by(least_squares, session(rng), None)
    with pytest.raises(Cancelled):
        propagate_distributions(solved, report=report)


def test_adaptive_number_of_draws(rng):
    solved = solve_by(least_squares, session(rng), None)
    found = propagate_distributions(solved, trials=None, digits=1, seed=1)
    assert found.adaptive is not None
    assert found.adaptive.reached
    # digits are counted in °/h/mA and °/h: half of a power of ten of them
    powers = np.log10(2 * found.adaptive.tolerance / LAB)
    np.testing.assert_allclose(powers, np.round(powers), atol=1e-9)


def test_without_any_uncertainty_there_is_nothing_to_draw(rng):
    solved = solve_by(paper, Setup(positions=grid((0, 90)), noise=0.005).observe(rng), None)
    unknown = replace(solved, estimate=replace(solved.estimate, uncertainty_basis="none"))
    with pytest.raises(InputError) as caught:
        model_of(unknown)
    assert caught.value.message.code == "monte-carlo-no-uncertainty"


def test_robust_weights_are_those_of_the_estimate(rng):
    """One blunder: drawn again, it counts as little as in the estimate."""
    observations = session(rng, 0.0)
    jx = observations.jx.copy()
    jx[5] += 40 * observations.u_jx[5]
    solved = solve_by(robust, replace(observations, jx=jx), None)
    assert solved.weights is not None
    assert solved.weights.min() < 0.1
    found = propagate_distributions(solved, trials=50_000, seed=8)
    u = budget_of(solved).standard_uncertainties
    np.testing.assert_allclose(found.standard_uncertainties / u, 1, atol=0.02)
    # the blunder's pull on the mean would be some u
    assert (np.abs(found.mean - solved.values) < 0.05 * u).all()


def test_certified_noise_scale():
    """As a scale: 0.002 °/h of noise per position is about 100 ppm of K at 56°."""
    setup = Setup(latitude=56.0, noise=0.002, u_given=True)
    found = calibrate(setup.observe(np.random.default_rng(1)), "least-squares")
    drawn = propagate_distributions(found.solved["least-squares"], trials=20_000)
    assert drawn.standard_uncertainties[0] / truth()[0] == pytest.approx(1e-4, rel=0.25)
    assert drawn.standard_uncertainties[4] < 0.002 * DEG_PER_H
