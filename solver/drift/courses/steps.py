"""Which changes of level and of slope, and which wild values, a history shows, and when.

Forward, one at a time, whichever takes most from the sum of squares (`solver.drift.courses.sweep`), as long as the
probability that chance alone takes so much at any date is within the level. After each one its neighbours, and in
the end all, are dated anew with the others held, each by the date of largest likelihood, with the scatter that
the whole course leaves; those no longer significant are dropped. A trend stays in the model throughout, so that a
drift is not cut into steps. Wild values compete with steps, so that one does not make a step.
"""

import functools
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np

from solver.drift.courses.regression import Series, Structure, fit
from solver.drift.courses.sweep import Kind, Remainder, Sweep
from solver.records import Array

CHANGES: Final[tuple[Kind, ...]] = ("steps", "bends")
_MOST: Final = 30
"""Changes and wild values looked for."""
_PASSES: Final = 3
BEFORE: Final[Mapping[Kind, float]] = {"steps": 0.0, "bends": -float(np.log(10.0)), "outliers": 0.0}
"""Logarithms of odds. Near an end a step and a bend look alike: a blow is the commoner cause, by ten to one."""
_SPARE: Final = 3
"""Degrees of freedom that must be left after a change."""


@dataclass(frozen=True, slots=True)
class Candidate:
    """The best date of a change, or the wildest value.

    Attributes
    ----------
    kind, index
        Which, and the first value after it or the wild value.
    gain : float
        What it takes from the weighted sum of squares.
    p_value : float
        Probability that chance alone takes so much at any date.
    dates : tuple of (int, float)
        The candidates' probabilities, those of 0.001 and more, in the order of time.
    """

    kind: Kind
    index: int
    gain: float
    p_value: float
    dates: tuple[tuple[int, float], ...]


class Ground:
    """A trend in which changes are looked for. What it has computed it keeps.

    Parameters
    ----------
    series
        Of n values.
    columns
        The columns (n, p) of a course with the trend and some changes.
    kinds
        The changes that there may be.
    """

    def __init__(
        self, series: Series, columns: Callable[[Structure], Array], kinds: tuple[Kind, ...] = CHANGES
    ) -> None:
        self.series = series
        self.kinds = kinds
        self.columns = functools.cache(columns)
        self.tau2 = functools.cache(self._tau2)
        self.judged = functools.cache(self._judged)

    def search(self, structure: Structure, level: float) -> Structure:
        """Changes and wild values beside what is there already.

        Parameters
        ----------
        structure
            With the given breaks, and changes to begin with.
        level : float
            Largest probability of finding a change where there is none; the same for a wild value.
        """
        for _ in range(_MOST):
            found = self._next(structure, level)
            if found is None:
                break
            structure = structure.beside(found.kind, found.index)
            structure = self._again(structure, level, _beside(structure, found.index))
        for _ in range(_PASSES):
            before = structure
            structure = self._again(structure, level, _all(structure))
            if structure == before:
                break
        return structure

    def _judged(self, structure: Structure, kind: Kind, index: int) -> Candidate:
        """One change or wild value of a structure dated anew and tested, the others held."""
        rest = structure.without(kind, index)
        group = self.kinds if kind in self.kinds else (kind,)
        null = Remainder.of(self.series, self.columns(rest), rest)
        whole = Remainder.of(self.series, self.columns(rest), rest, self.tau2(structure))
        # The test's size is right with the weights of no change, the date's likelihood with those of the whole course.
        tested, dated = (_best([one.sweep(each) for each in group]) for one in (null, whole))
        if tested is None or dated is None:  # cannot be: where it is now is a possible date
            return Candidate(kind, index, 0.0, 1.0, ())
        return Candidate(dated.kind, dated.index, tested.gain, tested.p_value, dated.dates)

    def _tau2(self, structure: Structure) -> float:
        short, kept = self.series.without(structure.outliers)
        return fit(short, self.columns(structure)[kept]).tau2

    def _next(self, structure: Structure, level: float) -> Candidate | None:
        """The change or wild value that takes most away, if it is significant."""
        left = Remainder.of(self.series, self.columns(structure), structure)
        if left.dof < _SPARE:
            return None
        change = _best([left.sweep(kind) for kind in self.kinds])
        wild = _best([left.sweep("outliers")])
        significant = [one for one in (change, wild) if one is not None and one.p_value <= level]
        return max(significant, key=lambda one: one.gain, default=None)

    def _again(self, structure: Structure, level: float, which: list[tuple[Kind, int]]) -> Structure:
        """Date some anew and drop those not significant."""
        for kind, index in which:
            one = self.judged(structure, kind, index)
            rest = structure.without(kind, index)
            structure = rest.beside(one.kind, one.index) if one.p_value <= level else rest
        return structure


def _best(sweeps: list[Sweep]) -> Candidate | None:
    """The largest gain of several kinds and its probability over all of them."""
    possible = [one for one in sweeps if len(one.index)]
    if not possible:
        return None
    top = max(possible, key=_credit)
    gain = float(top.gain[top.best])
    p_value = min(1.0, sum(one.p_value(gain) for one in possible))
    chances = top.dates()
    likely = np.flatnonzero(chances >= 0.001)
    dates = tuple((int(top.index[one]), float(chances[one])) for one in likely)
    return Candidate(top.kind, int(top.index[top.best]), gain, p_value, dates)


def _credit(sweep: Sweep) -> float:
    """Logarithm of likelihood and of what is thought of the kind before, but a constant."""
    return sweep.likelihood + BEFORE[sweep.kind]


def _all(structure: Structure) -> list[tuple[Kind, int]]:
    groups: tuple[Kind, ...] = ("steps", "bends", "outliers")
    return [(kind, index) for kind in groups for index in getattr(structure, kind)]


def _beside(structure: Structure, index: int) -> list[tuple[Kind, int]]:
    """The changes next to a new one on either side, and itself."""
    ordered = sorted(_all(structure), key=lambda one: one[1])
    place = [one[1] for one in ordered].index(index)
    return ordered[max(place - 1, 0) : place + 2]
