"""Optional terms: tests beside textbook regression, false positives and power by simulation."""

from dataclasses import replace

import numpy as np
import pytest
from scipy import stats

from solver.error_model import observation_equations
from solver.estimators.model_comparison import LEVEL, compare_models, holm
from solver.estimators.terms import TERMS, term_columns
from tests.solver.estimators.test_estimation import SHARED
from tests.solver.sessions import DEG_PER_H, Setup, grid
from tests.solver.uncertain_sessions import Uncertain, without_u

EIGHTHS = grid((0, 45, 90, 135), (0, 90, 180, 270))
"""Positions that show ωн as well: nx·nz ≠ 0 at θ = 45 and 135°."""
SETUP = Setup(noise=0.005, u_given=True, positions=EIGHTHS)
SIZE = {"wn": 0.05, "drift_x": 0.06, "drift_y": 0.06, "wg_split": 0.03, "wk_split": 0.03}
"""Ten standard uncertainties of each term or more, °/h (per g or g²)."""


def timed(observations, rng=None):
    """Measured in the method's order, or in any order, a position a minute and a half."""
    order = np.arange(len(observations)) if rng is None else rng.permutation(len(observations))
    return replace(observations, time=90.0 * order + 30.0)


def with_term(observations, term, size):
    """The same session of a gyro that has the term besides: what it adds to the drift, the currents lack."""
    column = term_columns(observations)[0][term].reshape(-1, 2)
    kx, ky, kxy, kyx = SETUP.parameters[:4]
    change = size * DEG_PER_H * column @ np.linalg.inv([[kx, kxy], [kyx, ky]]).T
    return replace(observations, jx=observations.jx - change[:, 0], jy=observations.jy - change[:, 1])


def compare(observations, **options):
    return compare_models(observation_equations(observations), observations, **options)


@pytest.mark.parametrize("term", TERMS)
def test_columns_are_those_of_the_model(term, rng):
    """Equations of a gyro with the term, written out, less those of one without."""
    observations = timed(SETUP.observe(rng), rng)
    turn_c, turn_d, turn_e = _up(observations)
    middle = (observations.time - observations.time.mean()) / np.ptp(observations.time)
    expected = {
        "wn": (turn_c * turn_e, turn_d * turn_e),
        "drift_x": (middle, 0 * middle),
        "drift_y": (0 * middle, middle),
        "wg_split": (1.0 * turn_c, -1.0 * turn_d),  # ωgx = ωg + 1 and ωgy = ωg − 1
        "wk_split": (-1.0 * turn_d, -1.0 * turn_c),  # −(ωк + 1)·d and (ωк − 1)·c
    }[term]
    column = term_columns(observations)[0][term].reshape(-1, 2)
    np.testing.assert_allclose(column, np.column_stack(expected), atol=1e-15)


def _up(observations):
    from tests.solver.sessions import to_case

    angles = np.degrees(np.column_stack((observations.theta, observations.psi)))
    small = np.column_stack((observations.alpha, observations.beta, observations.gamma))
    return (to_case(np.radians(angles), small) @ [0.0, 0.0, 1.0]).T


def test_one_term_beside_textbook_regression(rng):
    """Without u: F, p, value and u of ordinary regression with nine columns; F is t²."""
    observations = timed(without_u(with_term(SETUP.observe(rng), "wg_split", 0.01)))
    equations = observation_equations(observations)
    found = compare(observations)
    for term, test in zip(TERMS, found.tests, strict=True):
        column = term_columns(observations)[0][term]
        full = np.column_stack((equations.design, column))
        scale = np.linalg.norm(full, axis=0)
        values, square, *_ = np.linalg.lstsq(full / scale, equations.right_side)
        smaller = np.linalg.lstsq(equations.design / scale[:8], equations.right_side)[1]
        dof = len(full) - 9
        f = (smaller[0] - square[0]) / (square[0] / dof)
        u = np.sqrt(square[0] / dof * np.linalg.inv((full / scale).T @ (full / scale))[8, 8]) / scale[8]
        assert test.f == pytest.approx(f, rel=1e-6)
        assert test.p_value == pytest.approx(stats.f.sf(f, 1, dof), rel=1e-5)
        assert test.values[0] == pytest.approx(values[8] / scale[8], rel=1e-6)
        assert test.standard_uncertainties[0] == pytest.approx(u, rel=1e-6)
        assert test.f == pytest.approx((test.values[0] / test.standard_uncertainties[0]) ** 2, rel=1e-9)
        assert test.dof == dof
        assert test.delta_chi2 is None
        assert test.p_chi2 is None


