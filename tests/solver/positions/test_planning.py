"""Predictions against simulated sessions, and what a prediction names as not determined.

The sessions come from `tests.solver.sessions`, by scipy's rotations.
"""

import numpy as np
import pytest
from scipy import stats

from solver.calibrate import calibrate
from solver.errors import InputError
from solver.inputs import CommonUncertainty
from solver.positions.planning import Circumstances, NoiseModel, Places, below_method, duration_at, predict
from solver.records import PARAMETERS, Observations
from tests.solver.sessions import DEG_PER_H, LAB, Setup, grid, truth

ARCSEC = np.pi / 180 / 3600
SECONDS = 60.0
SESSIONS = 300


def at(latitude: float = 55.7558, noise: float = 0.005, **more) -> Circumstances:
    """Noise in °/h of a mean over a minute."""
    white = noise * DEG_PER_H / truth()[0] * np.sqrt(SECONDS)
    return Circumstances(truth(), np.radians(latitude), NoiseModel(white), **more)


def places(positions: np.ndarray, misalignment: np.ndarray | None = None, u: float = 0.0) -> Places:
    """Positions in degrees, misalignment (n, 3) in rad, its uncertainty in rad."""
    n = len(positions)
    alpha, beta, gamma = (np.zeros((n, 3)) if misalignment is None else misalignment).T
    theta, psi = np.radians(positions).T
    return Places(theta, psi, alpha, beta, gamma, *[np.full(n, u)] * 3)


def rms_interval(count: int) -> tuple[float, float]:
    """Where the rms of `count` standard normals lies with 99.9 % for each of eight parameters."""
    tail = 0.001 / 8 / 2
    low, high = np.sqrt(stats.chi2.ppf([tail, 1 - tail], count) / count)
    return float(low), float(high)


def observed(currents: np.ndarray, at_places: Places, u: float, latitude: float) -> Observations:
    repeat = np.zeros(len(at_places), np.int64)
    return Observations.sorted_from(
        theta=at_places.theta, psi=at_places.psi, repeat=repeat, alpha=at_places.alpha,
        beta=at_places.beta, gamma=at_places.gamma, jx=currents[:, 0], jy=currents[:, 1],
        u_jx=np.full(len(at_places), u), u_jy=np.full(len(at_places), u), latitude=latitude,
    )  # fmt: skip


@pytest.mark.parametrize(
    "positions", [grid(), grid()[:8], grid(thetas=(0, 45, 90), psis=(10, 130, 250))], ids=["16", "8", "odd"]
)
def test_predicted_u_are_those_of_simulated_sessions(positions, rng):
    setup = Setup(positions=positions, noise=0.005)
    angles = 20 * ARCSEC * rng.standard_normal((len(positions), 3))
    plan = places(positions, angles)
    predicted = predict(plan, SECONDS, at())
    true_currents = setup.currents(angles)
    errors = []
    for _ in range(SESSIONS):
        currents = true_currents + setup.u_current * rng.standard_normal((len(positions), 2))
        data = observed(currents, plan, setup.u_current, np.radians(setup.latitude))
        errors.append(calibrate(data, "least-squares").least_squares.values - setup.parameters)
    low, high = rms_interval(SESSIONS)
    rms = np.sqrt(np.mean(np.square(errors), axis=0)) / predicted.u
    assert np.all((low < rms) & (rms < high)), rms
    assert predicted.rank == 8
    assert not predicted.warnings


def test_predicted_u_cover_wrong_angles_a_wrong_ammeter_and_a_base_out_of_level(rng):
    """Angles wrong by 30″ at each position, gain by 0.1 %, level by 40″: now these dominate the noise."""
    setup = Setup(noise=0.001)
    u_angle, u_gain, u_level = 30 * ARCSEC, 1e-3, 40 * ARCSEC
    common = CommonUncertainty.of({"gain_x": u_gain, "gain_y": u_gain, "level_1": u_level})
    plan = places(setup.positions, u=u_angle)
    predicted = predict(plan, SECONDS, at(noise=0.001, common=common))
    errors = []
    for _ in range(SESSIONS):
        # A tilt of the base about east adds to θ: the platform turns about that same axis.
        tilt = np.array([np.degrees(u_level * rng.standard_normal()), 0.0])
        tilted = Setup(positions=setup.positions + tilt)
        currents = tilted.currents(u_angle * rng.standard_normal((16, 3)))
        # Gain counts as true over shown: the shown current is smaller by it.
        shown = currents / (1 + u_gain * rng.standard_normal(2))
        shown = shown + setup.u_current * rng.standard_normal((16, 2))
        data = observed(shown, plan, setup.u_current, np.radians(setup.latitude))
        errors.append(calibrate(data, "least-squares").least_squares.values - setup.parameters)
    low, high = rms_interval(SESSIONS)
    rms = np.sqrt(np.mean(np.square(errors), axis=0)) / predicted.u
    assert np.all((low < rms) & (rms < high)), rms
    shares = dict(zip(predicted.budget.lines, predicted.budget.shares, strict=True))
    np.testing.assert_allclose(sum(shares.values()), 1.0, rtol=1e-9)  # of one variance; rounding of a sum
    assert shares["ammeter-gain"][0] > 0.9  # 0.1 % of K against 50 ppm of noise
    assert shares["level"][PARAMETERS.index("wg")] > 0.01


