"""The base's attitude: against full solutions with a turned base, the simulator's own geometry, and noise."""

from dataclasses import replace

import numpy as np
import pytest

from simdevice.bench import mean_currents
from simdevice.certificate import draw_certificate, sixteen_positions
from simdevice.scenarios import scenario
from simdevice.stand import Stand as TrueStand
from solver.error_model import (
    Equations,
    currents,
    design_matrix,
    earth_rate,
    observation_equations,
    right_side,
)
from solver.estimators.batch import Stand
from solver.estimators.estimation import least_squares, paper
from solver.estimators.robust import robust
from solver.estimators.stand_attitude import level_east_signature, stand_attitude, turns_of_sessions
from solver.geometry import base, elements_of
from solver.inputs import COMMON, CommonUncertainty, by_common
from solver.records import Observations
from tests.solver.sessions import DEG_PER_H, LAB, Setup, grid, truth

ARCMIN = np.pi / 180 / 60
TURNS = {"level_1": (ARCMIN, 0.0, 0.0), "level_2": (0.0, ARCMIN, 0.0), "azimuth": (0.0, 0.0, ARCMIN)}


def on_base(setup, angles, rng, noise=0.0):
    """A session on a base turned by `angles`, of which its observations know nothing."""
    session = setup.observe(rng)
    jx, jy = currents(setup.parameters, elements_of(session, base(*angles)), session.latitude)
    error = noise * setup.u_current * rng.standard_normal((2, len(jx)))
    return replace(session, jx=jx + error[0], jy=jy + error[1])


def solved(session, estimator=least_squares):
    return estimator(observation_equations(session), session)


def resolved_on(session, angles):
    """Least squares as if the base were known to be turned."""
    here = elements_of(session, base(*angles))
    equations = Equations(
        design_matrix(here, session.jx, session.jy),
        right_side(here, *earth_rate(session.latitude)),
        observation_equations(session).u_currents,
    )
    return least_squares(equations, None).estimate


@pytest.mark.parametrize("turn", ["level_2", "azimuth"])
@pytest.mark.parametrize("given", [True, False], ids=["u", "no-u"])
def test_a_turn_is_found_and_changes_no_parameter(turn, given, rng):
    setup = Setup(noise=0.005, u_given=given)
    found = solved(on_base(setup, TURNS[turn], rng))
    attitude = stand_attitude(found)
    value = attitude.azimuth if turn == "azimuth" else attitude.level_north
    # Second order: 1′ of 1 rad, times the tens of arcseconds of the certified angles.
    assert value == pytest.approx(ARCMIN, rel=1e-6)
    # Only through the certified angles of 20″ (1e-4 rad) does 1′ of 10 °/h show in a parameter: 3e-7 °/h.
    u = solved(Setup(noise=0.005, u_given=True).observe(rng)).estimate.standard_uncertainties
    assert np.abs((found.values - setup.parameters) / u).max() < 2e-3


@pytest.mark.parametrize("turn", ["level_2", "azimuth"])
def test_it_is_the_turn_of_least_chi_square_of_full_solutions(turn, rng):
    setup = Setup(noise=0.005, u_given=True)
    session = on_base(setup, TURNS[turn], rng, noise=1.0)
    unit = np.array(TURNS[turn])
    chi2 = [resolved_on(session, size * unit).fit.chi2 for size in (-2.0, 0.0, 2.0)]
    # The parabola through three full solutions.
    curvature, slope = (chi2[0] - 2 * chi2[1] + chi2[2]) / 8.0, (chi2[2] - chi2[0]) / 4.0
    attitude = stand_attitude(solved(session))
    found, u = (
        (attitude.azimuth, attitude.u_azimuth)
        if turn == "azimuth"
        else (attitude.level_north, attitude.u_level_north)
    )
    # Minutes of arc squared are left out, and the weights' K differs by its own noise: 1e-3 each.
    assert found == pytest.approx(-slope / (2 * curvature) * ARCMIN, abs=3e-3 * u)
    assert u == pytest.approx(ARCMIN / np.sqrt(curvature), rel=3e-3)


@pytest.mark.parametrize("number", range(3))
def test_the_simulators_own_geometry_agrees_in_sign_and_size(number):
    quiet = scenario("quiet").bench(5)
    angles = [0.0, 0.0, 0.0]
    angles[number] = ARCMIN
    stand = replace(quiet.stand, base=tuple(angles))
    means = mean_currents(replace(quiet, stand=stand), sixteen_positions())
    alpha, beta, gamma = stand.certificate.angles.T
    session = Observations.sorted_from(
        theta=means.theta, psi=means.psi, alpha=alpha, beta=beta, gamma=gamma, jx=means.jx, jy=means.jy,
        latitude=stand.latitude, u_jx=np.full(16, 1e-9), u_jy=np.full(16, 1e-9),
    )  # fmt: skip
    found = solved(session)
    attitude = stand_attitude(found)
    change = found.values - quiet.gyro.values
    if number == 0:
        assert abs(attitude.azimuth) < 1e-9 * ARCMIN
        assert abs(attitude.level_north) < 1e-9 * ARCMIN
        # The signature is to first order, a second is (ε·V/N)² ≈ 4e-4 of it.
        np.testing.assert_allclose(change, attitude.level_east * ARCMIN, rtol=2e-3)
    else:
        value = (attitude.level_north, attitude.azimuth)[number - 1]
        # ε² once more.
        assert value == pytest.approx(ARCMIN, rel=3e-6)


