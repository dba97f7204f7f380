"""The parts of a diagnosis against what is independent of them: other simulations, other algebra."""

from dataclasses import replace

import numpy as np
import pytest

from solver.blunders.current_model import CurrentModel, regressors
from solver.blunders.hypotheses import outliers, swaps, warm_ups, wrong_positions
from solver.blunders.hypothesis_score import Session
from solver.blunders.prior import Prior
from solver.blunders.suspicion import suspect
from solver.blunders.symmetries import approximate_symmetries, exact_symmetries
from solver.calibrate import calibrate
from solver.errors import InputError
from tests.solver.blundered import ASKED, Study, good, prior
from tests.solver.sessions import LAB, Setup, grid, to_case, truth


def exact(setup: Setup, seed: int = 3):
    """Noise-free currents of a setup on one and the same stand, and its misalignments."""
    misalignment = np.radians(30 / 3600) * np.random.default_rng(seed).standard_normal(
        (len(setup.positions), 3)
    )
    return setup.currents(misalignment), misalignment


def solved(setup: Setup, currents, misalignment):
    observations = setup.observe(np.random.default_rng(0))
    alpha, beta, gamma = misalignment.T
    made = replace(observations, alpha=alpha, beta=beta, gamma=gamma, jx=currents[:, 0], jy=currents[:, 1])
    return calibrate(made, "least-squares").least_squares


MISTAKES = {
    ("channels-swapped", None): (lambda j: j[:, ::-1], None),
    ("channel-sign", "x"): (lambda j: j * [-1, 1], None),
    ("channel-sign", "y"): (lambda j: j * [1, -1], None),
    ("channel-sign", "xy"): (lambda j: -j, None),
    ("latitude-sign", None): (lambda j: j, -55.7558),
    ("latitude-complement", None): (lambda j: j, 90 - 55.7558),
    ("current-unit", 1e3): (lambda j: j / 1e3, None),
    ("current-unit", 1e-3): (lambda j: j * 1e3, None),
}
"""What was measured instead, and where the stand really was."""


@pytest.mark.parametrize("kind", MISTAKES)
@pytest.mark.parametrize("latitude", [55.7558, -30.0])
def test_a_mistake_is_as_invisible_as_derived(kind, latitude):
    """Solved with the mistake, the map gives the true gyro, and no residual is left."""
    mistake, real = MISTAKES[kind]
    given = Setup(latitude=latitude)
    if real is not None:
        real = -latitude if kind[0] == "latitude-sign" else float(np.copysign(90 - abs(latitude), latitude))
    currents, misalignment = exact(replace(given, latitude=latitude if real is None else real))
    fitted = solved(given, mistake(currents), misalignment)
    maps = [item for item in exact_symmetries(np.radians(latitude)) if item.code == kind[0]]
    (found,) = [
        item for item in maps if kind[1] in (None, item.details.get("channel"), item.details.get("factor"))
    ]
    values, covariance = found.apply(fitted.values, fitted.covariance)
    # Rounding of 1e-16 of 15 °/h times the condition number, some 100.
    np.testing.assert_allclose(values / LAB, truth() / LAB, atol=1e-8)
    assert np.abs(fitted.residuals / LAB[4]).max() < 1e-9
    assert covariance.shape == (8, 8)


@pytest.mark.parametrize(("code", "sense"), [("psi-reversed", (1, -1)), ("theta-reversed", (-1, 1))])
def test_reversed_angles_are_invisible_without_misalignment(code, sense):
    given = Setup()
    none = np.zeros((16, 3))
    currents = replace(given, positions=given.positions * sense).currents(none)
    fitted = solved(given, currents, none)
    symmetry = approximate_symmetries(np.radians(given.latitude))[code]
    values, _ = symmetry.apply(fitted.values, fitted.covariance)
    np.testing.assert_allclose(values / LAB, truth() / LAB, atol=1e-8)


def test_twins_have_the_same_elements():
    """North and up along x and y, by scipy's rotations."""
    positions = grid((0, 35, 90, 210), (0, 70, 180, 300))
    one, twin = (to_case(np.radians(positions + turn), np.zeros((16, 3))) for turn in (0, 180))
    np.testing.assert_allclose(one[:, :2, 1:], twin[:, :2, 1:], atol=1e-15)


def test_the_regression_is_that_of_the_currents(rng):
    """Currents of an independent simulation are linear in the regressors, exactly; parameters follow."""
    observations = Setup(misalignment=60.0).observe(rng)
    currents = np.stack((observations.jx, observations.jy), axis=1)
    model = CurrentModel.of(regressors(observations), currents, np.ones_like(currents))
    solutions = model.solve(regressors(observations)[None], currents[None], model.weights[None], told=False)
    assert np.abs(solutions.rest).max() < 1e-13 * np.abs(currents).max()
    np.testing.assert_allclose(solutions.start[0] / LAB, truth() / LAB, atol=1e-8)


