import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from solver.least_squares import AGREEMENT, complement, estimate, solve, solve_batch


@pytest.fixture
def problem(rng):
    return rng.normal(size=(20, 5)) * [1, 1e-6, 1e3, 1, 2], rng.normal(size=20)


def test_agrees_with_lstsq_and_the_textbook_covariance(problem):
    design, right_side = problem
    solution = solve(design, right_side)
    expected = np.linalg.lstsq(design / design.std(axis=0), right_side)[0] / design.std(axis=0)
    # Two factorisations of a problem with a condition of about 3: some 1e-15.
    np.testing.assert_allclose(solution.values, expected, rtol=1e-12)
    np.testing.assert_allclose(solution.gain @ right_side, expected, rtol=1e-12)
    np.testing.assert_allclose(solution.covariance @ (design.T @ design), np.eye(5), rtol=0, atol=1e-6)


def test_the_lean_solution_is_the_same(problem):
    values, covariance = estimate(*problem)
    expected = solve(*problem)
    np.testing.assert_allclose(values, expected.values, rtol=1e-12)  # as above
    u = np.sqrt(np.diagonal(expected.covariance))
    np.testing.assert_allclose(covariance / np.outer(u, u), expected.covariance / np.outer(u, u), atol=1e-12)


@pytest.mark.parametrize("columns", [[0, 0], [0, 1, 2, 3, 4, 1]])
def test_the_lean_solution_refuses_a_deficient_design(columns, problem):
    design, right_side = problem
    with pytest.raises(np.linalg.LinAlgError):
        estimate(design[:, columns], right_side)
    with pytest.raises(np.linalg.LinAlgError):
        estimate(design[:3], right_side[:3])


def test_spectrum_is_that_of_the_scaled_design(problem):
    design, right_side = problem
    solution = solve(design, right_side)
    scaled = design / np.linalg.norm(design, axis=0)
    assert solution.condition == pytest.approx(np.linalg.cond(scaled), rel=1e-12)
    for value, vector in zip(solution.singular_values, solution.singular_vectors, strict=True):
        assert np.linalg.norm(scaled @ vector) == pytest.approx(value, rel=1e-12)


def test_an_invisible_direction_is_left_out(problem):
    design, right_side = problem
    design[:, 4] = design[:, 0] + 2 * design[:, 3]
    direction = np.array([[1.0, 0, 0, 2.0, -1.0]])
    solution = solve(design, right_side, invisible=direction)
    scale = np.linalg.norm(design, axis=0)
    assert (solution.values * scale) @ (direction[0] * scale) == pytest.approx(0, abs=1e-10)
    best = np.linalg.lstsq(design / scale, right_side)[0]
    np.testing.assert_allclose(solution.values, best / scale, rtol=1e-9)  # the shortest scaled answer
    assert solution.condition > 1e14


def test_fewer_rows_than_columns_have_all_singular_vectors(rng):
    solution = solve(rng.normal(size=(3, 5)), rng.normal(size=3), invisible=np.eye(5)[:2])
    assert solution.singular_vectors.shape == (5, 5)
    assert solution.condition == float("inf")
    np.testing.assert_array_equal(np.abs(solution.values[:2]) < 1e-14, True)


def test_complement_is_orthogonal_and_complete(rng):
    directions = rng.normal(size=(2, 6))
    basis = complement(directions)
    np.testing.assert_allclose(basis.T @ basis, np.eye(4), rtol=0, atol=1e-14)
    np.testing.assert_allclose(directions @ basis, 0, rtol=0, atol=1e-14)


def batch(rng, count, noise=1e-3):
    """Designs like those of a Monte Carlo run: one design and answer, noise in both sides."""
    common = rng.normal(size=(32, 8)) * 10.0 ** np.arange(-4, 4)
    design = common * (1 + noise * rng.normal(size=(count, 32, 8)))
    answer = rng.normal(size=8) / 10.0 ** np.arange(-4, 4)
    right_side = common @ answer + noise * rng.normal(size=(count, 32))
    return design / noise, right_side / noise


def one_by_one(design, right_side):
    solutions = [solve(*pair) for pair in zip(design, right_side, strict=True)]
    return np.array([item.values for item in solutions]), np.array([item.covariance for item in solutions])


