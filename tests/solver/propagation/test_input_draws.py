from dataclasses import replace

import numpy as np
import pytest
from scipy import stats
from scipy.spatial.transform import Rotation

from solver.error_model import scale_matrix
from solver.inputs import COMMON, CommonUncertainty, inputs_of
from solver.propagation.input_draws import Errors, input_draws
from tests.solver.propagation.test_budget import ARCSEC, COEFFICIENTS, EVERYTHING, session
from tests.solver.sessions import DEG_PER_H, Setup, grid, truth

EARTH = 7.292115e-5


def everything(**changes):
    return CommonUncertainty.of({**EVERYTHING, **changes}, temperature_coefficients=COEFFICIENTS)


def back(axis, angle):
    """A vector turned backwards is the frame turned forwards."""
    return Rotation.from_rotvec(-np.atleast_1d(angle)[:, None] * np.eye(3)[axis])


def independent(at, errors, draw):
    """Features and rates of one draw by scipy's rotations, vector by vector."""
    common = dict(zip(COMMON, errors.common[:, draw], strict=True))
    alpha, beta, gamma = (
        getattr(at, name) + errors.angles[axis, :, draw] + common[name]
        for axis, name in enumerate(("alpha", "beta", "gamma"))
    )
    base = back(2, common["azimuth"]) * back(1, common["level_2"]) * back(0, common["level_1"])
    turn = back(2, gamma) * back(1, beta) * back(0, alpha) * back(2, at.psi) * back(0, at.theta) * base
    latitude = at.latitude + common["latitude"]
    earth = turn.apply([0.0, EARTH * np.cos(latitude), EARTH * np.sin(latitude)])
    up = turn.apply([0.0, 0.0, 1.0]) * (1 + common["gravity"])
    jx = (at.jx + errors.currents[0, :, draw]) * (1 + common["gain_x"]) + common["offset_x"]
    jy = (at.jy + errors.currents[1, :, draw]) * (1 + common["gain_y"]) + common["offset_y"]
    return np.stack((jx, jy, up[:, 0], up[:, 1])), earth[:, :2].T


@pytest.mark.parametrize("size", [1.0, 3e4])
def test_orientations_and_rates_by_independent_rotations(rng, size):
    """Also for angles of tens of degrees: nothing is linearised."""
    angles = {
        name: size * EVERYTHING[name] for name in ("alpha", "beta", "gamma", "level_1", "level_2", "azimuth")
    }
    observations = session(rng, 2.0 * size, misalignment=20.0 * size)
    inputs = input_draws(observations, truth(), everything(**angles))
    errors = inputs.errors(rng, 7)
    drawn = inputs.apply(errors)
    for draw in range(7):
        features, rates = independent(observations, errors, draw)
        np.testing.assert_allclose(drawn.features[:2, :, draw], features[:2], rtol=1e-14)  # rounding
        np.testing.assert_allclose(drawn.features[2:, :, draw], features[2:], atol=1e-14)
        np.testing.assert_allclose(drawn.rates[..., draw], rates, atol=1e-14 * EARTH)
    np.testing.assert_array_equal(drawn.temperature, errors.common[COMMON.index("temperature")])


@pytest.mark.parametrize("certain", ["angles", "base", "latitude", "gravity", "gain_x", "currents", "all"])
def test_certain_inputs_are_left_alone(rng, certain):
    """What is certain is skipped; the result is that of its errors being zero."""
    observations, standard = session(rng), dict(EVERYTHING)
    none = np.zeros(16)
    gone = {"base": ("level_1", "level_2", "azimuth"), "all": tuple(EVERYTHING)}.get(certain, (certain,))
    if certain in ("angles", "all"):
        observations = replace(observations, u_alpha=none, u_beta=none, u_gamma=none)
    if certain in ("currents", "all"):
        observations = replace(observations, u_jx=None, u_jy=None)
    if certain == "angles":
        gone = ("alpha", "beta", "gamma")
    common = CommonUncertainty.of({name: u for name, u in standard.items() if name not in gone})
    inputs = input_draws(observations, truth(), common)
    errors = inputs.errors(rng, 3)
    drawn = inputs.apply(errors)
    filled = Errors(
        currents=np.zeros((2, 16, 3)) if errors.currents is None else errors.currents,
        angles=np.zeros((3, 16, 3)) if errors.angles is None else errors.angles,
        common=errors.common,
    )
    for name in gone:
        if name in COMMON:
            assert not errors.common[COMMON.index(name)].any()
    for draw in range(3):
        features, rates = independent(observations, filled, draw)
        np.testing.assert_allclose(
            drawn.features[..., draw], features, rtol=1e-13, atol=1e-14 * features.max()
        )
        np.testing.assert_allclose(drawn.rates[..., draw], rates, atol=1e-14 * EARTH)


