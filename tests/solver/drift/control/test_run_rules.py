"""Run rules against their wording, word by word, and at gaps and changes."""

from itertools import pairwise

import numpy as np
import pytest

from solver.drift.control.run_rules import NELSON, RULES, WESTERN_ELECTRIC, Violation, violations
from solver.errors import InputError


def meets(rule: str, z: list[float]) -> int | None:
    """Does the pattern end with the last of these values? Its first value's place; Nelson's (1984) words as code."""
    steps = [b - a for a, b in pairwise(z)]
    same = {"nelson-1": (1, 1, 3), "nelson-5": (2, 3, 2), "nelson-6": (4, 5, 1), "nelson-2": (9, 9, 0),
            "western-electric-4": (8, 8, 0)}  # fmt: skip
    if rule in same:
        needed, window, width = same[rule]
        for side in (1, -1):
            places = [i for i in range(max(0, len(z) - window), len(z)) if side * z[i] > width]
            if len(places) >= needed and places[-1] == len(z) - 1:
                return places[0]
    elif rule == "nelson-3":
        if len(z) >= 6 and (all(s > 0 for s in steps[-5:]) or all(s < 0 for s in steps[-5:])):
            return len(z) - 6
    elif rule == "nelson-4":
        if len(z) >= 14 and all(a * b < 0 for a, b in pairwise(steps[-13:])):
            return len(z) - 14
    elif rule == "nelson-7":
        if len(z) >= 15 and all(abs(v) < 1 for v in z[-15:]):
            return len(z) - 15
    elif rule == "nelson-8" and len(z) >= 8 and all(abs(v) > 1 for v in z[-8:]):
        return len(z) - 8
    return None


def word_by_word(rule: str, z: list[float], begin: int) -> list[tuple[int, int, int]]:
    """First, last and raised of the patterns in one stretch, those that overlap or touch joined."""
    found: list[tuple[int, int, int]] = []
    for end in range(len(z)):
        first = meets(rule, z[: end + 1])
        if first is None:
            continue
        if found and begin + first <= found[-1][1] + 1:
            found[-1] = (found[-1][0], begin + end, found[-1][2])
        else:
            found.append((begin + first, begin + end, begin + end))
    return found


@pytest.mark.parametrize("rule", RULES)
def test_is_the_rule_as_worded(rule: str) -> None:
    """Coarse values, drifting, alternating, calm and wild by turns, so that every rule is met; 40 per stretch."""
    rng = np.random.default_rng(8)
    z, label = [], []
    for number in range(60):
        kind = number % 4
        calm = rng.normal(scale=(0.4, 1.5, 1.0, 1.0)[kind], size=40)
        extra = (0, 0, np.cumsum(rng.normal(size=40)) * 0.5, np.resize([1.5, -1.5], 40))[kind]
        z += (np.round((calm + extra) * 4) / 4 + 0.05).tolist()
        label += [number] * 40
    expected = [item for n in range(60) for item in word_by_word(rule, z[40 * n : 40 * n + 40], 40 * n)]
    got = [(item.first, item.last, item.raised) for item in violations(z, [rule], label)]
    if RULES[rule].pattern in ("beyond", "trend"):
        # Both sides are joined apart from each other; these stretches are too short for that to matter in order.
        got, expected = sorted(_joined(got)), sorted(_joined(expected))
    assert expected
    assert got == expected


def _joined(items: list[tuple[int, int, int]]) -> list[tuple[int, int, int]]:
    joined: list[tuple[int, int, int]] = []
    for item in sorted(items):
        if joined and item[0] <= joined[-1][1] + 1 and item[0] // 40 == joined[-1][0] // 40:
            joined[-1] = (joined[-1][0], max(joined[-1][1], item[1]), min(joined[-1][2], item[2]))
        else:
            joined.append(item)
    return joined


def test_a_violation_knows_its_points_and_its_side() -> None:
    z = [0.5, -0.1, 2.1, 0.3, 2.5, 2.2, 0.1, -3.5, -3.2]
    assert violations(z, ["nelson-1", "nelson-5"]) == (
        Violation("nelson-5", 2, 5, 4, 1),
        Violation("nelson-1", 7, 8, 7, -1),
        Violation("nelson-5", 7, 8, 8, -1),
    )


def test_a_run_ends_at_a_gap_and_at_a_change() -> None:
    z = np.full(16, 0.5)
    assert len(violations(z, ["nelson-2"])) == 1
    z[8] = np.nan
    assert violations(z, ["nelson-2"]) == ()
    assert violations(np.full(16, 0.5), ["nelson-2"], [0] * 8 + [1] * 8) == ()
    rising = np.arange(10.0)
    assert [item.raised for item in violations(rising, ["nelson-3"])] == [5]
    assert violations(rising, ["nelson-3"], [0] * 5 + [1] * 5) == ()
    turning = np.resize([1.0, -1.0], 20)
    assert [item.raised for item in violations(turning, ["nelson-4"])] == [13]
    assert violations(turning, ["nelson-4"], [0] * 10 + [1] * 10) == ()


def test_equal_values_are_neither_up_nor_down() -> None:
    assert violations([0.0, 1.0, 2.0, 2.0, 3.0, 4.0, 5.0], ["nelson-3"]) == ()
    assert violations(np.zeros(20), ["nelson-2", "nelson-4"]) == ()


def test_sets_name_rules_and_nothing_is_found_in_nothing() -> None:
    assert set(NELSON) | set(WESTERN_ELECTRIC) == set(RULES)
    assert violations([], NELSON) == ()
    for code, rule in RULES.items():
        assert rule.description.code == code


def test_an_unknown_rule_is_refused() -> None:
    with pytest.raises(InputError, match="no run rule called nelson-9"):
        violations([0.0], ["nelson-9"])
