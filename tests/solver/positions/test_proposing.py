"""The proposed positions are the best ones: every set is tried here too, by another route.

Currents and orientations come from scipy's rotations (`tests.solver.sessions`), the covariance of
each set from a whitened design of its own, by numpy's inverse.
"""

from itertools import combinations, combinations_with_replacement

import numpy as np
import pytest

from solver.errors import InputError
from solver.inputs import CommonUncertainty
from solver.positions.planning import Circumstances, NoiseModel, Places, predict
from solver.positions.position_search import Tables, best_set, every_set, number_of_sets
from solver.positions.position_tables import tables_of
from solver.positions.proposing import CRITERIA, best_counts, propose
from solver.records import PARAMETERS
from tests.solver.sessions import DEG_PER_H, Setup, grid, to_case, truth

ARCSEC = np.pi / 180 / 3600
LATITUDE = 55.7558
EARTH = 7.292115e-5
SMALL = grid(thetas=(0, 45, 90), psis=(0, 90, 225))
U_CURRENT = 0.005 * DEG_PER_H / truth()[0]


def circumstances(**more) -> Circumstances:
    return Circumstances(truth(), np.radians(LATITUDE), NoiseModel(U_CURRENT * np.sqrt(60.0)), **more)


def angles_of(count: int, seed: int = 3) -> np.ndarray:
    return 30 * ARCSEC * np.random.default_rng(seed).standard_normal((count, 3))


def places(positions: np.ndarray, misalignment: np.ndarray, u: float | np.ndarray = 0.0) -> Places:
    u_angles = np.broadcast_to(u, misalignment.shape)
    return Places(*np.radians(positions).T, *misalignment.T, *u_angles.T)


def whitened_rows(positions: np.ndarray, misalignment: np.ndarray) -> np.ndarray:
    """Two rows of the design for each position, in currents over their noise, (n, 2, 8)."""
    currents = Setup(positions=positions).currents(misalignment)
    up = to_case(np.radians(positions), misalignment)[:, :, 2]
    k = np.array([[truth()[0], truth()[2]], [truth()[3], truth()[1]]])
    rows = []
    for (jx, jy), (c, d, _) in zip(currents, up, strict=True):
        pair = np.array([[jx, 0, jy, 0, 1, 0, c, -d], [0, jy, 0, jx, 0, 1, d, c]])
        rows.append(np.linalg.solve(k, pair) / U_CURRENT)
    return np.array(rows)


def figures(covariance: np.ndarray) -> dict[str, float]:
    """Every criterion of one covariance, SI."""
    k = np.sqrt(truth()[0] * truth()[1] - truth()[2] * truth()[3])
    rates = np.array([EARTH / k] * 4 + [1.0] * 4)
    in_rates = covariance * np.outer(rates, rates)
    found = {
        "D": float(np.exp(np.linalg.slogdet(in_rates)[1] / 16)),
        "A": float(np.sqrt(np.trace(in_rates) / 8)),
    }
    return found | dict(zip(PARAMETERS, np.sqrt(np.diag(covariance)), strict=True))


def every_figure(rows: np.ndarray, count: int, *, repeats: bool) -> dict[str, float]:
    """The smallest of each criterion over all sets, by trying each."""
    choose = combinations_with_replacement if repeats else combinations
    best = dict.fromkeys(CRITERIA, np.inf)
    for chosen in choose(range(len(rows)), count):
        design = rows[list(chosen)].reshape(-1, 8)
        scale = np.linalg.norm(design, axis=0)
        if np.linalg.matrix_rank(design / scale, tol=1e-7) < 8:
            continue
        inverse = np.linalg.inv((design / scale).T @ (design / scale)) / np.outer(scale, scale)
        for name, value in figures(inverse).items():
            best[name] = min(best[name], value)
    return best


@pytest.mark.parametrize("repeats", [False, True])
@pytest.mark.parametrize("searched", ["all", "exchange"])
def test_the_proposed_positions_are_the_best_for_every_criterion(repeats, searched):
    misalignment = angles_of(len(SMALL))
    best = every_figure(whitened_rows(SMALL, misalignment), 5, repeats=repeats)
    for criterion in CRITERIA:
        found = propose(
            places(SMALL, misalignment), 5, 300.0, 0.0, circumstances(), criterion, repeats=repeats,
            exhaustive_up_to=10**6 if searched == "all" else 0,
        )  # fmt: skip
        assert found.exhaustive == (searched == "all")
        assert found.determines
        # Both routes differ by rounding alone; another set differs by arcseconds, 1e-5 and more.
        assert found.figure == pytest.approx(best[criterion], rel=1e-7), criterion
        assert len(found.rows) == 5
        assert repeats or len(set(found.rows.tolist())) == 5


