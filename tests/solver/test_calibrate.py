from dataclasses import fields

import numpy as np
import pytest

from solver.calibrate import calibrate
from solver.errors import InputError, NotConverged
from solver.records import PARAMETERS, Estimate, Failure, Observations
from tests.solver.sessions import DEG_PER_H, LAB, Setup, grid, truth

CASES = {
    "ordinary": Setup(),
    "southern": Setup(latitude=-33.9),
    "equator": Setup(latitude=0.0),
    "high latitude": Setup(latitude=78.2),
    "negative scale factor": Setup(truth(kx=-1800.0, ky=-1833.0, kyx=25.0)),
    "one negative scale factor": Setup(truth(kx=-1800.0)),
    "strong coupling": Setup(truth(kxy=900.0, kyx=-700.0)),
    "no drift": Setup(truth(w0x=0.0, w0y=0.0, wg=0.0, wk=0.0, kxy=0.0, kyx=0.0)),
    "degrees of misalignment": Setup(misalignment=2 * 3600.0),
    "eight positions": Setup(positions=grid(thetas=(0, 90))),
    "repeats": Setup(repeats=3),
}


def assert_equal_parameters(got: np.ndarray, expected: np.ndarray) -> None:
    # 1e-9 of the value, of 1e-3 of Kx for a K and of 1e-3 °/h for an ω: the accuracy promised to
    # the user. Rounding alone leaves about 1e-13.
    least = np.array([1e-3 * abs(expected[0])] * 4 + [1e-3 * DEG_PER_H] * 4)
    assert np.all(np.abs(got - expected) <= 1e-9 * np.maximum(np.abs(expected), least))


@pytest.mark.parametrize("u_given", [False, True])
@pytest.mark.parametrize("name", CASES)
def test_recovers_the_truth_from_exact_currents(name, u_given, rng):
    setup = CASES[name]
    result = calibrate(with_u(setup.observe(rng)) if u_given else setup.observe(rng))
    for estimate in (result.least_squares, result.paper):
        assert isinstance(estimate, Estimate)
        assert_equal_parameters(estimate.values, setup.parameters)
        assert estimate.fit.rank == 8
        assert {warning.code for warning in estimate.warnings} <= {"no-uncertainty"}


def with_u(observations: Observations) -> Observations:
    """State an uncertainty of 0.005 °/h for exact currents, different by position and axis."""
    columns = {item.name: getattr(observations, item.name) for item in fields(observations)}
    spread = 1 + np.arange(len(observations)) % 3
    return Observations.sorted_from(**{**columns, "u_jx": 2.4e-9 * spread, "u_jy": 2.4e-9 / spread})


@pytest.mark.parametrize("offset", [1e-3, 17.0])
def test_least_squares_takes_positions_off_the_right_angles(offset, rng):
    setup = Setup(positions=(grid() + offset) % 360)
    result = calibrate(setup.observe(rng))
    assert_equal_parameters(result.least_squares.values, setup.parameters)
    assert isinstance(result.paper, Failure)
    assert result.paper.message.code == "positions-missing"


def test_shuffled_rows_give_the_same_bits(rng):
    observations = Setup(noise=0.005, u_given=True, repeats=2).observe(rng)
    columns = {item.name: getattr(observations, item.name) for item in fields(observations)}
    order = rng.permutation(len(observations))
    shuffled = Observations.sorted_from(
        **{name: value[order] if isinstance(value, np.ndarray) else value for name, value in columns.items()}
    )
    assert fingerprint(shuffled) == fingerprint(observations)


def fingerprint(observations: Observations) -> tuple[object, ...]:
    result = calibrate(observations)
    parts: list[object] = [result.input_hash]
    for estimate in (result.least_squares, result.paper):
        arrays = (estimate.values, estimate.covariance, estimate.residuals, estimate.standardised)
        parts += [array.tobytes() for array in arrays]
        parts += [estimate.fit.chi2, estimate.fit.condition, estimate.warnings]
    return tuple(parts)


def test_a_missing_position_is_named_and_stops_only_the_paper(rng):
    positions = np.delete(grid(), [1, 6], axis=0)
    observations = Setup(positions=positions).observe(rng)
    result = calibrate(observations)
    assert result.least_squares is not None
    assert isinstance(result.paper, Failure)
    assert result.paper.message.values["positions"] == "(0°, 90°), (90°, 180°)"
    with pytest.raises(InputError, match="not measured"):
        calibrate(observations, "paper")


def test_not_converging_is_a_failure_with_its_history(rng):
    # With tens of degrees of misalignment ωg and ωк feed back on K more strongly than row 2 corrects.
    observations = diverging(rng)
    with pytest.raises(NotConverged) as caught:
        calibrate(observations, "paper")
    assert caught.value.iterations.shape[1] == len(PARAMETERS)
    result = calibrate(observations)
    assert isinstance(result.paper, Failure)
    assert result.paper.message.code == "not-converged"
    np.testing.assert_array_equal(result.paper.iterations, caught.value.iterations)
    assert result.least_squares.fit.rank == 8