@pytest.mark.parametrize("size", [ARCMIN, 0.1, -0.5], ids=["arcminute", "6-degrees", "-29-degrees"])
@pytest.mark.parametrize("estimator", [least_squares, paper, robust])
def test_a_turn_about_east_of_any_size_hides_exactly(size, estimator, rng):
    setup = Setup(noise=0.005, u_given=True)
    session = on_base(setup, (size, 0.0, 0.0), rng)
    found = solved(session, estimator)
    # Rounding of rates of 7e-5 rad/s; the paper's iteration ends at 1e-12.
    assert np.abs(found.estimate.residuals).max() < 1e-10 * 7.3e-5
    kx, ky, kxy, kyx, w0x, w0y, wg, wk = setup.parameters
    north, up = earth_rate(session.latitude)
    rest = up - (wg + 1j * wk)
    factor = north / (north * np.cos(size) + rest * np.sin(size))
    g = up - factor * (rest * np.cos(size) - north * np.sin(size))
    of_jx, of_jy, bias = factor * (kx + 1j * kyx), factor * (kxy + 1j * ky), factor * (w0x + 1j * w0y)
    expected = [of_jx.real, of_jy.imag, of_jy.real, of_jx.imag, bias.real, bias.imag, g.real, g.imag]
    # Condition of the session, some hundreds, times the ends above.
    np.testing.assert_allclose(found.values, expected, rtol=1e-8)


def test_the_signature_is_the_derivative_of_the_estimate(rng):
    setup = Setup(noise=0.0)
    session = setup.observe(rng)
    found = solved(session)
    by_east = by_common(session, setup.parameters, CommonUncertainty())[:, COMMON.index("level_1")]
    # Residuals at the truth are −s·ε, and the estimate moves by its gain times them.
    expected = -found.gain @ by_east
    signature = level_east_signature(setup.parameters, session.latitude)
    np.testing.assert_allclose(signature / LAB, expected / LAB, rtol=1e-9, atol=1e-6)
    many = level_east_signature(np.stack((setup.parameters, truth(wg=0.0))), session.latitude)
    np.testing.assert_array_equal(many[0], signature)
    assert np.isnan(level_east_signature(setup.parameters, np.pi / 2)).all()


def test_over_many_sessions_it_is_as_uncertain_as_it_says(rng):
    setup, sessions = Setup(noise=0.005, u_given=True, misalignment=20.0), 200
    rows = [solved(on_base(setup, (0.0, ARCMIN, -ARCMIN), rng, noise=1.0)) for _ in range(sessions)]
    found = [stand_attitude(row) for row in rows]
    z = np.array([(one.level_north / one.u_level_north, one.azimuth / one.u_azimuth) for one in found])
    one = found[0]
    # Each as if the other were zero: the other's part adds by the correlation.
    u = np.array([one.u_level_north, one.u_azimuth])
    turns = np.array([1.0, -1.0]) * ARCMIN / u
    expected = turns + one.correlation * turns[::-1]
    # Means of 200 unit normals, and their variances: 3.9 standard deviations, 1e-4 each.
    assert np.abs(z.mean(axis=0) - expected).max() < 3.9 / np.sqrt(sessions) + 1e-3 * np.abs(expected).max()
    assert np.abs(z.var(axis=0) - 1.0).max() < 3.9 * np.sqrt(2.0 / sessions)
    error = 3.9 * (1 - one.correlation**2) / np.sqrt(sessions)
    assert np.corrcoef(z.T)[0, 1] == pytest.approx(one.correlation, abs=error)


def test_without_u_the_scatter_tells_it_with_two_degrees_fewer(rng):
    session = on_base(Setup(noise=0.005, u_given=True, repeats=4), TURNS["azimuth"], rng, noise=1.0)
    known = stand_attitude(solved(session))
    found = stand_attitude(solved(replace(session, u_jx=None, u_jy=None)))
    assert known.dof == np.inf
    assert found.dof == 128 - 8 - 2
    # χ² with 118 degrees of freedom: u to 6.5 %, three of them.
    assert found.u_azimuth == pytest.approx(known.u_azimuth, rel=0.2)
    assert found.azimuth == pytest.approx(known.azimuth, abs=0.1 * known.u_azimuth)