def test_a_batch_of_changes_is_each_solved_by_itself(rng):
    """Exchanges and moved positions by rank updates against numpy's lstsq of the changed rows."""
    made, _ = good(Study().draw(rng))
    session = Session.of(made, None, None)
    u = np.stack((made.u_jx, made.u_jy), axis=1)
    for square, hypothesis in swaps(made, session.x, session.model) + wrong_positions(
        made, session.x, session.model
    ):
        x = session.x if hypothesis.x is None else hypothesis.x
        order = np.arange(16) if hypothesis.order is None else hypothesis.order
        currents = session.model.currents[order]
        expected = sum(np.linalg.lstsq(x / u[:, [c]], currents[:, c] / u[:, c])[1].item() for c in (0, 1))
        # Rounding of the moments, (J/u)² ~ 1e7 times 32, of 1e-16 and the condition.
        assert square == pytest.approx(expected, rel=1e-6, abs=1e-4)


def test_snooping_is_the_refit_without_the_measurement(rng):
    """The worst of the cheap alarms, fitted anew without it: the fall of χ² that was foretold."""
    session = Study().draw(rng)
    currents = session.currents()
    currents[6, 0] += 8 * session.u
    state = Session.of(session.written(currents), None, None)
    suspicion = suspect(state)
    assert suspicion.search
    assert suspicion.worst[0] == (6, "x")
    score = state.scores(list(outliers(16, suspicion.worst[:1])))[0]
    # 8 u in one current whose redundancy is about 0.75.
    assert 8**2 * 0.5 - 8 * 3 < state.fall(score) < 8**2 + 8 * 3
    without = np.delete(np.arange(32), 12)
    fitted = state.good.fitted
    assert fitted is not None
    # The same by hand: one unknown more, a unit column.
    column = np.zeros((32, 1))
    column[12] = 1.0
    spanned = np.hstack((fitted.span, column))
    left = fitted.rest - spanned @ np.linalg.lstsq(spanned, fitted.rest)[0]
    assert np.allclose(left[12], 0)
    assert len(without) == 31
    # K changes a little with the outlier gone: some 1e-3 of what falls.
    assert state.fall(score) == pytest.approx(fitted.squares - left @ left, rel=5e-3)


def test_the_drift_of_a_warm_up_costs_two_degrees_of_freedom(rng):
    made, _ = good(Study().draw(rng))
    session = Session.of(made, None, None)
    for score in session.scores(list(warm_ups(made))):
        assert score.best.dof == 22
        assert session.fall(score) > 0


def test_fitted_like_the_result(rng):
    """χ² and parameters of the data as given are those of the calibration."""
    made, _ = good(Study().draw(rng))
    fitted = Session.of(made, None, None).good.fitted
    result = calibrate(made, "least-squares").least_squares
    np.testing.assert_allclose(
        fitted.values, result.values, rtol=0, atol=1e-4 * result.standard_uncertainties.min()
    )
    np.testing.assert_allclose(fitted.squares, result.fit.chi2, rtol=1e-5)
    np.testing.assert_allclose(fitted.covariance, result.covariance, rtol=1e-5, atol=1e-20)


# The prior


def test_distance_from_a_prior_by_hand():
    expected = prior()
    values = truth()
    u = expected.standard_uncertainties
    by_hand = np.nansum(((values - expected.values) / u) ** 2)
    distance, compared = expected.distance(values, np.zeros((8, 8)), np.ones(8, dtype=bool))
    assert distance == pytest.approx(by_hand, rel=1e-12)
    assert compared == ASKED.sum()


def test_a_correlated_prior():
    """Two parameters fully known in their difference only: (1, −1) is far, (1, 1) near."""
    covariance = np.zeros((8, 8))
    covariance[:2, :2] = [[1.0, 0.99], [0.99, 1.0]]
    values = np.where(np.arange(8) < 2, 10.0, np.nan)
    expected = Prior(values, np.where(np.arange(8) < 2, 1.0, np.nan), covariance)
    known = np.ones(8, dtype=bool)
    near, _ = expected.distance(np.full(8, 11.0), np.zeros((8, 8)), known)
    far, _ = expected.distance(np.array([11.0, 9.0] + [0.0] * 6), np.zeros((8, 8)), known)
    assert near == pytest.approx(2 / 1.99)
    assert far == pytest.approx(2 / 0.01)


def test_what_is_not_known_is_not_compared():
    known = np.array([False] * 6 + [True] * 2)
    assert prior().distance(np.full(8, np.nan), np.zeros((8, 8)), ~np.ones(8, dtype=bool)) == (0.0, 0)
    assert prior().distance(truth(), np.zeros((8, 8)), known)[1] == 2


@pytest.mark.parametrize(
    ("values", "u"),
    [
        (np.ones(7), np.ones(7)),
        (np.ones(8), np.zeros(8)),
        (np.ones(8), np.full(8, np.nan)),
        (np.full(8, np.inf), np.ones(8)),
    ],
)
def test_a_prior_is_checked(values, u):
    with pytest.raises(InputError):
        Prior(values, u)


def test_scale_factors_say_that_coupling_is_weaker():
    with_coupling = prior().with_coupling()
    assert with_coupling.says[[0, 1, 2, 3]].all()
    np.testing.assert_allclose(with_coupling.standard_uncertainties[2:4] / LAB[0], 0.2 * 2062.65)
    only = Prior(np.where(np.arange(8) == 0, 1.0, np.nan), np.where(np.arange(8) == 0, 1.0, np.nan))
    assert only.with_coupling() is only
