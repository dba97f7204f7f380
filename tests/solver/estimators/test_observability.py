"""What cannot be found is named, with noise and without; what can be found is not."""

from dataclasses import fields

import numpy as np
import pytest

from solver.calibrate import calibrate
from solver.error_model import observation_equations
from solver.estimators.observability import find_invisible, lab_units
from solver.records import PARAMETERS, Estimate, Failure, Observations
from tests.solver.sessions import DEG_PER_H, Setup, grid, truth

NOISE = 0.005


def unobservable(estimate: Estimate) -> list[str]:
    return [warning.text for warning in estimate.warnings if warning.code == "unobservable"]


def blank(estimate: Estimate) -> set[str]:
    """Parameters without a value; nothing of their covariance may be given either."""
    missing = np.isnan(estimate.values)
    assert np.isnan(estimate.covariance[missing]).all()
    assert np.isnan(estimate.covariance[:, missing]).all()
    named = {name for name, gone in zip(PARAMETERS, missing, strict=True) if gone}
    told = "".join(unobservable(estimate))
    assert all(name in told for name in named)
    assert bool(named) == bool(told)
    return named


def stated(setup: Setup, rng: np.random.Generator, u: float) -> Observations:
    """A session with an uncertainty stated in °/h, whatever its noise."""
    observations = setup.observe(rng)
    columns = {item.name: getattr(observations, item.name) for item in fields(observations)}
    u_current = np.full(len(observations), u * DEG_PER_H / abs(setup.parameters[0]))
    return Observations.sorted_from(**{**columns, "u_jx": u_current, "u_jy": u_current})


@pytest.mark.parametrize("latitude", [90.0, -90.0, 89.99, -89.99, 89.95])
@pytest.mark.parametrize("u_given", [True, False])
def test_at_and_near_a_pole_noise_does_not_pass_for_information(latitude, u_given):
    for seed in range(20):
        setup = Setup(latitude=latitude, noise=NOISE, u_given=u_given)
        result = calibrate(setup.observe(np.random.default_rng(seed)))
        assert blank(result.least_squares) == set(PARAMETERS)
        assert result.least_squares.fit.rank == 6
        if isinstance(result.paper, Failure):
            assert result.paper.message.code == "unobservable"
        else:
            assert blank(result.paper) == set(PARAMETERS)


@pytest.mark.parametrize("misalignment", [0.0, 20.0, 3600.0])
@pytest.mark.parametrize("latitude", [90.0, -90.0])
def test_at_a_pole_without_noise(latitude, misalignment, rng):
    setup = Setup(latitude=latitude, misalignment=misalignment)
    for observations in (setup.observe(rng), stated(setup, rng, NOISE)):
        result = calibrate(observations)
        assert blank(result.least_squares) == set(PARAMETERS)
        assert isinstance(result.paper, Failure) or blank(result.paper) == set(PARAMETERS)


def test_the_invisible_combination_at_a_pole_is_the_true_one(rng):
    """K·t, ω0·t, ωв + (ωg − ωв)·t and ωк·t solve the equations for every t: so says the physics.

    A rotation of (x, y) as a whole stays invisible too; together they span two dimensions.
    """
    setup = Setup(latitude=90.0)
    invisible = find_invisible(observation_equations(setup.observe(rng)))
    expected = setup.parameters - np.array([0, 0, 0, 0, 0, 0, 7.292115e-5, 0])
    scale = np.abs(expected)
    basis = np.linalg.qr((invisible.directions / scale).T)[0]
    unit = np.sign(expected) / np.sqrt(8)
    assert len(invisible.directions) == 2
    np.testing.assert_allclose(basis @ (basis.T @ unit), unit, rtol=0, atol=1e-9)  # κ·ε ≈ 1e-13


@pytest.mark.parametrize("latitude", [89.9, -89.99])
def test_near_a_pole_exact_currents_still_determine_everything(latitude, rng):
    setup = Setup(latitude=latitude)
    estimate = calibrate(setup.observe(rng), "least-squares").least_squares
    assert blank(estimate) == set()
    # Rounding (1e-16) times the condition, about 1e4.
    np.testing.assert_allclose(estimate.values, setup.parameters, rtol=1e-9)
    # With a stated uncertainty that buries the horizontal Earth rate they do not.
    assert blank(calibrate(stated(setup, rng, 0.05), "least-squares").least_squares) == set(PARAMETERS)


def test_between_seen_and_buried_the_stated_uncertainty_stays_honest():
    """On the way to the pole a session is either blank or within its uncertainty.

    The bias just above the threshold is two thirds of u, so (estimate − truth)/u has a root mean
    square of √(1 + (2/3)²) = 1.2; 60 sessions let it scatter by 1/√120, of which four are allowed.
    """
    for latitude in (88.0, 89.0, 89.5, 89.65, 89.72, 89.8, 89.9):
        setup = Setup(latitude=latitude, noise=NOISE, u_given=True)
        errors = []
        for seed in range(60):
            estimate = calibrate(setup.observe(np.random.default_rng(seed)), "least-squares").least_squares
            if not blank(estimate):
                errors.append((estimate.values - setup.parameters) / estimate.standard_uncertainties)
        if len(errors) > 30:
            assert np.all(np.sqrt(np.mean(np.square(errors), axis=0)) < 1.2 + 4 / np.sqrt(120))
        assert latitude > 89.7 or len(errors) == 60
        assert latitude < 89.8 or not errors


