from dataclasses import replace

import numpy as np
import pytest

from solver.calibrate import calibrate
from solver.inputs import CommonUncertainty, inputs_of
from solver.propagation.budget import CORRELATION, SCATTER, make_budget
from solver.records import PARAMETERS
from tests.solver.sessions import DEG_PER_H, LAB, Setup, truth

ARCSEC = np.pi / 180 / 3600
EVERYTHING = {
    "gain_x": 2e-5, "gain_y": 3e-5, "offset_x": 2e-9, "offset_y": 1e-9, "alpha": 2 * ARCSEC, "beta": 3 * ARCSEC,
    "gamma": 4 * ARCSEC, "level_1": 2 * ARCSEC, "level_2": 2 * ARCSEC, "azimuth": 20 * ARCSEC,
    "latitude": 5 * ARCSEC, "gravity": 1e-5, "temperature": 0.1,
}  # fmt: skip
COEFFICIENTS = {"kx": 1e-4 * truth()[0], "w0x": 1e-2 * LAB[4]}


def session(rng, angle=2.0, **changes):
    observations = Setup(**{"noise": 0.005, "u_given": True, **changes}).observe(rng)
    u = np.full(len(observations), angle * ARCSEC)
    return replace(observations, u_alpha=u, u_beta=2 * u, u_gamma=3 * u)


def linearised(observations, common=None):
    return calibrate(observations, "least-squares", common).solved["least-squares"].linearise()


def test_lines_of_every_input(rng):
    common = CommonUncertainty.of(EVERYTHING, temperature_coefficients=COEFFICIENTS)
    at = linearised(session(rng), common)
    budget = make_budget(at.gain, at.inputs)
    assert budget.lines == (
        "currents", "angles", "ammeter-gain", "ammeter-offset", "angles-common", "level", "azimuth", "latitude",
        "gravity", "temperature",
    )  # fmt: skip
    np.testing.assert_allclose(budget.shares.sum(axis=0), 1, rtol=1e-12)  # rounding
    np.testing.assert_allclose(np.sum(budget.standard**2, axis=0), np.diagonal(budget.covariance), rtol=1e-12)
    assert budget.basis == "given"
    # nothing but the currents' noise limits K; the azimuth moves only what the north component shows
    assert budget.dominating[0] == "currents"


def test_a_line_is_what_its_input_alone_gives(rng):
    common = CommonUncertainty.of(EVERYTHING, temperature_coefficients=COEFFICIENTS)
    observations = session(rng)
    at = linearised(observations, common)
    budget = make_budget(at.gain, at.inputs)
    members = {
        "ammeter-gain": ("gain_x", "gain_y"),
        "azimuth": ("azimuth",),
        "angles-common": ("alpha", "beta", "gamma"),
    }
    certain = replace(observations, u_jx=None, u_jy=None, u_alpha=0 * observations.theta, u_beta=0 * observations.theta,
                      u_gamma=0 * observations.theta)  # fmt: skip
    for line, names in members.items():
        alone = inputs_of(
            certain, at.values, CommonUncertainty.of({name: EVERYTHING[name] for name in names})
        )
        u = make_budget(at.gain, alone).standard_uncertainties
        np.testing.assert_allclose(budget.standard[budget.lines.index(line)], u, rtol=1e-10)  # rounding


def test_an_ammeters_gain_is_the_scale_factors(rng):
    """J·(1 + g) with K/(1 + g) is the same session: u(Kx) is Kx·u(g) to first order, and nothing else moves."""
    common = CommonUncertainty.of({"gain_x": 1e-4})
    at = linearised(session(rng, 0.0, noise=1e-6), common)
    budget = make_budget(at.gain, at.inputs)
    kx, _, _, kyx = at.values[:4]
    line = budget.standard[budget.lines.index("ammeter-gain")] / LAB
    expected = np.array([abs(kx), 0, 0, abs(kyx), 0, 0, 0, 0]) * 1e-4 / LAB
    # the noise of 1e-6 °/h leaves residuals that the gain scales: 1e-4 of it
    np.testing.assert_allclose(line, expected, rtol=1e-6, atol=1e-9)


def test_correlation_between_lines_has_its_own(rng):
    standard = {"azimuth": 20 * ARCSEC, "latitude": 20 * ARCSEC}
    apart, linked = (
        CommonUncertainty.of(standard, correlation={("azimuth", "latitude"): r}) for r in (0.0, 0.9)
    )  # fmt: skip
    observations = session(rng)
    without, with_it = (
        make_budget(at.gain, at.inputs) for at in (linearised(observations, c) for c in (apart, linked))
    )
    assert CORRELATION not in without.lines
    assert with_it.lines[-1] == CORRELATION
    np.testing.assert_allclose(with_it.shares.sum(axis=0), 1, rtol=1e-12)
    assert np.isnan(with_it.standard[-1]).all()
    assert CORRELATION not in with_it.dominating
    change = np.diagonal(with_it.covariance) - np.diagonal(without.covariance)
    # rounding of the variances, of which the change is a small part
    atol = 1e-12 * np.diagonal(without.covariance)
    np.testing.assert_array_less(
        np.abs(with_it.shares[-1] * np.diagonal(with_it.covariance) - change), atol + 1e-9 * np.abs(change)
    )