def test_given_uncertainties_add_delta_chi2(rng):
    """Δχ² = (value/u)² for one term; for all together F is Δχ²/k over χ²/ν."""
    case = Uncertain(SETUP, shared=SHARED)
    observations = timed(case.observe(rng))
    found = compare(observations, common=case.common)
    for test in found.tests:
        assert test.delta_chi2 == pytest.approx(
            (test.values[0] / test.standard_uncertainties[0]) ** 2, rel=1e-9
        )
        assert test.p_chi2 == pytest.approx(stats.chi2.sf(test.delta_chi2, 1), rel=1e-9)
    joint = found.joint
    assert joint.terms == TERMS
    assert joint.dof == 32 - 8 - 5
    assert joint.p_value == pytest.approx(stats.f.sf(joint.f, 5, joint.dof), rel=1e-9)
    assert joint.delta_chi2 >= max(test.delta_chi2 for test in found.tests)


def test_holm_by_its_own_example():
    """Four tests at 0.01, 0.04, 0.03, 0.005: adjusted by hand, 0.03, 0.06, 0.06, 0.02."""
    np.testing.assert_allclose(holm([0.01, 0.04, 0.03, 0.005]), [0.03, 0.06, 0.06, 0.02])
    assert holm([]) == []
    assert holm([0.9, 0.8]) == [1.0, 1.0]


@pytest.mark.parametrize("case", ["given", "scatter", "everything uncertain"])
def test_false_positives_stay_at_their_level(case):
    """A gyro without further terms: at 10 %, in 200 sessions between the 0.01 % and 99.99 % points of binomials.

    Five correlated tests by Holm's steps name something in 8 to 10 % of the sessions.
    """
    rng, sessions, level = np.random.default_rng(12), 200, 0.1
    uncertain = Uncertain(SETUP, angles=0.0 if case != "everything uncertain" else 60.0,
                          shared=SHARED if case == "everything uncertain" else {})  # fmt: skip
    named, p_values = 0, []
    for _ in range(sessions):
        observations = timed(uncertain.observe(rng), rng)
        observations = without_u(observations) if case == "scatter" else observations
        found = compare(observations, common=uncertain.common, level=level)
        named += bool(found.supported)
        p_values.append([test.p_value for test in found.tests] + [found.joint.p_value])
    low, high = stats.binom.ppf(0.0001, sessions, 0.07), stats.binom.ppf(0.9999, sessions, level)
    assert low <= named <= high
    for column in np.transpose(p_values):
        assert stats.kstest(column, "uniform").pvalue > 1e-4


@pytest.mark.parametrize("given", [True, False])
@pytest.mark.parametrize("term", TERMS)
def test_a_real_term_is_found(term, given):
    """Ten u and more: found in 20 of 20 sessions, alone in most, its value within 5 u."""
    rng, alone = np.random.default_rng(3), 0
    for _ in range(20):
        observations = with_term(timed(SETUP.observe(rng), rng), term, SIZE[term])
        found = compare(observations if given else without_u(observations))
        assert found.supported[0] == term
        alone += found.supported == (term,)
        index = TERMS.index(term)
        test = found.tests[index]
        assert test.p_holm < LEVEL
        assert abs(test.values[0] - SIZE[term] * DEG_PER_H) < 5 * test.standard_uncertainties[0]
        assert found.verdict.code == "further-terms"
    assert alone >= 18  # at 1 % for the others, two of twenty have a probability of 2 %