@pytest.mark.parametrize("criterion", CRITERIA)
def test_the_figure_is_that_of_the_prediction(criterion):
    plan = places(SMALL, angles_of(len(SMALL)), u=10 * ARCSEC)
    at = circumstances(common=CommonUncertainty.of({"gain_x": 1e-4, "level_1": 5 * ARCSEC}))
    found = propose(plan, 6, 900.0, 30.0, at, criterion)
    assert found.prediction.duration == 120.0
    assert figures(found.prediction.covariance)[criterion] == pytest.approx(found.figure, rel=1e-8)
    other = predict(plan.chosen(found.rows), 120.0, at)
    np.testing.assert_array_equal(other.covariance, found.prediction.covariance)


def test_tables_give_the_predicted_covariance_with_repeats_and_every_uncertain_input(rng):
    """The sums over candidates against `solver.inputs` on the whole list of positions."""
    plan = places(SMALL, angles_of(len(SMALL)), u=rng.uniform(1, 20, (len(SMALL), 3)) * ARCSEC)
    common = CommonUncertainty.of(
        {"gain_x": 1e-4, "gain_y": 2e-4, "offset_x": 1e-9, "azimuth": 20 * ARCSEC, "latitude": 5 * ARCSEC},
        correlation={("gain_x", "gain_y"): 0.7},
    )
    at = circumstances(common=common)
    tables = tables_of(plan, 100.0, at)
    for _ in range(20):
        counts = np.bincount(rng.integers(0, len(SMALL), 9), minlength=len(SMALL))
        counts[:8] += 1  # enough of them to determine everything
        found = tables.covariances(counts[None])[0] * np.outer(tables.scale, tables.scale)
        rows = np.repeat(np.arange(len(SMALL)), counts)
        expected = predict(plan.chosen(rows), 100.0, at).covariance
        u = np.sqrt(np.diag(expected))
        np.testing.assert_allclose(found / np.outer(u, u), expected / np.outer(u, u), atol=1e-8)
        leaving, coming = np.array([0, 0, 3]), np.array([8, 1, 2])
        exchanged = np.repeat(counts[None], 3, axis=0)
        exchanged[np.arange(3), leaving] -= 1
        exchanged[np.arange(3), coming] += 1
        np.testing.assert_allclose(
            tables.after_exchange(counts, leaving, coming),
            tables.covariances(exchanged),
            rtol=1e-6,
            atol=1e-12,
        )


def test_certified_angles_of_a_half_turn_decide_between_twins():
    """θ and ψ both turned by 180° give the same a, b, c, d: the better certified of the two is taken."""
    whole = grid(thetas=(0, 45, 90, 180, 225, 270), psis=(0, 90, 180, 270))
    u = np.where(np.isin(whole[:, 0], (0, 45, 90)), 200.0, 1.0) * ARCSEC
    found = propose(places(whole, np.zeros((24, 3)), u[:, None]), 5, 300.0, 0.0, circumstances())
    assert set(whole[found.rows, 0]) <= {180, 225, 270}
    tables = tables_of(places(whole, np.zeros((24, 3))), 60.0, circumstances())
    assert len(np.unique(tables.twins)) == 12


def test_every_set_is_tried_once():
    for repeats, choose in ((False, combinations), (True, combinations_with_replacement)):
        blocks = np.concatenate(list(every_set(7, 4, repeats=repeats)))
        expected = [np.bincount(chosen, minlength=7) for chosen in choose(range(7), 4)]
        np.testing.assert_array_equal(blocks, expected)
        assert len(blocks) == number_of_sets(7, 4, repeats=repeats)


def test_an_exchange_on_the_paper_s_grid_finds_what_trying_all_finds():
    """12 870 sets of eight among sixteen, with arcseconds of misalignment: each criterion, both ways."""
    plan, at = places(grid(), angles_of(16)), circumstances()
    for criterion in ("D", "A", "kx", "wg"):
        all_tried = propose(plan, 8, 480.0, 0.0, at, criterion)
        exchanged = propose(plan, 8, 480.0, 0.0, at, criterion, exhaustive_up_to=0)
        assert all_tried.exhaustive
        assert all_tried.tried == 12_870
        # The exchange may end beside the best by what arcseconds make of u, 1e-4, never more.
        assert exchanged.figure == pytest.approx(all_tried.figure, rel=1e-4)
        assert exchanged.figure >= all_tried.figure * (1 - 1e-9)


def test_equal_questions_have_equal_answers():
    wide = grid(thetas=range(0, 360, 45), psis=range(0, 360, 45))
    plan = places(wide, angles_of(64))
    one, other = (propose(plan, 8, 480.0, 0.0, circumstances(), "A") for _ in range(2))
    np.testing.assert_array_equal(one.rows, other.rows)
    assert one.figure == other.figure
    # Ten thousand random sets, and the sixteen's own halves, are no better.
    rng = np.random.default_rng(11)
    random = [rng.choice(64, 8, replace=False) for _ in range(10_000)]
    tables = tables_of(plan, 60.0, circumstances())
    counts = np.array([np.bincount(rows, minlength=64) for rows in random])
    variances = np.einsum("bii->bi", tables.covariances(counts)) * tables.scale**2
    k = np.sqrt(truth()[0] * truth()[1] - truth()[2] * truth()[3])
    rates = np.array([EARTH / k] * 4 + [1.0] * 4)
    assert np.sqrt((variances * rates**2).mean(axis=1)).min() > one.figure