def diverging(rng: np.random.Generator) -> Observations:
    """The first simulated session with gross misalignments on which the iteration fails."""
    for _ in range(50):
        observations = Setup(misalignment=25 * 3600.0).observe(rng)
        if isinstance(calibrate(observations).paper, Failure):
            return observations
    raise AssertionError("no session diverges")


def test_one_method_alone_is_the_same_as_in_both(rng):
    observations = Setup(noise=0.005).observe(rng)
    both = calibrate(observations)
    single = calibrate(observations, "least-squares")
    assert single.paper is None
    assert single.least_squares.values.tobytes() == both.least_squares.values.tobytes()
    single = calibrate(observations, "paper")
    assert single.least_squares is None
    assert single.paper.values.tobytes() == both.paper.values.tobytes()


@pytest.mark.parametrize(
    ("duration", "rate", "codes"),
    [
        (60.0, 200.0, set()),
        (59.95, 199.85, set()),  # within 0.1 %
        (59.93, 200.0, {"below-method"}),
        (60.0, 199.7, {"below-method"}),
        (np.nan, 200.0, {"duration-unknown"}),
        (60.0, np.nan, {"duration-unknown"}),
        (30.0, np.nan, {"below-method", "duration-unknown"}),
    ],
)
def test_the_measurement_rule(duration, rate, codes, rng):
    observations = Setup(noise=0.005, u_given=True).observe(rng)
    observations.duration[5], observations.rate[5] = duration, rate
    for estimate in both(observations):
        found = {warning.code: warning for warning in estimate.warnings}
        assert set(found) == codes
        for warning in found.values():
            assert warning.values["positions"] == "θ 90° ψ 90°"


def both(observations: Observations) -> tuple[Estimate, Estimate]:
    result = calibrate(observations)
    assert isinstance(result.paper, Estimate)
    return result.least_squares, result.paper


def test_without_uncertainties_chi_squared_is_null_and_scatter_gives_u(rng):
    for estimate in both(Setup(noise=0.005).observe(rng)):
        assert estimate.uncertainty_basis == "scatter"
        assert estimate.fit.chi2 is None
        assert estimate.fit.p_value is None
        assert [warning.code for warning in estimate.warnings] == ["no-uncertainty"]
        assert np.all(estimate.standard_uncertainties > 0)


def test_four_positions_leave_nothing_to_take_an_uncertainty_from(rng):
    setup = Setup(positions=np.array([(20.0, 10.0), (60.0, 190.0), (115.0, 50.0), (230.0, 20.0)]))
    estimate = calibrate(setup.observe(rng), "least-squares").least_squares
    assert_equal_parameters(estimate.values, setup.parameters)
    assert estimate.uncertainty_basis == "none"
    assert np.isnan(estimate.covariance).all()
    assert estimate.fit.dof == 0


def test_no_uncertainty_says_why_there_is_none(rng):
    """At a pole residuals of 26 degrees of freedom are left, but no scale factor to tell the currents' from."""
    few = Setup(positions=np.array([(20.0, 10.0), (60.0, 190.0), (115.0, 50.0), (230.0, 20.0)]))
    for setup, dof, words in ((few, 0, "no residual is left"), (Setup(latitude=90.0), 26, "scale factors")):
        estimate = calibrate(setup.observe(rng), "least-squares").least_squares
        assert (estimate.uncertainty_basis, estimate.fit.dof) == ("none", dof)
        told = {warning.code: warning.text for warning in estimate.warnings}
        assert words in told["no-uncertainty"]


def test_an_outlier_is_named_with_position_and_axis(rng):
    observations = Setup(noise=0.005, u_given=True).observe(rng)
    observations.jy[6] += 40 * observations.u_jy[6]
    for estimate in both(observations):
        assert np.argwhere(estimate.outliers).tolist() == [[6, 1]]
        (warning,) = estimate.warnings
        assert warning.code == "outlier"
        assert warning.values["places"] == "y (θ 90° ψ 180°)"
        assert warning.text.count("%") == 1


def test_bad_input_is_refused(rng):
    observations = Setup().observe(rng)
    with pytest.raises(InputError, match="method"):
        calibrate(observations, "newton")
    observations.theta[:] = observations.theta[::-1]
    with pytest.raises(InputError, match="sorted"):
        calibrate(observations)
    empty = {item.name: np.zeros(0) for item in fields(Observations)} | {"latitude": 0.9, "repeat": None}
    with pytest.raises(InputError, match="no measured position"):
        calibrate(Observations.sorted_from(**empty))


def test_zero_currents_are_refused(rng):
    observations = Setup().observe(rng)
    observations.jx[:] = observations.jy[:] = 0.0
    with pytest.raises(InputError, match="ammeter"):
        calibrate(observations)


def test_lab_units_of_the_tests_are_those_of_the_product():
    from solver.estimators.observability import lab_units

    # Two roundings apart at most.
    np.testing.assert_allclose(lab_units(truth()), truth() / LAB, rtol=4e-16)
