"""All dates at once: against one least-squares fit for each date, and the largest gain's chance against simulation."""

import numpy as np
import pytest

from solver.drift.courses.regression import LINE, Series, Structure, design
from solver.drift.courses.sweep import Kind, Remainder, chain_probability, f_ratio


def series(seed: int, n: int = 40) -> Series:
    """Uneven times, two of one moment, uneven uncertainties."""
    rng = np.random.default_rng(seed)
    x = np.sort(rng.uniform(-1.0, 0.0, n))
    x[7] = x[6]
    u = rng.uniform(0.05, 0.4, n)
    return Series(x, rng.normal(size=n) * u + 0.3 * (x > -0.4), u**2)


def added(kind: Kind, x: np.ndarray, index: int) -> np.ndarray:
    """The column of one change, forwards in time."""
    if kind == "steps":
        return (np.arange(len(x)) >= index).astype(float)
    if kind == "bends":
        return np.maximum(x - x[index - 1], 0.0)
    return (np.arange(len(x)) == index).astype(float)


@pytest.mark.parametrize("kind", ["steps", "bends", "outliers"])
def test_gain_of_every_date_is_that_of_a_fit(kind: Kind) -> None:
    """numpy's least squares at each date, weights held; 1e-8 of the sum of squares is rounding in sums of 40."""
    data = series(1)
    structure = Structure(breaks=(12,), bends=(25,), outliers=(30,))
    columns = design(data.x, structure, LINE)
    ground = Remainder.of(data, columns, structure, tau2=0.01)
    swept = ground.sweep(kind)
    kept = np.array([one for one in range(40) if one != 30])
    root = 1.0 / np.sqrt(data.known + 0.01)

    def squares(matrix: np.ndarray) -> float:
        weighted, right = (matrix * root[:, None])[kept], (data.y * root)[kept]
        answer = np.linalg.lstsq(weighted, right, rcond=None)[0]
        return float(np.sum((right - weighted @ answer) ** 2))

    plain = squares(columns)
    assert swept.squares == pytest.approx(plain, rel=1e-10)
    expected = [plain - squares(np.column_stack((columns, added(kind, data.x, one)))) for one in swept.index]
    np.testing.assert_allclose(swept.gain, expected, rtol=0, atol=1e-8 * plain)


def test_dates_that_cannot_be() -> None:
    """Three values on a step's either side, six on a bend's, none within one moment, none beside its like."""
    data = series(2)
    structure = Structure(breaks=(20,))
    ground = Remainder.of(data, design(data.x, structure, LINE), structure)
    free = set(range(3, 38)) - {7} - set(range(18, 23))
    assert set(ground.sweep("steps").index) == free
    assert set(ground.sweep("bends").index) == set(range(6, 35)) - {7}
    assert set(ground.sweep("outliers").index) == set(range(40))


@pytest.mark.parametrize(("n", "uneven"), [(12, False), (60, False), (60, True)])
def test_largest_gain_is_as_rare_as_said(n: int, uneven: bool) -> None:
    """Sup-F over all dates of step and bend beside a line, simulated: the bound holds and is not wasteful.

    4000 histories without any change, F where the bound says 5 %. Binomial standard error 0.34 %: at most four of them
    above. The bound counts pairs of neighbours only, and the two kinds apart: it may lose two fifths at this level.
    """
    rng = np.random.default_rng([7, n])
    x = np.sort(rng.uniform(-1.0, 0.0, n)) if uneven else np.linspace(-1.0, 0.0, n)
    u = rng.uniform(0.5, 2.0, n) if uneven else np.ones(n)
    ground = Remainder.of(Series(x, np.zeros(n), u**2), design(x, Structure(), LINE), Structure(), tau2=0.0)
    kinds: tuple[Kind, ...] = ("steps", "bends")
    swept = [ground.sweep(kind) for kind in kinds]

    def chance(f: float) -> float:
        return sum(chain_probability(one.angle, f, ground.dof) for one in swept)

    low, high = 1.0, 1000.0
    for _ in range(60):
        low, high = (
            (0.5 * (low + high), high) if chance(0.5 * (low + high)) > 0.05 else (low, 0.5 * (low + high))
        )
    basis = ground.basis
    noise = rng.normal(size=(4000, n))
    rest = noise - noise @ basis @ basis.T
    units = []
    for one in swept:
        columns = np.stack([added(one.kind, x, index) for index in one.index], axis=1) * ground.root[:, None]
        left = columns - basis @ (basis.T @ columns)
        units.append(left / np.linalg.norm(left, axis=0))
    gain = np.max((rest @ np.concatenate(units, axis=1)) ** 2, axis=1)
    f = np.array(
        [f_ratio(one, two, ground.dof) for one, two in zip(gain, np.sum(rest**2, axis=1), strict=True)]
    )
    share = float(np.mean(f > low))
    assert 0.03 < share < 0.05 + 4 * 0.0034


def test_dates_sum_to_one_and_follow_the_likelihood() -> None:
    swept = Remainder.of(series(3), design(series(3).x, Structure(), LINE), Structure()).sweep("steps")
    dates = swept.dates()
    assert dates.sum() == pytest.approx(1.0)
    assert int(np.argmax(dates)) == swept.best
    ratio = ((swept.squares - swept.gain[3]) / (swept.squares - swept.gain[9])) ** (-0.5 * swept.dof)
    assert dates[3] / dates[9] == pytest.approx(ratio, rel=1e-9)


def test_a_single_date_has_the_probability_of_its_f_test() -> None:
    """F of 1 and 10 degrees of freedom: 4.96 is its 5 % point (any table of F, e.g. NIST/SEMATECH 1.3.6.7.3: 4.965)."""
    assert chain_probability(np.zeros(0), 4.965, 11) == pytest.approx(0.05, abs=5e-5)


def test_perpendicular_dates_add_up_and_equal_ones_do_not() -> None:
    single = chain_probability(np.zeros(0), 9.0, 30)
    assert chain_probability(np.zeros(5), 9.0, 30) == pytest.approx(single, rel=1e-12)
    both = chain_probability(np.array([0.5 * np.pi]), 9.0, 30)
    # 2·P less P of both at once, which is far smaller than P here; 1e-3 is the quadrature.
    assert both == pytest.approx(2 * single, rel=2e-3)