def assert_same(got, expected):
    values, covariance = expected
    u = np.sqrt(np.einsum("nii->ni", covariance))
    assert np.all(np.abs(got[0] - values) <= AGREEMENT * u)
    assert np.all(np.abs(got[1] - covariance) <= 1e-9 * u[:, :, None] * u[:, None])


@pytest.mark.parametrize("count", [1, 255, 256, 700])
def test_batch_agrees_with_the_single_solution(count, rng):
    design, right_side = batch(rng, count)
    assert_same(solve_batch(design, right_side), one_by_one(design, right_side))


def test_batch_of_unrelated_problems(rng):
    design, right_side = rng.normal(size=(300, 12, 4)), 1e4 * rng.normal(size=(300, 12))
    assert_same(solve_batch(design, right_side), one_by_one(design, right_side))


def test_ill_conditioned_problems_of_a_batch_are_solved_orthogonally(rng):
    design, right_side = batch(rng, 20)
    # Nearly collinear columns: κ of about 1e7, for which normal equations lose fourteen digits.
    bad = [3, 11]
    design[bad, :, 1] = 10 * design[bad, :, 0] + 1e-6 * design[bad, :, 1]
    got, expected = solve_batch(design, right_side), one_by_one(design, right_side)
    good = np.setdiff1d(np.arange(20), bad)
    assert_same([part[good] for part in got], [part[good] for part in expected])
    u = np.sqrt(np.einsum("nii->ni", expected[1]))
    # Both orthogonal solutions lose κ·ε of the answer, which is about 1e3 u.
    assert np.all(np.abs(got[0] - expected[0])[bad] < 1e-5 * u[bad])
    np.testing.assert_allclose(got[1][bad], expected[1][bad], rtol=1e-7, atol=1e-7 * (u[bad] ** 2).max())


def test_shared_design(rng):
    design, right_side = rng.normal(size=(10, 3)), rng.normal(size=(50, 10))
    expected = one_by_one(np.broadcast_to(design, (50, 10, 3)), right_side)
    assert_same(solve_batch(design, right_side), expected)
    assert_same(solve_batch(np.broadcast_to(design, (50, 10, 3)), right_side), expected)


@pytest.mark.parametrize("spoil", ["zero", "equal", "few rows"])
def test_deficient_designs_are_refused(spoil, rng):
    design = rng.normal(size=(6, 10, 4))
    if spoil == "zero":
        design[2, :, 1] = 0.0
    elif spoil == "equal":
        design[2, :, 1] = design[2, :, 3]
    else:
        design = design[:, :3]
    with pytest.raises(np.linalg.LinAlgError):
        solve_batch(design, np.ones(design.shape[:2]))


def test_an_empty_batch_gives_an_empty_answer():
    values, covariance = solve_batch(np.empty((0, 5, 2)), np.empty((0, 5)))
    assert values.shape == (0, 2)
    assert covariance.shape == (0, 2, 2)


@given(st.integers(0, 2**32 - 1), st.lists(st.floats(1e-6, 1e6), min_size=4, max_size=4))
def test_units_of_the_parameters_do_not_matter(seed, units):
    rng = np.random.default_rng(seed)
    design, right_side, units = rng.normal(size=(15, 4)), rng.normal(size=15), np.array(units)
    plain, scaled = solve(design, right_side), solve(design * units, right_side)
    size = np.sqrt(np.diagonal(plain.covariance))
    # Rounding times the condition (below 100 for 15 random rows of 4, κ·ε ≈ 1e-14) of |q| ≲ 1.
    np.testing.assert_allclose(scaled.values * units, plain.values, rtol=0, atol=1e-11 * size.max())


@given(st.integers(0, 2**32 - 1))
def test_order_of_rows_does_not_matter(seed):
    rng = np.random.default_rng(seed)
    design, right_side, order = rng.normal(size=(15, 4)), rng.normal(size=15), rng.permutation(15)
    plain, other = solve(design, right_side), solve(design[order], right_side[order])
    size = np.sqrt(np.diagonal(plain.covariance))
    np.testing.assert_allclose(other.values, plain.values, rtol=0, atol=1e-11 * size.max())