WELL_DETERMINED = {
    "48°": Setup(latitude=48.0),
    "56°": Setup(latitude=56.0),
    "southern": Setup(latitude=-56.0),
    "equator": Setup(latitude=0.0),
    "80°": Setup(latitude=80.0),
    "degrees of misalignment": Setup(misalignment=2 * 3600.0),
    "negative scale factor": Setup(truth(kx=-2062.65)),
    "off the right angles": Setup(positions=(grid() + 13.7) % 360),
    "eight positions": Setup(positions=grid(thetas=(0, 90))),
    "no coupling": Setup(truth(kxy=0.0, kyx=0.0)),
    "no drift": Setup(truth(w0x=0.0, w0y=0.0, wg=0.0, wk=0.0)),
    "ωg equal to the vertical Earth rate": Setup(truth(wg=15.041067 * np.sin(np.radians(55.7558)))),
    "five positions": Setup(positions=np.array([(0, 0), (0, 90), (90, 0), (90, 90), (200, 160.0)])),
    "repeats": Setup(repeats=5),
    "noisy": Setup(noise=0.1),
}


@pytest.mark.parametrize("u_given", [True, False])
@pytest.mark.parametrize("name", WELL_DETERMINED)
def test_ordinary_sessions_are_not_flagged(name, u_given):
    setup = WELL_DETERMINED[name]
    columns = {item.name: getattr(setup, item.name) for item in fields(setup)}
    setup = Setup(**{**columns, "noise": setup.noise or NOISE, "u_given": u_given})
    for seed in range(10):
        result = calibrate(setup.observe(np.random.default_rng(seed)))
        assert blank(result.least_squares) == set()
        assert isinstance(result.paper, Failure) or blank(result.paper) == set()


@pytest.mark.parametrize("noise", [0.0, NOISE])
@pytest.mark.parametrize("u_given", [True, False])
@pytest.mark.parametrize("misalignment", [0.0, 10.0])
def test_one_row_of_theta_leaves_the_g_sensitive_drifts_unknown(noise, u_given, misalignment, rng):
    setup = Setup(positions=grid(thetas=(0,)), misalignment=misalignment, noise=noise)
    observations = stated(setup, rng, NOISE) if u_given else setup.observe(rng)
    estimate = calibrate(observations, "least-squares").least_squares
    assert blank(estimate) == {"wg", "wk"}
    assert estimate.fit.rank == 6
    # The others are found: within five standard uncertainties of about 2 °/h/mA and 0.01 °/h.
    error = np.abs(lab_units(estimate.values - setup.parameters))[:6]
    assert np.all(error < [10, 10, 10, 10, 0.05, 0.05])


@pytest.mark.parametrize("noise", [0.0, NOISE])
@pytest.mark.parametrize("u_given", [True, False])
@pytest.mark.parametrize(
    ("positions", "repeats", "rank"),
    [
        (np.array([(20.0, 10.0)]), 1, 2),
        (np.array([(20.0, 10.0)]), 8, 2),
        (np.array([(20.0, 10.0), (100.0, 200.0)]), 4, 4),
        (np.array([(20.0, 10.0), (100.0, 200.0), (180.0, 70.0)]), 1, 6),
        (np.array([(20.0, 10.0), (100.0, 200.0), (180.0, 70.0)]), 3, 6),
    ],
)
def test_too_few_positions_give_nothing(positions, repeats, rank, noise, u_given, rng):
    """k distinct positions give 2k equations for eight unknowns; repeats add none."""
    setup = Setup(positions=positions, repeats=repeats, noise=noise)
    observations = stated(setup, rng, NOISE) if u_given else setup.observe(rng)
    estimate = calibrate(observations, "least-squares").least_squares
    assert blank(estimate) == set(PARAMETERS)
    assert estimate.fit.rank == rank
    assert estimate.fit.dof == 2 * len(observations) - rank


def test_the_message_names_the_combination_in_lab_units(rng):
    setup = Setup(positions=grid(thetas=(0,)), misalignment=0.0, noise=NOISE, u_given=True)
    (text,) = unobservable(calibrate(setup.observe(rng), "least-squares").least_squares)
    assert text.startswith("Not determined by these positions: wg, wk.")
    assert "(wg +1 °/h/g); (wk +1 °/h/g)" in text


def test_a_dead_channel_is_named(rng):
    """Currents of y that are noise alone show nothing of what they multiply, Ky and Kxy."""
    observations = Setup(noise=NOISE, u_given=True).observe(rng)
    observations.jy[:] = observations.u_jy * rng.standard_normal(len(observations))
    estimate = calibrate(observations, "least-squares").least_squares
    assert {"ky", "kxy"} <= blank(estimate)


@pytest.mark.parametrize("blunder", ["swapped", "measured elsewhere", "sign"])
def test_a_blunder_is_not_taken_for_want_of_positions(blunder, rng):
    observations = Setup(noise=NOISE).observe(rng)
    if blunder == "swapped":
        rows, source = [4, 5], [5, 4]
    else:
        rows, source = [9], [2]
    if blunder == "sign":
        observations.jx[9] *= -1
    else:
        observations.jx[rows], observations.jy[rows] = observations.jx[source], observations.jy[source]
    estimate = calibrate(observations, "least-squares").least_squares
    assert blank(estimate) == set()
    assert np.flatnonzero(estimate.outliers.any(axis=1)).tolist() == rows