def test_first_order_is_that_of_the_budgets_inputs(rng):
    """Small errors change the residuals by S·δz of `solver.inputs`, with its signs."""
    observations, values = session(rng), truth()
    common = everything()
    inputs = input_draws(observations, values, common)
    errors = inputs.errors(rng, 5)
    shrunk = Errors(1e-3 * errors.currents, 1e-3 * errors.angles, 1e-3 * errors.common)
    budget = inputs_of(observations, values, common)
    assert list(budget.source[:32]) == ["currents"] * 32
    assert list(budget.source[32:80]) == ["angles"] * 48
    z = np.concatenate((shrunk.currents.transpose(1, 0, 2).reshape(32, -1),
                        shrunk.angles.transpose(1, 0, 2).reshape(48, -1), shrunk.common))  # fmt: skip
    expected = budget.sensitivity @ z

    def residuals(drawn):
        kx, ky, kxy, kyx, w0x, w0y, wg, wk = values
        jx, jy, c, d = drawn.features
        q = np.multiply.outer(common.temperature_coefficients, drawn.temperature)
        x = drawn.rates[0] - (kx + q[0]) * jx - kxy * jy - (w0x + q[4]) - wg * c + wk * d
        y = drawn.rates[1] - kyx * jx - ky * jy - w0y - wk * c - wg * d
        return np.stack((x, y), axis=1).reshape(32, -1)

    none = Errors(0 * errors.currents, 0 * errors.angles, 0 * errors.common)
    found = residuals(inputs.apply(shrunk)) - residuals(inputs.apply(none))
    # second order: 1e-3·u of 20″ and of 1e-3 relative, that is 1e-7 of the first
    np.testing.assert_allclose(found, expected, rtol=1e-5, atol=1e-5 * np.abs(expected).max())


def test_covariance_of_the_drawn_errors(rng):
    """Stated u and correlations within 5 standard errors: 1/√(2m) of a variance, 1/√m of a covariance."""
    common = CommonUncertainty.of(
        EVERYTHING, correlation={("gain_x", "gain_y"): 0.8, ("azimuth", "latitude"): -1.0}
    )
    observations, m = session(rng), 40_000
    errors = input_draws(observations, truth(), common).errors(rng, m)
    u = np.stack((observations.u_alpha, observations.u_beta, observations.u_gamma))
    np.testing.assert_allclose(errors.angles.std(axis=2), u, rtol=5 / np.sqrt(2 * m))
    np.testing.assert_allclose(errors.currents.std(axis=2)[0], observations.u_jx, rtol=5 / np.sqrt(2 * m))
    standard = np.sqrt(np.diagonal(common.covariance))
    np.testing.assert_allclose(
        np.cov(errors.common / standard[:, None]), common.correlation, atol=5 * np.sqrt(2 / m)
    )
    azimuth, latitude = (errors.common[COMMON.index(name)] for name in ("azimuth", "latitude"))
    np.testing.assert_allclose(
        azimuth / EVERYTHING["azimuth"], -latitude / EVERYTHING["latitude"], rtol=1e-6, atol=1e-7
    )


def test_repeats_share_the_angles_and_not_the_noise(rng):
    observations = session(rng, repeats=2)
    errors = input_draws(observations, truth(), None).errors(rng, 4)
    pairs = np.lexsort((observations.repeat, observations.psi, observations.theta)).reshape(-1, 2)
    np.testing.assert_array_equal(errors.angles[:, pairs[:, 0]], errors.angles[:, pairs[:, 1]])
    assert len(np.unique(errors.angles)) == 3 * 16 * 4
    assert len(np.unique(errors.currents)) == 2 * 32 * 4
    assert not errors.common.any()


def test_one_position_measured_three_times(rng):
    """Only its rows share angles, wherever they stand."""
    positions = np.vstack((grid(), [(90, 180), (90, 180)]))
    setup = Setup(positions=positions, noise=0.005, u_given=True)
    observations = setup.observe(rng)
    u = np.full(18, 1e-5)
    observations = replace(observations, u_alpha=u, u_beta=u, u_gamma=u)
    angles = input_draws(observations, truth(), None).errors(rng, 1).angles[0, :, 0]
    same = np.isclose(observations.theta, np.pi / 2) & np.isclose(observations.psi, np.pi)
    assert same.sum() == 3
    assert len(np.unique(angles[same])) == 1
    assert len(np.unique(angles)) == 16


