"""Average run lengths against the published tables, to their digits, and against counting by hand."""

from itertools import pairwise, permutations

import numpy as np
import pytest

from solver.drift.control import run_length
from solver.drift.control.run_rules import NELSON, WESTERN_ELECTRIC

ONE = np.ones(1)


def of_rules(names: tuple[str, ...], shift: float = 0.0) -> float:
    return float(run_length.of_rules(names, lambda width: width * ONE, shift * ONE)[0])


def of_ewma(weight: float, width: float, shift: float) -> float:
    """With the limits of many values from the first one on."""
    limit = width * (weight / (2 - weight)) ** 0.5
    return float(run_length.of_ewma(weight, np.array([[limit]]), shift * ONE)[0])


def of_cusum(allowance: float, decision: float, shift: float) -> float:
    found = run_length.of_cusum(
        allowance, decision, lambda z: z * ONE, lambda z: np.ones_like(z), shift * ONE
    )
    return float(found[0])


def printed(value: float, digits: int) -> str:
    """Rounded to so many significant digits."""
    return f"{value:#.{digits}g}".rstrip(".")


@pytest.mark.parametrize(
    ("names", "expected"),
    [
        (("nelson-1",), 370.40),
        (("nelson-1", "nelson-5"), 225.44),
        (("nelson-1", "nelson-6"), 166.05),
        (("nelson-1", "western-electric-4"), 152.73),
        (WESTERN_ELECTRIC, 91.75),
    ],
)
def test_western_electrics_rules(names: tuple[str, ...], expected: float) -> None:
    """C. W. Champ and W. H. Woodall, Technometrics 29 (1987) 393-399, table 1, no shift."""
    assert round(of_rules(names), 2) == expected


def test_nelsons_statements() -> None:
    """L. S. Nelson (1984, 1985): each gives a false signal in less than 5 of 1000, 1-4 in less than 10, 1-6 in 20."""
    for name in NELSON:
        assert 1 / of_rules((name,)) + 1 / run_length.of_orders((name,)) < 0.005
    first = 1 / of_rules(NELSON[:4]) + 1 / run_length.of_orders(("nelson-3", "nelson-4"))
    more = 1 / of_rules(NELSON[:6]) + 1 / run_length.of_orders(("nelson-3", "nelson-4"))
    assert first < 0.01 < more < 0.02


def test_a_run_of_nine() -> None:
    """A run of r heads or of r tails takes 2^r − 1 tosses on average (W. Feller, Probability Theory, XIII.7)."""
    assert of_rules(("western-electric-4",)) == pytest.approx(2.0**8 - 1.0, rel=1e-9)
    assert of_rules(("nelson-2",)) == pytest.approx(2.0**9 - 1.0, rel=1e-9)


SHIFTS = (0.0, 0.25, 0.5, 0.75, 1.0, 1.5, 2.0, 2.5, 3.0, 4.0)


@pytest.mark.parametrize(
    ("decision", "expected"),
    [
        (4.0, ("168", "74.2", "26.6", "13.3", "8.38", "4.75", "3.34", "2.62", "2.19", "1.71")),
        (5.0, ("465", "139", "38.0", "17.0", "10.4", "5.75", "4.01", "3.11", "2.57", "2.01")),
    ],
)
def test_cusum(decision: float, expected: tuple[str, ...]) -> None:
    """J. M. Lucas and R. B. Crosier, Technometrics 24 (1982) 199-205, table 1, k = 0.5; also Montgomery, table 9.3."""
    assert tuple(printed(of_cusum(0.5, decision, shift), 3) for shift in SHIFTS) == expected


def test_cusum_of_the_sas_manual() -> None:
    """SAS/QC User's Guide, CUSUMARL('twosided', 2.5, 8, 0.25): 4.1500826715; one side alone: 4.1500836225."""
    # Its 24 nodes hold seven digits: the other side cannot make the difference, it signals once in ages.
    assert of_cusum(0.25, 8.0, 2.5) == pytest.approx(4.1500826715, abs=1.5e-6)


def test_ewma_of_lucas_and_saccucci() -> None:
    """Technometrics 32 (1990) 1-12, table 3: λ 0.5, L 3.071 and λ 0.03, L 2.437; Markov chain, last digit by one."""
    table = {0.0: ("500", "500"), 0.25: ("255", "76.7"), 0.5: ("88.8", "29.3"), 0.75: ("35.9", "17.6"),
             1.0: ("17.5", "12.6"), 1.5: ("6.53", "8.07"), 2.0: ("3.63", "5.99"), 3.0: ("1.93", "4.03")}  # fmt: skip
    for shift, expected in table.items():
        for (weight, width), text in zip(((0.5, 3.071), (0.03, 2.437)), expected, strict=True):
            last = 10.0 ** -(len(text.partition(".")[2]))
            assert of_ewma(weight, width, shift) == pytest.approx(float(text), abs=1.01 * last)