def test_repeats_lower_the_noise_but_not_what_they_share():
    """Each position four times halves u from noise; the angles of a position are the same each time."""
    once = predict(places(grid()), SECONDS, at())
    often = predict(places(np.repeat(grid(), 4, axis=0)), SECONDS, at())
    np.testing.assert_allclose(often.u, once.u / 2, rtol=1e-9)  # exact but for rounding
    silent = 1e-6  # °/h: nothing against the angles
    once = predict(places(grid(), u=10 * ARCSEC), SECONDS, at(noise=silent))
    often = predict(places(np.repeat(grid(), 4, axis=0), u=10 * ARCSEC), SECONDS, at(noise=silent))
    np.testing.assert_allclose(often.u, once.u, rtol=1e-3)  # noise is 1e-3 of the angles' effect


def test_only_theta_zero_shows_no_g_sensitive_drift():
    level = grid(thetas=(0,))
    exact = predict(places(level), SECONDS, at())
    assert [name for name, no in zip(PARAMETERS, exact.undetermined, strict=True) if no] == ["wg", "wk"]
    assert exact.rank == 6
    assert exact.warnings[0].code == "unobservable"
    assert "wg +1 °/h/g" in exact.warnings[0].text
    assert np.isnan(exact.u[6:]).all()
    assert np.isfinite(exact.u[:6]).all()
    angles = 20 * ARCSEC * np.random.default_rng(5).standard_normal((4, 3))
    nearly = predict(places(level, angles), SECONDS, at())
    assert nearly.undetermined.tolist() == exact.undetermined.tolist()
    assert nearly.rank == 6
    assert "more than the Earth rate" in nearly.warnings[0].text
    # The other parameters are what they would be without them.
    np.testing.assert_allclose(nearly.u[4:6], exact.u[4:6], rtol=0.2)


def test_what_arcseconds_alone_show_is_called_weak():
    """At θ = 0 the certified arcminute shows ωg a little: u is below the Earth rate, but nobody would want it."""
    angles = 60 * ARCSEC * np.array([[1, -1, 0], [-1, 1, 0], [1, 1, 0], [-1, -1, 0]], float)
    found = predict(places(grid(thetas=(0,)), angles), 600.0, at())
    assert found.rank == 8
    assert [item.code for item in found.warnings] == ["weak"]
    text = found.warnings[0].text
    assert "Hardly determined by these positions: wg, wk." in text
    assert "+1 °/h/g" in text
    assert "kx" not in text
    assert found.condition > 100
    assert found.u[6] > 1000 * found.u[4]


@pytest.mark.parametrize("latitude", [90.0, -90.0, 89.99999])
def test_at_a_pole_nothing_is_told_whatever_the_positions(latitude):
    found = predict(places(grid(thetas=range(0, 360, 45), psis=range(0, 360, 45))), SECONDS, at(latitude))
    assert found.undetermined[:4].all()
    assert found.rank <= 6
    assert "at a pole" in found.warnings[0].text
    assert np.isnan(found.u[:4]).all()


def test_three_positions_are_too_few():
    found = predict(places(grid()[[0, 5, 10]]), SECONDS, at())
    assert found.rank < 8
    assert found.undetermined.any()


def test_nominal_biases_do_not_change_what_is_learned_of_k_but_g_sensitive_drifts_do():
    noise, latitude = at().noise, at().latitude
    one = predict(places(grid()), SECONDS, at())
    biased = predict(places(grid()), SECONDS, Circumstances(truth(w0x=40.0, w0y=-35.0), latitude, noise))
    np.testing.assert_allclose(biased.u[:4], one.u[:4], rtol=1e-8)  # an identity; rounding of the solution
    assert not np.allclose(biased.u[4:6], one.u[4:6], rtol=1e-2)
    unbalanced = predict(places(grid()), SECONDS, Circumstances(truth(wg=30.0), latitude, noise))
    assert (unbalanced.u[:4] < 0.9 * one.u[:4]).all()


def test_noise_falls_with_the_root_of_time_down_to_its_floor():
    noise = NoiseModel(white=6.0, floor=0.8)
    assert noise.u(100.0) == pytest.approx(1.0, rel=1e-15)  # √(0.6² + 0.8²)
    assert noise.u(1e12) == pytest.approx(0.8, rel=1e-9)
    for white, floor in ((0.0, 0.0), (-1.0, 0.0), (1.0, np.inf), (np.nan, 1.0)):
        with pytest.raises(InputError) as error:
            NoiseModel(white, floor)
        assert error.value.message.code == "bad-noise"


def test_measuring_time_is_what_moving_leaves():
    assert duration_at(2400.0, 60.0, 16) == 90.0
    assert duration_at(2400.0, 60.0, 8) == 240.0
    with pytest.raises(InputError, match="no time"):
        duration_at(2400.0, 60.0, 40)
    # The rule of the method is a minute, with a tolerance of 0.1 %.
    assert [below_method(seconds) for seconds in (59.9, 59.95, 60.0)] == [True, False, False]
    short = predict(places(grid()), 30.0, at())
    assert [warning.code for warning in short.warnings] == ["below-method"]


def test_what_cannot_be_planned_is_refused():
    with pytest.raises(InputError, match="at least one position"):
        predict(places(np.zeros((0, 2))), SECONDS, at())
    with pytest.raises(InputError, match="nominal scale factors"):
        Circumstances(truth(kx=0.0, kxy=0.0), 1.0, NoiseModel(1.0))
    with pytest.raises(InputError, match="latitude"):
        Circumstances(truth(), 2.0, NoiseModel(1.0))


def test_units_of_the_prediction():
    """K is learned from the Earth rate alone: 0.002 °/h per position make about 100 ppm of K (16 positions)."""
    predicted = predict(places(grid()), SECONDS, at(noise=0.002))
    assert 70e-6 < predicted.u[0] / truth()[0] < 140e-6
    assert 0.0004 < predicted.u[4] / LAB[4] < 0.0006  # 0.002/√16 °/h