def test_finite_degrees_of_freedom_give_students_t(rng):
    """JCGM 101, 6.4.9: Kolmogorov-Smirnov against the scaled t; normal would be refused."""
    observations = replace(session(rng, 0.0), dof_jx=np.full(16, 3.0))
    common = CommonUncertainty.of({"azimuth": 1e-4, "latitude": 1e-5}, dof={"azimuth": 4.0})
    errors = input_draws(observations, truth(), common).errors(rng, 20_000)
    t = errors.currents[0, 0] / observations.u_jx[0]
    assert stats.kstest(t, stats.t(3).cdf).pvalue > 1e-3
    assert stats.kstest(t, stats.norm.cdf).pvalue < 1e-6
    assert stats.kstest(errors.currents[1, 0] / observations.u_jy[0], stats.norm.cdf).pvalue > 1e-3
    assert stats.kstest(errors.common[COMMON.index("azimuth")] / 1e-4, stats.t(4).cdf).pvalue > 1e-3
    assert stats.kstest(errors.common[COMMON.index("latitude")] / 1e-5, stats.norm.cdf).pvalue > 1e-3


def test_correlated_inputs_are_stretched_together(rng):
    """One χ² for both: fully correlated inputs stay fully correlated in the tails."""
    common = CommonUncertainty.of(
        {"gain_x": 1e-4, "gain_y": 1e-4},
        correlation={("gain_x", "gain_y"): 1.0},
        dof={"gain_x": 3.0, "gain_y": 3.0},
    )
    errors = input_draws(session(rng), truth(), common).errors(rng, 5_000)
    gain_x, gain_y = errors.common[0], errors.common[1]
    np.testing.assert_allclose(gain_x, gain_y, rtol=1e-6, atol=1e-12)
    assert stats.kstest(gain_x / 1e-4, stats.t(3).cdf).pvalue > 1e-3


def test_scatter_is_drawn_as_noise_of_the_rates(rng):
    """Currents' errors times K have the scatter's variance in each equation, t-distributed, jointly."""
    observations, values = session(rng, u_given=False), truth()
    s, dof = 0.004 * DEG_PER_H, 24.0
    errors = input_draws(observations, values, None, scatter=(s**2, dof)).errors(rng, 20_000)
    assert errors.angles is None  # they scatter too
    rates = np.einsum("ab,bnm->anm", scale_matrix(values), errors.currents) / s
    assert stats.kstest(rates[0, 3], stats.t(dof).cdf).pvalue > 1e-3
    assert stats.kstest(rates[1, 9], stats.t(dof).cdf).pvalue > 1e-3
    # the common χ² of a draw: its 32 squares sum to 32·F(32, 24)
    assert stats.kstest((rates**2).mean(axis=(0, 1)), stats.f(32, dof).cdf).pvalue > 1e-3
    repeated = input_draws(session(rng, u_given=False, repeats=2), values, None, scatter=(s**2, dof))
    assert repeated.errors(rng, 1).angles is not None


def test_inflation_widens_what_differs_from_position_to_position(rng):
    observations = session(rng)
    one, two = (input_draws(observations, truth(), everything(), inflation=f) for f in (1.0, 2.0))
    first, second = one.errors(np.random.default_rng(1), 2), two.errors(np.random.default_rng(1), 2)
    np.testing.assert_allclose(second.currents, 2 * first.currents)
    np.testing.assert_allclose(second.angles, 2 * first.angles)
    np.testing.assert_array_equal(second.common, first.common)


def test_angles_in_arcsec_move_rates_as_stated(rng):
    """As a scale: 1′ of azimuth turns the horizontal Earth rate by 8.46 °/h·2.9e-4 = 0.0025 °/h at 56°."""
    setup = Setup(latitude=56.0, misalignment=0.0)
    inputs = input_draws(setup.observe(rng), truth(), CommonUncertainty.of({"azimuth": 60 * ARCSEC}))
    common = np.zeros((13, 1))
    common[COMMON.index("azimuth")] = 60 * ARCSEC
    still = Errors(None, None, np.zeros((13, 1)))
    change = inputs.apply(Errors(None, None, common)).rates - inputs.apply(still).rates
    assert np.abs(change).max() / DEG_PER_H == pytest.approx(0.00245, abs=2e-5)