@pytest.mark.parametrize(
    ("positions", "seen"),
    [
        (grid((0, 90)), False),
        (grid((0, 90), (0, 120, 240)), False),
        (grid((0, 180)), True),
        (grid((0, 45, 90, 135, 180, 225, 270, 315)), True),
    ],
    ids=["the-papers-eight", "six", "upright-and-upside-down", "32"],
)
def test_positions_that_show_no_turn_say_so(positions, seen, rng):
    setup = Setup(noise=0.005, u_given=True, positions=positions)
    found = stand_attitude(solved(on_base(setup, TURNS["azimuth"], rng, noise=1.0)))
    values = [found.azimuth, found.u_azimuth, found.level_north, found.u_level_north, found.correlation]
    assert np.isfinite(values).all() if seen else np.isnan(values).all()


def test_no_scale_factor_no_attitude(rng):
    setup = Setup(noise=0.005, u_given=True, positions=grid((0, 90, 180, 270), (0, 180)))
    assert stand_attitude(solved(setup.observe(rng))) is None


def test_what_is_not_determined_has_no_signature(rng):
    setup = Setup(noise=0.005, u_given=True, positions=grid((0,)))
    found = solved(setup.observe(rng))
    blank = np.isnan(found.estimate.values)
    assert blank.any()
    np.testing.assert_array_equal(np.isnan(stand_attitude(found).level_east), blank)


def test_the_certificates_angles_give_an_uncertainty_of_its_own(rng):
    """Drawn certificate errors scatter the attitude by what is stated."""
    spread, common, sessions = 20 / 3600 * np.pi / 180, 10 / 3600 * np.pi / 180, 60
    setup = Setup(noise=0.005, u_given=True)
    places = sixteen_positions()
    certificate = draw_certificate(3, u_random=spread, u_systematic=common)
    bench = scenario("quiet").bench(5)
    errors = []
    for seed in range(sessions):
        means = mean_currents(
            replace(bench, stand=TrueStand(bench.stand.latitude, certificate, seed=seed)), places
        )
        alpha, beta, gamma = certificate.angles.T
        u = np.full(16, setup.u_current)
        session = Observations.sorted_from(
            theta=means.theta, psi=means.psi, alpha=alpha, beta=beta, gamma=gamma, jx=means.jx, jy=means.jy,
            latitude=bench.stand.latitude, u_jx=u, u_jy=u,
            u_alpha=np.full(16, spread), u_beta=np.full(16, spread), u_gamma=np.full(16, spread),
        )  # fmt: skip
        stated = CommonUncertainty.of({"alpha": common, "beta": common, "gamma": common, "latitude": 1e-3})
        found = stand_attitude(least_squares(observation_equations(session), session, stated))
        errors.append((found.level_north, found.azimuth) / found.u_certificate)
    # χ² with 60 degrees of freedom: 3.9 standard deviations.
    assert np.mean(np.square(errors), axis=0) == pytest.approx(1.0, abs=3.9 * np.sqrt(2 / sessions))


def test_a_batch_gives_what_single_sessions_give(rng):
    setup = Setup(noise=0.005, u_given=True)
    sessions = [on_base(setup, (0.0, ARCMIN, ARCMIN), rng, noise=1.0) for _ in range(20)]
    single = [solved(one) for one in sessions]
    attitudes = [stand_attitude(one) for one in single]
    first = sessions[0]
    found = turns_of_sessions(
        Stand(first.theta, first.psi, first.latitude),
        np.array([np.column_stack((one.alpha, one.beta, one.gamma)) for one in sessions]),
        (np.array([one.jx for one in sessions]), np.array([one.jy for one in sessions])),
        (first.u_jx, first.u_jy),
        np.array([one.values for one in single]),
    )
    # One formula, summed in another order.
    np.testing.assert_allclose(found.value, [(one.level_north, one.azimuth) for one in attitudes], rtol=1e-8)
    np.testing.assert_allclose(found.u, [(one.u_level_north, one.u_azimuth) for one in attitudes], rtol=1e-8)
    np.testing.assert_allclose(found.correlation, [one.correlation for one in attitudes], rtol=1e-8)


def test_the_figures_of_a_usual_session(rng):
    """The eastward vector is (cos ψ, −sin ψ) in every position, and nothing explains it: u = σ/(N·√16)."""
    setup = Setup(noise=0.005, u_given=True)
    found = stand_attitude(solved(setup.observe(rng)))
    north, up = earth_rate(np.radians(setup.latitude))
    wg, wk = setup.parameters[6:]
    # The noise is one of the currents, by the factor of x: that of y is 1 % smaller.
    assert found.u_azimuth == pytest.approx(0.005 * DEG_PER_H / (north * 4), rel=1e-2)
    # Both turns show in the same places, by their rates N and −(V − g): so does their correlation.
    rest = up - wg - 1j * wk
    assert found.u_azimuth / found.u_level_north == pytest.approx(abs(rest) / north, rel=1e-3)
    assert found.correlation == pytest.approx(-rest.real / abs(rest), abs=1e-3)
