"""Run rules: patterns that a quantity in control draws seldom, found in its standardised values.

As data, each with the paper's numbers: L. S. Nelson, The Shewhart control chart: tests for special causes, J. Quality
Technology 16 (1984) 237-239, tests 1 to 8; Western Electric, Statistical Quality Control Handbook (1956), zone rules
1 to 4, of which three are among Nelson's. A pattern is met at the point that completes it. Points that
follow and still meet it prolong the same violation; a gap (NaN) or another segment ends every pattern.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Final, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from solver.errors import InputError, Message
from solver.records import Array

Pattern = Literal["beyond", "apart", "within", "trend", "alternating"]
Mask = NDArray[np.bool_]


@dataclass(frozen=True, slots=True)
class Rule:
    """One pattern.

    Attributes
    ----------
    pattern
        beyond: `needed` of `window` points in a row more than `width` from the centre on one side, the last
        of them among those; apart: all of them so far on either side; within: all nearer than `width`; trend: each
        above the one before, or each below; alternating: up and down by turns.
    needed, window, width
        Numbers of points, and standard deviations.
    description
        For people.
    """

    pattern: Pattern
    needed: int
    window: int
    width: float
    description: Message


_BEYOND: Final = Message("nelson-1", "A point beyond the control limits.")
_NINE: Final = Message("nelson-2", "Nine points in a row on one side of the centre.")
_SIX: Final = Message("nelson-3", "Six points in a row, each higher than the one before, or each lower.")
_FOURTEEN: Final = Message("nelson-4", "Fourteen points in a row, up and down by turns.")
_TWO: Final = Message("nelson-5", "Two of three points in a row beyond two standard deviations on one side.")
_FOUR: Final = Message("nelson-6", "Four of five points in a row beyond one standard deviation on one side.")
_FIFTEEN: Final = Message("nelson-7", "Fifteen points in a row within one standard deviation.")
_EIGHT: Final = Message("nelson-8", "Eight points in a row, none within one standard deviation.")
_WESTERN: Final = Message("western-electric-4", "Eight points in a row on one side of the centre.")

RULES: Final[Mapping[str, Rule]] = MappingProxyType(
    {
        "nelson-1": Rule("beyond", 1, 1, 3.0, _BEYOND),
        "nelson-2": Rule("beyond", 9, 9, 0.0, _NINE),
        "nelson-3": Rule("trend", 6, 6, 0.0, _SIX),
        "nelson-4": Rule("alternating", 14, 14, 0.0, _FOURTEEN),
        "nelson-5": Rule("beyond", 2, 3, 2.0, _TWO),
        "nelson-6": Rule("beyond", 4, 5, 1.0, _FOUR),
        "nelson-7": Rule("within", 15, 15, 1.0, _FIFTEEN),
        "nelson-8": Rule("apart", 8, 8, 1.0, _EIGHT),
        "western-electric-4": Rule("beyond", 8, 8, 0.0, _WESTERN),
    }
)
"""By code; Western Electric's rules 1 to 3 are Nelson's tests 1, 5 and 6."""
NELSON: Final = (
    "nelson-1", "nelson-2", "nelson-3", "nelson-4", "nelson-5", "nelson-6", "nelson-7", "nelson-8",
)  # fmt: skip
"""Nelson's tests 1 to 8."""
WESTERN_ELECTRIC: Final = ("nelson-1", "nelson-5", "nelson-6", "western-electric-4")
"""The zone rules 1 to 4."""


@dataclass(frozen=True, slots=True)
class Violation:
    """A rule that was met, by one pattern or by several that overlap or touch.

    Attributes
    ----------
    rule
        Its code; ``ewma`` and ``cusum`` for the statistics of these charts.
    first, last
        Indices of the first and the last point of it.
    raised
        Index of the point that completed it first: when it could be known.
    side
        +1 above or upwards, −1 below or downwards, 0 where a rule has no side.
    """

    rule: str
    first: int
    last: int
    raised: int
    side: int