def test_ewma_of_crowder() -> None:
    """S. V. Crowder, Technometrics 29 (1987) 401-407, table 1, L = 2: λ 0.5 and 0.05, by integral equations.

    Left out are two entries that are not rounded but wrong or cut off: 3.95 and 1.94 for λ 0.5, shifts 1.25 and 2.
    """
    table = {0.0: (26.45, 127.53), 0.25: (20.12, 43.94), 0.5: (11.89, 18.97), 0.75: (7.29, 11.64), 1.0: (4.91, 8.38),
             1.5: (2.80, 5.41), 3.0: (1.26, 2.76), 4.0: (1.05, 2.15)}  # fmt: skip
    for shift, expected in table.items():
        assert (round(of_ewma(0.5, 2.0, shift), 2), round(of_ewma(0.05, 2.0, shift), 2)) == expected


def test_ewma_of_the_sas_manual() -> None:
    """SAS/QC User's Guide, EWMAARL(1.00, 0.25, 3.0): 11.154267016."""
    assert of_ewma(0.25, 3.0, 1.0) == pytest.approx(11.154267016, abs=5e-9)


def test_an_ewma_of_weight_one_is_a_chart_of_individuals() -> None:
    assert of_ewma(1.0, 3.0, 0.7) == pytest.approx(of_rules(("nelson-1",), 0.7), rel=1e-6)


def test_limits_that_vary_in_the_first_steps() -> None:
    """Simulated: exact limits of λ = 0.1 and L = 2.7, a shift of 1; four standard errors of 40 000 runs."""
    rng, weight, runs = np.random.default_rng(12), 0.1, 40_000
    steps = np.arange(1, 90)
    limits = 2.7 * (weight / (2 - weight) * (1 - 0.9 ** (2 * steps))) ** 0.5
    average, length, going = np.zeros(runs), np.zeros(runs), np.ones(runs, bool)
    for limit in limits:  # 89 values: one run in 1e10 is longer
        average = 0.9 * average + weight * (1.0 + rng.normal(size=runs))
        length += going
        going &= np.abs(average) <= limit
    found = float(run_length.of_ewma(weight, limits[:, None], ONE)[0])
    assert not going.any()
    assert found == pytest.approx(length.mean(), abs=4 * length.std() / runs**0.5)
    assert found < of_ewma(weight, 2.7, 1.0) - 1  # they find it sooner


@pytest.mark.parametrize("names", [("nelson-3",), ("nelson-4",), ("nelson-3", "nelson-4")])
def test_trends_and_turns_by_counting_orders(names: tuple[str, ...]) -> None:
    """Shorter rules, three steps or four turns: chance of none among n values, by trying all n! orders for n ≤ 8."""
    steps = 3 if "nelson-3" in names else 0
    turns = 4 if "nelson-4" in names else 0
    ones = max(turns, 1)
    alive = np.zeros((2, ones + max(steps - 2, 1), 2))
    alive[0, 0, 0] = alive[1, 0, 1] = 0.5
    for n in range(3, 9):
        alive = run_length._with_one_more(alive, ones, turns > 0, steps > 0)
        free = [order for order in permutations(range(n)) if not _pattern(order, steps, turns)]
        assert alive.sum() == pytest.approx(len(free) / np.prod(np.arange(1.0, n + 1)), rel=1e-12)


def _pattern(order: tuple[int, ...], steps: int, turns: int) -> bool:
    up = [b > a for a, b in pairwise(order)]
    turned = [a != b for a, b in pairwise(up)]
    trend = steps and any(len(set(up[i : i + steps])) == 1 for i in range(len(up) - steps + 1))
    return bool(trend or (turns and any(all(turned[i : i + turns]) for i in range(len(turned) - turns + 1))))


@pytest.mark.parametrize(("name", "marks"), [("nelson-3", 4), ("nelson-4", 12)])
def test_trends_and_turns_simulated(name: str, marks: int) -> None:
    """Mean of 4000 runs until so many steps in a row are as the one before, or not; four standard errors."""
    rng, runs = np.random.default_rng(13), 4000
    last, before = rng.normal(size=(2, runs))
    up, in_a_row = last > before, np.zeros(runs)
    length, going = np.full(runs, 2.0), np.ones(runs, bool)
    while going.mean() > 2e-3:
        value = rng.normal(size=runs)
        marked = ((value > last) == up) == (name == "nelson-3")
        in_a_row = np.where(marked, in_a_row + 1, 0)
        length += going
        going &= in_a_row < marks
        up, last = value > last, value
    # Those that still go on will do so for as long again, on average.
    length[going] += run_length.of_orders((name,))
    assert length.mean() == pytest.approx(run_length.of_orders((name,)), abs=4 * length.std() / runs**0.5)


def test_nothing_chosen_never_ends() -> None:
    assert of_rules(("nelson-3",)) == float("inf")
    assert run_length.of_orders(("nelson-1",)) == float("inf")