def test_correlation_within_a_line_stays_in_it(rng):
    common = CommonUncertainty.of(EVERYTHING, correlation={("gain_x", "gain_y"): 0.9})
    at = linearised(session(rng), common)
    assert CORRELATION not in make_budget(at.gain, at.inputs).lines


def test_scatter_is_a_line_with_the_fits_degrees_of_freedom(rng):
    observations = session(rng, u_given=False)
    found = calibrate(observations, "least-squares")
    estimate, at = found.least_squares, found.solved["least-squares"].linearise()
    budget = make_budget(at.gain, at.inputs, scatter=at.scatter, scatter_dof=at.scatter_dof)
    assert budget.basis == "scatter"
    assert budget.lines == (SCATTER,)  # the angles' random errors scatter too
    np.testing.assert_allclose(budget.covariance, estimate.covariance, rtol=1e-9, atol=0)
    np.testing.assert_allclose(budget.dof, 32 - 8)
    np.testing.assert_allclose(budget.coverage_factors, 2.0639, atol=5e-5)  # Student's t, 24, 95 %: tables
    assert set(budget.dominating) == {SCATTER}


def test_scatter_with_what_is_common(rng):
    common = CommonUncertainty.of({"latitude": 60 * ARCSEC})
    at = linearised(session(rng, u_given=False), common)
    budget = make_budget(at.gain, at.inputs, scatter=at.scatter, scatter_dof=at.scatter_dof)
    assert budget.lines == (SCATTER, "latitude")
    share = budget.shares[0]
    np.testing.assert_allclose(budget.dof, 24 / share**2, rtol=1e-9)  # G.2b: only the scatter's ν is finite


def test_angles_of_repeated_positions_are_kept_beside_the_scatter(rng):
    observations = session(rng, u_given=False, repeats=2)
    found = calibrate(observations, "least-squares")
    at = found.solved["least-squares"].linearise()
    budget = make_budget(at.gain, at.inputs, scatter=at.scatter, scatter_dof=at.scatter_dof)
    assert budget.lines == (SCATTER, "angles")
    np.testing.assert_allclose(budget.covariance, found.least_squares.covariance, rtol=1e-9, atol=0)


def test_scatter_takes_the_place_of_a_stated_noise(rng):
    """Inputs that tell u(J) too: the currents' noise is counted once, by what the residuals show."""
    at = linearised(session(rng))
    scatter = (0.01 * DEG_PER_H) ** 2 * np.eye(32)
    budget = make_budget(at.gain, at.inputs, scatter=scatter, scatter_dof=24)
    assert budget.lines == (SCATTER,)
    u = np.sqrt(np.diagonal(at.gain @ scatter @ at.gain.T))
    np.testing.assert_allclose(budget.standard_uncertainties, u, rtol=1e-12)  # rounding


@pytest.mark.parametrize("dof", [3.0, 50.0])
def test_degrees_of_freedom_of_the_currents(rng, dof):
    observations = session(rng, 0.0)
    observations = replace(observations, dof_jx=np.full(16, dof), dof_jy=np.full(16, dof))
    at = linearised(observations)
    budget = make_budget(at.gain, at.inputs)
    components = at.gain @ at.inputs.sensitivity * np.sqrt(np.diagonal(at.inputs.covariance))
    expected = np.sum(components**2, axis=1) ** 2 / np.sum(components**4 / dof, axis=1)  # (G.2b)
    np.testing.assert_allclose(budget.dof, expected, rtol=1e-12)
    assert (budget.dof > dof).all()
    np.testing.assert_allclose(budget.expanded, budget.coverage_factors * budget.standard_uncertainties)


def test_parameters_that_are_not_determined_stay_blank(rng):
    at = linearised(session(rng))
    gain = at.gain.copy()
    gain[6] = np.nan
    budget = make_budget(gain, at.inputs)
    assert budget.dominating[6] is None
    assert np.isnan(budget.shares[:, 6]).all()
    assert np.isfinite(np.delete(budget.expanded, 6)).all()
    assert len(budget.dominating) == len(PARAMETERS)


def test_nothing_uncertain(rng):
    observations = session(rng, 0.0, u_given=False)
    at = linearised(observations)
    budget = make_budget(at.gain, at.inputs)
    assert budget.lines == ()
    assert set(budget.dominating) == {None}