def violations(z: ArrayLike, names: Sequence[str], segment: ArrayLike | None = None) -> tuple[Violation, ...]:
    """Find where rules are met.

    Parameters
    ----------
    z : (n,) array_like
        Standardised values in the order of time; NaN for a point that is not judged and ends every run.
    names
        Codes of `RULES`.
    segment : (n,) array_like, optional
        Labels: no pattern reaches over a change of label.

    Returns
    -------
    tuple of Violation
        In the order in which they were raised.

    Raises
    ------
    InputError
        When there is no such rule.
    """
    values = np.asarray(z, np.float64)
    labels = np.zeros(len(values)) if segment is None else np.asarray(segment)
    change = np.ones(len(values), np.bool_)
    change[1:] = (labels[1:] != labels[:-1]) | np.isnan(values[1:]) | np.isnan(values[:-1])
    found = [item for name in names for item in _of_rule(values, known(name), name, change)]
    return tuple(sorted(found, key=lambda item: (item.raised, item.first, item.rule)))


def known(name: str) -> Rule:
    """Look a rule up.

    Raises
    ------
    InputError
        When there is no such rule.
    """
    if name not in RULES:
        raise InputError(Message(_NO_RULE.code, _NO_RULE.template, {"rule": name}))
    return RULES[name]


def episodes(
    met: Mask, start: ArrayLike, rule: str, side: int, change: Mask | None = None
) -> list[Violation]:
    """Violations from the points that complete a pattern: patterns that overlap or touch are one.

    Parameters
    ----------
    met : (n,) bool array
        Where a pattern is complete.
    start : (n,) int array_like
        Where the pattern that is complete there begins.
    rule, side
        As in `Violation`.
    change : (n,) bool array, optional
        Points that do not belong to the stretch of the one before: what touches there is not joined.
    """
    ends = np.flatnonzero(met)
    if not len(ends):
        return []
    begins = np.asarray(start, np.int64)[ends]
    apart = begins[1:] - ends[:-1]
    new = np.append(True, (apart > 1) | ((apart == 1) & (False if change is None else change[begins[1:]])))
    heads = np.flatnonzero(new)
    tails = np.append(heads[1:], len(ends)) - 1
    return [
        Violation(rule, int(begins[head]), int(ends[tail]), int(ends[head]), side)
        for head, tail in zip(heads, tails, strict=True)
    ]


def _of_rule(z: Array, rule: Rule, name: str, change: Mask) -> list[Violation]:
    index = np.arange(len(z))
    stretch = np.maximum.accumulate(np.where(change, index, 0))
    # A trend of m points has m − 1 steps to look at, an alternation m − 2 turns.
    fewer = {"trend": 1, "alternating": 2}.get(rule.pattern, 0)
    low = np.maximum(index - (rule.window - fewer) + 1, stretch)
    found = []
    for side, mark in _marks(z, rule, change):
        total = np.append(0, np.cumsum(mark))
        met = mark & (total[index + 1] - total[low] >= rule.needed - fewer)
        nearest = np.minimum.accumulate(np.where(mark, index, len(z))[::-1])[::-1]
        found += episodes(met, nearest[low] - fewer, name, side, change)
    return found


def _marks(z: Array, rule: Rule, change: Mask) -> list[tuple[int, Mask]]:
    """For each side the points that count for a pattern; of a trend those that a step leads to, of turns likewise."""
    if rule.pattern == "beyond":
        return [(1, z > rule.width), (-1, z < -rule.width)]
    if rule.pattern in ("apart", "within"):
        size = np.abs(z)
        return [(0, size > rule.width if rule.pattern == "apart" else size < rule.width)]
    step = np.where(change, 0.0, np.diff(z, prepend=np.nan))
    if rule.pattern == "trend":
        return [(1, step > 0.0), (-1, step < 0.0)]
    turn = np.append(False, step[1:] * step[:-1] < 0.0)
    return [(0, turn)]


_NO_RULE: Final = Message("no-run-rule", "There is no run rule called %(rule)s.")
