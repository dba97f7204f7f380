"""Paule and Mandel's τ²: against its definition solved by bisection, against published numbers, and at the edges."""

import numpy as np
import pytest
from scipy.optimize import brentq

from solver.drift.scatter import paule_mandel
from solver.errors import InputError


def excess(tau2: float, y: np.ndarray, u: np.ndarray, design: np.ndarray) -> float:
    """Q(τ²) − (n − p), each fit by numpy's own least squares."""
    root = 1.0 / np.sqrt(u**2 + tau2)
    beta = np.linalg.lstsq(design * root[:, None], y * root, rcond=None)[0]
    return float(np.sum(((y - design @ beta) * root) ** 2) - (len(y) - design.shape[1]))


@pytest.mark.parametrize("terms", [1, 2, 3])
@pytest.mark.parametrize("tau", [0.0, 0.3, 10.0])
def test_is_the_root_of_its_equation(terms: int, tau: float) -> None:
    """Against a bracketing solver; 1e-6 because both stop at about 1e-9 of τ² or at 1e-12 of the variance."""
    rng = np.random.default_rng([11, terms])
    for _ in range(20):
        n = int(rng.integers(terms + 2, 40))
        design = np.vander(np.linspace(0.0, 1.0, n), terms)
        u = rng.lognormal(-1.0, 1.0, n)
        y = design.sum(axis=1) + rng.normal(size=n) * np.sqrt(u**2 + tau**2)
        found = paule_mandel(y, u, design)
        if excess(0.0, y, u, design) <= 0.0:
            assert found == 0.0
        else:
            root = brentq(excess, 0.0, 1e6, args=(y, u, design), xtol=1e-14, rtol=1e-12)
            assert found == pytest.approx(root, rel=1e-6, abs=1e-10)


def test_equal_uncertainties_are_analysis_of_variance() -> None:
    """τ² = s² − u² (GUM H.5: the variance of means is s_B² + s_W²/K)."""
    y = np.array([10.2, 9.7, 10.9, 10.1, 9.1])
    expected = np.var(y, ddof=1) - 0.3**2
    assert paule_mandel(y, np.full(5, 0.3)) == pytest.approx(expected, rel=1e-12)
    assert paule_mandel(y, np.zeros(5)) == pytest.approx(np.var(y, ddof=1), rel=1e-9)


def test_a_value_without_uncertainty_beside_others_that_have_one() -> None:
    y, u = np.array([1.0, 3.0, -2.0, 4.0, 0.5]), np.array([0.0, 0.1, 0.1, 0.1, 0.1])
    found = paule_mandel(y, u)
    assert excess(found, y, u, np.ones((5, 1))) == pytest.approx(0.0, abs=1e-9)


def test_unit_and_origin_do_not_matter() -> None:
    rng = np.random.default_rng(3)
    y, u = rng.normal(size=25), rng.uniform(0.1, 0.9, 25)
    plain = paule_mandel(y, u)
    assert paule_mandel(1e-9 * y, 1e-9 * u) == pytest.approx(1e-18 * plain, rel=1e-9)
    assert paule_mandel(y + 1e4, u) == pytest.approx(plain, rel=1e-7)  # 1e4·ε of the values' scatter is lost


def test_the_mean_of_many_is_the_truth() -> None:
    """Unbiased where it is not cut off at 0; the bound is four standard errors of the mean of 400."""
    rng = np.random.default_rng(5)
    u = rng.uniform(0.1, 0.6, 30)
    found = [paule_mandel(rng.normal(size=30) * np.hypot(u, 1.0), u) for _ in range(400)]
    assert abs(np.mean(found) - 1.0) < 4 * np.std(found) / 20


@pytest.mark.parametrize(
    ("values", "u"), [([5.0], [0.1]), ([5.0, 5.0, 5.0], [0.0, 0.0, 0.0]), ([1.0, 1.1, 0.9], [1.0, 1.0, 1.0])]
)
def test_nothing_to_find(values: list[float], u: list[float]) -> None:
    assert paule_mandel(values, u) == 0.0


def test_refuses_what_it_cannot_read() -> None:
    with pytest.raises(InputError, match="equally many"):
        paule_mandel([1.0, 2.0], [0.1])
    with pytest.raises(InputError, match="finite"):
        paule_mandel([1.0, np.nan], [0.1, 0.1])