def test_how_many_positions_are_worth_it():
    """With a floor, more positions pay until moving eats the time; each number's answer is a proposal's."""
    at = circumstances()
    floored = Circumstances(at.parameters, at.latitude, NoiseModel(at.noise.white, 2 * U_CURRENT))
    plan = places(grid(), angles_of(16))
    found = best_counts(plan, range(2, 20), 1600.0, 20.0, floored, "A")
    assert [len(item.rows) for item in found] == list(range(4, 17))
    assert found[0].figure > 1.5 * found[-1].figure
    assert found[0].prediction.duration == 380.0
    for item in found:
        alone = propose(plan, len(item.rows), 1600.0, 20.0, floored, "A")
        assert item.figure == pytest.approx(alone.figure, rel=1e-3)  # the shorter search may miss arcseconds
    hasty = best_counts(plan, range(4, 17), 1600.0, 120.0, at, "A")
    assert len(hasty[-1].rows) == 13  # 14 positions take 1680 s to reach
    # Without a floor moving only costs, once there are more positions than parameters need.
    assert [item.figure for item in hasty[1:]] == sorted(item.figure for item in hasty[1:])


def test_with_repeats_few_different_positions_are_enough():
    once = propose(places(SMALL, angles_of(9)), 9, 540.0, 0.0, circumstances())
    often = propose(places(SMALL, angles_of(9)), 9, 540.0, 0.0, circumstances(), repeats=True)
    assert often.figure < once.figure
    assert len(set(often.rows.tolist())) < 9


def test_sets_in_which_noise_hides_the_scale_factors_are_not_proposed():
    """Without drift, θ = 90° and 270° alone show ωg best, but as at a pole K could stand for it."""
    nothing = Circumstances(truth(w0x=0, w0y=0, wg=0, wk=0, kxy=0, kyx=0), 0.97, circumstances().noise)
    plan = places(grid(), np.zeros((16, 3)))
    for count in (4, 6):
        found = propose(plan, count, 60.0 * count, 0.0, nothing, "wg")
        assert found.determines
        assert not found.prediction.undetermined.any()
        figures_of_others = []
        rng = np.random.default_rng(count)
        for _ in range(80):
            other = predict(plan.chosen(rng.choice(16, count, replace=False)), 60.0, nothing)
            if not other.undetermined[6]:
                figures_of_others.append(other.u[6])
        assert min(figures_of_others) >= found.figure * (1 - 1e-9)


def test_nothing_is_proposed_where_nothing_is_determined():
    pole = Circumstances(truth(), np.pi / 2, NoiseModel(U_CURRENT))
    found = propose(places(grid(), np.zeros((16, 3))), 8, 480.0, 0.0, pole)
    assert not found.determines
    assert "at a pole" in found.prediction.warnings[0].text
    level = propose(places(grid(thetas=(0,)), np.zeros((4, 3))), 4, 240.0, 0.0, circumstances(), "w0x")
    assert level.determines
    assert level.prediction.undetermined[6:].all()
    # ω0x alone: K and ω0 of θ = 0 stand in eight equations for six unknowns; by trying the only set.
    rows = whitened_rows(grid(thetas=(0,)), np.zeros((4, 3))).reshape(-1, 8)[:, :6]
    expected = np.sqrt(np.linalg.inv(rows.T @ rows)[4, 4])
    assert level.figure == pytest.approx(expected, rel=1e-6)


def test_questions_without_an_answer_are_refused():
    plan, at = places(SMALL, angles_of(9)), circumstances()
    for arguments, code in (
        ((plan, 3, 600.0, 0.0, at), "too-few-positions"),
        ((plan, 10, 600.0, 0.0, at), "too-many-positions"),
        ((plan, 5, 600.0, 120.0, at), "no-time"),
        ((plan, 5, 600.0, 0.0, at, "E"), "unknown-criterion"),
    ):
        with pytest.raises(InputError) as error:
            propose(*arguments)
        assert error.value.message.code == code


def test_ties_are_settled_by_order():
    """Four equal candidates of a problem in two parameters padded to eight: the first ones are taken."""
    tables = Tables(np.repeat(np.eye(8).reshape(1, 64), 6, axis=0), None, None, np.ones(8), np.arange(6))
    found = best_set(tables, 3, lambda covariance: np.einsum("bii->b", covariance))
    assert found.counts.tolist() == [1, 1, 1, 0, 0, 0]