def test_several_terms_at_once(rng):
    observations = timed(SETUP.observe(rng), rng)
    for term in ("drift_x", "wk_split"):
        observations = with_term(observations, term, 2 * SIZE[term])
    found = compare(observations)
    assert set(found.supported) == {"drift_x", "wk_split"}
    assert found.chosen.terms == found.supported
    for term, value, u in zip(
        found.supported, found.chosen.values, found.chosen.standard_uncertainties, strict=True
    ):
        assert abs(value - 2 * SIZE[term] * DEG_PER_H) < 5 * u
    assert found.verdict.text.startswith("The data support ")


def test_noise_larger_than_stated_supports_no_term():
    """Five times the stated noise: Δχ² accuses every term, F keeps its level (1 % of 60; 99.99 %: 4)."""
    rng, named, accused = np.random.default_rng(9), 0, 0
    for _ in range(60):
        observations = timed(SETUP.observe(rng), rng)
        understated = replace(observations, u_jx=observations.u_jx / 5, u_jy=observations.u_jy / 5)
        found = compare(understated)
        named += bool(found.supported)
        accused += found.joint.p_chi2 < 0.01
    assert named <= stats.binom.ppf(0.9999, 60, 0.01)
    assert accused > 50


def test_the_ninety_degree_grid_does_not_show_wn(rng):
    found = compare(timed(Setup(noise=0.005, u_given=True).observe(rng)))
    wn = found.tests[0]
    assert wn.p_value is None
    assert wn.reason.code == "term-unobservable"
    assert np.isnan(wn.values).all()
    assert found.joint.terms == TERMS[1:]
    assert all(test.reason is None for test in found.tests[1:])


def test_too_few_positions_leave_nothing_to_judge_by(rng):
    setup = Setup(
        noise=0.005,
        u_given=True,
        positions=np.array([(20.0, 10.0), (60.0, 190.0), (115.0, 50.0), (230.0, 20.0)]),
    )
    found = compare(setup.observe(rng))
    assert {test.reason.code for test in found.tests} == {"term-no-freedom"}
    assert found.verdict.code == "term-none"
    assert found.joint.terms == ()


def test_unknown_times_are_taken_in_the_methods_order(rng):
    observations = Setup(noise=0.005, u_given=True, repeats=2, positions=EIGHTHS).observe(rng)
    columns, assumed = term_columns(observations)
    assert assumed
    moment = columns["drift_x"][::2]
    first, second = moment[observations.repeat == 0], moment[observations.repeat == 1]
    assert np.all(np.diff(first) > 0)
    assert np.all(np.diff(second) > 0)
    assert first.max() < second.min()
    assert np.ptp(moment) == pytest.approx(1.0)
    found = compare(observations)
    assert found.time_assumed
    assert np.isnan(found.duration)
    found = compare(timed(observations))
    assert not found.time_assumed
    assert found.duration == 31 * 90.0


def test_one_moment_shows_no_drift(rng):
    observations = replace(SETUP.observe(rng), time=np.full(16, 50.0))
    found = compare(observations)
    assert [test.reason is not None for test in found.tests] == [False, True, True, False, False]


def test_undetermined_parameters_do_not_become_terms(rng):
    """At a pole, where K cannot be found, no term can be told from it."""
    found = compare(timed(Setup(noise=0.005, u_given=True, latitude=90.0, positions=EIGHTHS).observe(rng)))
    assert found.supported == ()


def test_exact_data_support_nothing(rng):
    """Residuals of rounding alone have a pattern that says nothing."""
    found = compare(timed(Setup(positions=EIGHTHS).observe(rng)))
    assert found.supported == ()
