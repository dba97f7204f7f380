"""Batches beside the single path, session by session."""

from dataclasses import replace

import numpy as np
import pytest

from solver.error_model import observation_equations
from solver.estimators.batch import Stand, elements_of_batch, solve_sessions
from solver.estimators.estimation import least_squares
from solver.geometry import case_orientation, elements
from tests.solver.sessions import Setup, grid, truth

SESSIONS = 40
U = 1e-9
"""Agreement that is asked for, in units of each session's own standard uncertainty."""


def many(setup, rng, spread=1.0):
    """Sessions and the same as arrays; uncertainties differ by up to `spread` between positions and channels."""
    sessions = [setup.observe(rng) for _ in range(SESSIONS)]
    for one in sessions:
        for u in (one.u_jx, one.u_jy):
            if u is not None:
                u *= rng.uniform(1.0, spread, len(u))
    first = sessions[0]
    stand = Stand(first.theta, first.psi, first.latitude)
    angles = np.array([np.column_stack((one.alpha, one.beta, one.gamma)) for one in sessions])
    jx, jy = np.array([one.jx for one in sessions]), np.array([one.jy for one in sessions])
    u = None
    if setup.u_given:
        u = np.array([one.u_jx for one in sessions]), np.array([one.u_jy for one in sessions])
    return sessions, (stand, angles, jx, jy), u


def one_by_one(sessions):
    return [least_squares(observation_equations(one), one).estimate for one in sessions]


def agree(found, singles):
    """Values to 1e-9 u; covariance and χ² to the change of K in a third round of weighting, below 1e-5."""
    values = np.array([single.values for single in singles])
    u = np.array([single.standard_uncertainties for single in singles])
    assert np.array_equal(np.isnan(found.values), np.isnan(values))
    assert np.nanmax(np.abs(found.values - values) / u, initial=0.0) < U
    np.testing.assert_allclose(found.standard_uncertainties, u, rtol=1e-5)
    covariance = np.array([single.covariance for single in singles]) / (u[:, :, None] * u[:, None, :])
    np.testing.assert_allclose(found.covariance / (u[:, :, None] * u[:, None, :]), covariance, atol=1e-5)


SETUPS = {
    "ordinary": Setup(noise=0.005, u_given=True),
    "without u": Setup(noise=0.005),
    "cross-coupled": Setup(truth(kxy=900.0, kyx=-700.0), noise=0.005, u_given=True),
    "misaligned by degrees": Setup(misalignment=10_000.0, noise=0.005, u_given=True),
    "few positions": Setup(noise=0.002, u_given=True, positions=grid((0, 90), (0, 90, 180))),
    "close together": Setup(noise=1e-4, u_given=True, positions=grid((0, 20), (0, 10, 20, 30, 40))),
    "near a pole": Setup(noise=1e-4, u_given=True, latitude=89.0),
    "southern": Setup(noise=0.005, u_given=True, latitude=-33.0),
    "repeats": Setup(noise=0.005, u_given=True, repeats=3),
}


@pytest.mark.parametrize("spread", [1.0, 10.0])
@pytest.mark.parametrize("name", SETUPS)
def test_it_is_the_single_path(name, spread, rng):
    sessions, arrays, u = many(SETUPS[name], rng, spread)
    found, singles = solve_sessions(*arrays, *(u or ())), one_by_one(sessions)
    agree(found, singles)
    chi2 = [np.sum(one.residuals**2) if u is None else one.fit.chi2 for one in singles]
    np.testing.assert_allclose(found.chi2, chi2, rtol=1e-4)
    if name in ("ordinary", "without u", "cross-coupled", "southern", "repeats"):
        assert found.alone.mean() < 0.1


@pytest.mark.parametrize(
    "setup",
    [
        Setup(noise=0.005, u_given=True, latitude=90.0),
        Setup(noise=0.005, latitude=90.0),
        Setup(noise=0.005, u_given=True, positions=grid((0,))),
        Setup(noise=0.005, u_given=True, positions=grid((0, 90), (0,))),
        Setup(noise=0.005, positions=grid((0,), (0, 90, 180, 270))),
        Setup(),
    ],
    ids=["pole", "pole without u", "one row", "two positions", "row without u", "exact"],
)
def test_what_is_awkward_goes_alone(setup, rng):
    sessions, arrays, u = many(setup, rng)
    found = solve_sessions(*arrays, *(u or ()))
    assert found.alone.all()
    values = np.array([one.values for one in one_by_one(sessions)])
    np.testing.assert_array_equal(np.isnan(found.values), np.isnan(values))
    # The same function on equations whose elements were multiplied out in another order.
    np.testing.assert_allclose(found.values[:, 0], values[:, 0], rtol=1e-6)


@pytest.mark.parametrize("name", ["ordinary", "cross-coupled", "few positions", "repeats"])
def test_estimated_uncertainties_are_moderated_alike(name, rng):
    """u with few degrees of freedom, others in every session: still the single path."""
    sessions, arrays, u = many(SETUPS[name], rng)
    dof = rng.uniform(4.0, 20.0, u[0].shape)
    for one in u:
        one *= np.sqrt(rng.chisquare(dof) / dof)
    sessions = [
        replace(one, u_jx=u[0][i], u_jy=u[1][i], dof_jx=dof[i], dof_jy=dof[i])
        for i, one in enumerate(sessions)
    ]
    found = solve_sessions(*arrays, *u, dof, dof)
    agree(found, one_by_one(sessions))
    assert np.abs(found.values / solve_sessions(*arrays, *u).values - 1.0).max() > 1e-6  # it does something


def test_shared_angles_and_uncertainties(rng):
    """Given once or for every session: the same bits."""
    _, (stand, angles, jx, jy), u = many(SETUPS["ordinary"], rng)
    once = solve_sessions(stand, angles[0], jx, jy, u[0][0], u[1][0])
    each = solve_sessions(stand, np.broadcast_to(angles[0], angles.shape), jx, jy, *u)
    np.testing.assert_allclose(once.values, each.values, rtol=1e-12)
    np.testing.assert_allclose(once.chi2, each.chi2, rtol=1e-9)


def test_blocks_do_not_show(rng, monkeypatch):
    """Sessions do not depend on their neighbours; sums are in the same order: the same bits."""
    _, arrays, u = many(SETUPS["ordinary"], rng)
    whole = solve_sessions(*arrays, *u)
    monkeypatch.setattr("solver.estimators.batch.BLOCK", 7)
    np.testing.assert_allclose(solve_sessions(*arrays, *u).values, whole.values, rtol=1e-12)
    stand, angles, jx, jy = arrays
    assert solve_sessions(stand, angles[:0], jx[:0], jy[:0]).values.shape == (0, 8)


def test_elements_written_out(rng):
    theta, psi = rng.uniform(0, 2 * np.pi, (2, 5))
    angles = rng.normal(0, 0.5, (3, 5))
    at = elements(case_orientation(theta, psi, *angles))
    np.testing.assert_allclose(elements_of_batch(theta, psi, angles), at[:4], atol=2e-15)
    block = np.repeat(angles[:, :, None], 3, axis=2)
    np.testing.assert_allclose(elements_of_batch(theta, psi, block)[0][:, 2], at.a, atol=2e-15)
