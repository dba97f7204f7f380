"""Which positions tell most: a search over sets of candidates, blind to what a candidate is.

Whitened by the noise of its currents, a candidate p has two rows Z of the design matrix and the
columns A and C by which the uncertain angles of p alone and the inputs common to all positions
show in them. For a set in which p is measured r times, weighted least squares has the covariance ::

    P·(Σ r·ZᵀZ + Σ r²·(ZᵀA)(ZᵀA)ᵀ + (Σ r·ZᵀC)(Σ r·ZᵀC)ᵀ)·P      with  P = (Σ r·ZᵀZ)⁻¹

(r² because the repeats of a position share its angles). All three sums are looked up in tables of
the candidates, so that thousands of sets are judged at once.

Few sets are all tried. Of many, an exchange is made (V. V. Fedorov, Theory of Optimal Experiments,
1972, ch. 3): from several starts, the best replacement of one position by another, until none is
better. The starts come from a seed: equal questions give equal answers.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import chain, combinations, combinations_with_replacement, islice
from math import comb
from typing import Final

import numpy as np
from numpy.typing import NDArray

from solver.records import PARAMETERS, Array

EXHAUSTIVE_UP_TO: Final = 200_000
"""Sets that are all tried; beyond that an exchange is made."""
TIE: Final = 1e-9
"""Relative difference of variances below which two sets count as equal: the first of them is taken."""
_P: Final = len(PARAMETERS)
_RIDGE: Final = 1e-13
_BLOCK: Final = 2048
_EVALUATIONS: Final = 120_000
_MOST_STARTS: Final = 24
_FEWEST_STARTS: Final = 2
_STEPS: Final = 8  # of an exchange, about

Counts = NDArray[np.int64]
Judge = Callable[[Array], Array]
"""Covariances (B, 8, 8) of the scaled parameters to one figure each, (B,): the smaller the better."""


@dataclass(frozen=True, slots=True)
class Tables:
    """What each of n candidates adds.

    Attributes
    ----------
    information : (n, 64) array
        ZᵀZ, in parameters over `scale`.
    own : (n, 64) array or None
        (ZᵀA)(ZᵀA)ᵀ; None when no angle of a position is uncertain.
    common : (n, 8·k) array or None
        ZᵀC; None when nothing common is uncertain.
    scale : (8,) array
        One scaled unit of each parameter, SI.
    twins : (n,) int array
        Candidates of one number are alike but for the certificate's small angles.
    """

    information: Array
    own: Array | None
    common: Array | None
    scale: Array
    twins: NDArray[np.int64]

    def __len__(self) -> int:
        """Number of candidates."""
        return len(self.information)

    def covariances(self, counts: Counts) -> Array:
        """Covariance of the scaled parameters for sets given as repeats of every candidate, (B, n) → (B, 8, 8).

        A set that does not determine the parameters has huge variances instead of none.
        """
        weight = counts.astype(np.float64)
        return self._covariances(
            weight @ self.information,
            None if self.own is None else weight**2 @ self.own,
            None if self.common is None else weight @ self.common,
        )

    def after_exchange(self, counts: Counts, leaving: NDArray[np.int64], coming: NDArray[np.int64]) -> Array:
        """Covariances of the set `counts` (n,) after each exchange of one candidate for another, (B, 8, 8)."""
        r = counts.astype(np.float64)
        own = common = None
        if self.own is not None:
            more, fewer = 2 * r[coming] + 1, 2 * r[leaving] - 1
            own = r**2 @ self.own + more[:, None] * self.own[coming] - fewer[:, None] * self.own[leaving]
        if self.common is not None:
            common = r @ self.common + self.common[coming] - self.common[leaving]
        information = r @ self.information + self.information[coming] - self.information[leaving]
        return self._covariances(information, own, common)

    def _covariances(self, information: Array, own: Array | None, common: Array | None) -> Array:
        normal = information.reshape(-1, _P, _P)
        trace = np.einsum("bii->b", normal)
        gain = np.linalg.inv(normal + _RIDGE * trace[:, None, None] * np.eye(_P))
        found = gain  # each part is added to it, so that what is not determined stays huge
        if own is not None:
            found = found + gain @ own.reshape(-1, _P, _P) @ gain
        if common is not None:
            columns = gain @ common.reshape(len(normal), _P, -1)
            found = found + columns @ columns.transpose(0, 2, 1)
        return np.asarray(found, np.float64)

    def merged(self) -> "Tables":
        """One candidate for each group of twins: their mean."""
        _, group, size = np.unique(self.twins, return_inverse=True, return_counts=True)
        share = np.zeros((len(size), len(self)))
        share[group, np.arange(len(self))] = 1.0 / size[group]

        def mean(table: Array | None) -> Array | None:
            return None if table is None else share @ table

        return Tables(
            share @ self.information, mean(self.own), mean(self.common), self.scale, np.arange(len(size))
        )


@dataclass(frozen=True, slots=True)
class Found:
    """A set, how good it is, and how it was found. `tried` counts the sets that were judged."""

    counts: Counts
    value: float
    exhaustive: bool
    starts: int
    tried: int


def number_of_sets(candidates: int, count: int, *, repeats: bool) -> int:
    """How many sets of `count` there are."""
    return comb(candidates + count - 1, count) if repeats else comb(candidates, count)


def every_set(candidates: int, count: int, *, repeats: bool) -> Iterator[Counts]:
    """All sets in blocks, each as repeats of every candidate, (B, n); in lexical order."""
    choose = combinations_with_replacement if repeats else combinations
    sets = choose(range(candidates), count)
    while True:
        flat = np.fromiter(chain.from_iterable(islice(sets, _BLOCK)), np.int64)
        if not len(flat):
            return
        chosen = flat.reshape(-1, count)
        counts = np.zeros((len(chosen), candidates), np.int64)
        np.add.at(counts, (np.arange(len(chosen))[:, None], chosen), 1)
        yield counts


def best_set(
    tables: Tables,
    count: int,
    judge: Judge,
    *,
    repeats: bool = False,
    seed: int = 0,
    exhaustive_up_to: int = EXHAUSTIVE_UP_TO,
    near: Counts | None = None,
    effort: float = 1.0,
) -> Found:
    """The set of `count` candidates that `judge` likes best.

    Parameters
    ----------
    tables
    count
        At most as many as there are candidates, unless `repeats`.
    judge
    repeats
        Whether a candidate may be measured several times.
    seed
        Of the starts.
    exhaustive_up_to
        As many sets are all tried; of more an exchange is made.
    near : (n,) int array, optional
        A set of `count` to start from besides the random ones.
    effort
        Share of the usual number of starts.
    """
    if number_of_sets(len(tables), count, repeats=repeats) <= exhaustive_up_to:
        return _exhaustive(tables, count, judge, repeats=repeats)
    capacity = np.full(len(tables), count if repeats else 1)
    rng = np.random.default_rng(seed)
    starts = _number_of_starts(len(tables), count, effort)
    best, tried = None, 0
    rough = _rough(tables, count, judge, capacity, starts, rng)
    for start in [*rough.sets, *([near] if near is not None else [])]:
        counts, value, steps = descend(tables, judge, start, capacity)
        tried += steps
        if best is None or value < best[1] - TIE:
            best = counts, value
    assert best is not None  # there is always a start
    return Found(*best, exhaustive=False, starts=starts, tried=tried + rough.tried)


def _number_of_starts(candidates: int, count: int, effort: float) -> int:
    affordable = int(effort * _EVALUATIONS / (_STEPS * count * candidates))
    return min(_MOST_STARTS, max(_FEWEST_STARTS, affordable))


def _exhaustive(tables: Tables, count: int, judge: Judge, *, repeats: bool) -> Found:
    best, value, tried = None, np.inf, 0
    for block in every_set(len(tables), count, repeats=repeats):
        values = judge(tables.covariances(block))
        tried += len(values)
        first = _first_best(values)
        if best is None or values[first] < value - TIE:
            best, value = block[first], float(values[first])
    assert best is not None  # there is at least one set
    return Found(best, value, exhaustive=True, starts=0, tried=tried)


def _first_best(values: Array) -> int:
    """The first of those that tie with the smallest: rounding shall not choose among equals."""
    return int(np.argmax(values <= values.min() + TIE))


@dataclass(frozen=True, slots=True)
class _Rough:
    sets: list[Counts]
    tried: int


def _rough(
    tables: Tables, count: int, judge: Judge, capacity: Counts, starts: int, rng: np.random.Generator
) -> _Rough:
    """Different sets that no exchange between groups of twins betters, the best three first.

    Turning θ and ψ both by 180° leaves a, b, c, d as they are, so half of a full grid would be
    searched twice; which twin is better is left to the last descent over all candidates.
    """
    merged = tables.merged()
    _, group = np.unique(tables.twins, return_inverse=True)
    room = np.zeros(len(merged), np.int64)
    np.add.at(room, group, capacity)
    found: dict[bytes, tuple[float, Counts]] = {}
    tried = 0
    for _ in range(starts):
        places = rng.permutation(np.repeat(np.arange(len(merged)), np.minimum(room, count)))[:count]
        start = np.bincount(places, minlength=len(merged))
        counts, value, steps = descend(merged, judge, start, room)
        found[counts.tobytes()] = (value, counts)
        tried += steps
    ranked = sorted(found.values(), key=lambda item: (round(item[0], 9), item[1].tobytes()))
    return _Rough([_spread(counts, group, capacity) for _, counts in ranked[:3]], tried)


def _spread(counts: Counts, group: NDArray[np.int64], capacity: Counts) -> Counts:
    """A set of groups as a set of candidates: the first ones of each group, as far as there is room."""
    whole = np.zeros(len(group), np.int64)
    for number, wanted in enumerate(counts):
        left = int(wanted)
        for member in np.flatnonzero(group == number):
            whole[member] = min(left, capacity[member])
            left -= whole[member]
    return whole


def descend(tables: Tables, judge: Judge, start: Counts, capacity: Counts) -> tuple[Counts, float, int]:
    """Exchange one candidate for another as long as that is better: the set, its value, sets judged."""
    counts = start.copy()
    value, tried = float(judge(tables.covariances(counts[None]))[0]), 1
    while True:
        leaving, coming = exchanges(counts, capacity)
        if not len(leaving):
            return counts, value, tried
        values = judge(tables.after_exchange(counts, leaving, coming))
        tried += len(values)
        first = _first_best(values)
        if not values[first] < value - TIE:
            return counts, value, tried
        counts[leaving[first]] -= 1
        counts[coming[first]] += 1
        value = float(values[first])


def exchanges(counts: Counts, capacity: Counts) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Every exchange of one candidate for another: which leaves and which comes, (B,) each."""
    leaving, coming = np.meshgrid(np.flatnonzero(counts), np.flatnonzero(counts < capacity), indexing="ij")
    different = leaving != coming
    return leaving[different], coming[different]
