"""The trade between two uncertainties: sets of positions that no other set betters in both.

Few sets are all tried. Of many, the front is found from both sides: weighted products of the two
variances are minimised by exchange, which gives points of its convex part, and then every exchange
of every set on the front or close behind it is judged, the nearest first, until no such set is left
or enough have been judged (a Pareto local search: L. Paquete, M. Chiarandini, T. Stützle, 2004).
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from solver.positions.planning import Circumstances, Places, predict
from solver.positions.position_search import (
    EXHAUSTIVE_UP_TO,
    TIE,
    Counts,
    Found,
    Judge,
    Tables,
    best_set,
    every_set,
    exchanges,
    number_of_sets,
)
from solver.positions.position_tables import tables_of
from solver.positions.proposing import buried_of, check
from solver.records import PARAMETERS, Array

ALIKE: Final = 1e-3
"""Relative difference of uncertainties below which two points of a front are one."""
_WEIGHTS: Final = (0.01, 0.12, 0.25, 0.38, 0.5, 0.62, 0.75, 0.88, 0.99)
_BAND: Final = 0.05
"""Sets are explored whose variances are above the front by no more than this, relatively."""
_MOST_KEPT: Final = 300
_EVALUATIONS: Final = 50_000

Measure = Callable[[Array], Array]
"""Covariances (B, 8, 8) of scaled parameters to the logarithms of two variances, (B, 2)."""


@dataclass(frozen=True, slots=True)
class Front:
    """Sets that no other betters in both; empty when none determines both groups.

    Attributes
    ----------
    counts : (m, n) int array
        How often each candidate is measured in each set; from the smallest first uncertainty on.
    u : (m, 2) array
        Root mean square of the standard uncertainties of each of the two groups, SI.
    exhaustive : bool
        Whether every set was tried.
    tried : int
        Sets judged.
    """

    counts: Counts
    u: Array
    exhaustive: bool
    tried: int


def trade_off(
    candidates: Places,
    count: int,
    duration: float,
    at: Circumstances,
    first: tuple[str, ...] = ("kx", "ky"),
    second: tuple[str, ...] = ("wg",),
    *,
    alike: float = ALIKE,
    seed: int = 0,
    exhaustive_up_to: int = EXHAUSTIVE_UP_TO,
) -> Front:
    """The front between the uncertainties of two groups of parameters, for `count` different positions.

    Parameters
    ----------
    candidates, count, at
        As for `solver.positions.proposing.propose`.
    duration : float
        Of the measurement at each position, s.
    first, second
        Names of parameters; of several their root mean square counts.
    alike
        Points nearer than that, relatively, are one.
    seed, exhaustive_up_to
        As for `solver.positions.proposing.propose`.

    Raises
    ------
    InputError
        Too few or too many positions.
    """
    check(candidates, count, "D", repeats=False)
    tables = tables_of(candidates, duration, at)
    measure = _measure(first, second, tables.scale, buried_of(tables.scale, at, count))
    if number_of_sets(len(tables), count, repeats=False) <= exhaustive_up_to:
        found = _exhaustive(tables, count, measure, alike)
    else:
        found = _explored(tables, count, measure, alike, seed)
    asked = [PARAMETERS.index(name) for name in (*first, *second)]
    rows = np.arange(len(candidates))
    seen = [
        not predict(candidates.chosen(np.repeat(rows, counts)), duration, at).undetermined[asked].any()
        for counts in found.counts
    ]
    return Front(found.counts[seen], found.u[seen], found.exhaustive, found.tried)


def uncertainties(
    places: Places, duration: float, at: Circumstances, first: tuple[str, ...], second: tuple[str, ...]
) -> Array:
    """The two figures of a front for one list of positions, (2,), SI."""
    tables = tables_of(places, duration, at)
    covariance = tables.covariances(np.ones((1, len(places)), np.int64))
    return np.asarray(np.exp(_measure(first, second, tables.scale)(covariance)[0] / 2))


def _measure(
    first: tuple[str, ...], second: tuple[str, ...], scale: Array, buried: Judge | None = None
) -> Measure:
    groups = [[PARAMETERS.index(name) for name in group] for group in (first, second)]

    def both(found: Array) -> Array:
        variances = np.einsum("bii->bi", found) * scale**2
        pair = np.log(np.stack([variances[:, group].mean(axis=1) for group in groups], axis=1))
        return np.asarray(pair if buried is None else pair + buried(found)[:, None])

    return both


def not_bettered(values: Array, alike: float = 0.0) -> Array:
    """Rows of `values` (m, 2) that no other is below in both, as indices, by the first value.

    A row that is better than another by no more than `alike` in one of them is not kept beside it.
    """
    order = np.lexsort((np.arange(len(values)), values[:, 1], values[:, 0]))
    falling = []
    lowest = np.inf
    for row in order:
        if values[row, 1] < lowest - alike:
            falling.append(int(row))
            lowest = values[row, 1]
    kept: list[int] = []
    for row in reversed(falling):
        if not kept or values[row, 0] < values[kept[-1], 0] - alike:
            kept.append(row)
    return np.array(kept[::-1], dtype=np.int64)


@dataclass(slots=True)
class _Pool:
    """Sets near the front; `open` marks those whose exchanges have not been judged."""

    counts: Counts
    values: Array
    open: NDArray[np.bool_]

    def take(self, counts: Counts, values: Array, alike: float, band: float) -> None:
        """Add sets, one for each pair of values, and drop what is not near the front any more."""
        everything = np.concatenate((self.values, values))
        best = np.argsort(everything.sum(axis=1), kind="stable")  # of a cell the best is kept
        cells = np.round(everything[best] / max(2 * alike, TIE))
        first = best[np.sort(np.unique(cells, axis=0, return_index=True)[1])]
        behind = _behind(everything[first])
        kept = first[behind <= min(band, np.sort(behind)[min(_MOST_KEPT, len(first)) - 1])]
        self.counts = np.concatenate((self.counts, counts))[kept]
        self.values = everything[kept]
        self.open = np.concatenate((self.open, np.ones(len(values), np.bool_)))[kept]

    def next(self) -> int | None:
        """The open set nearest to the front."""
        rows = np.flatnonzero(self.open)
        return int(rows[np.argmin(_behind(self.values)[rows])]) if len(rows) else None


def _behind(values: Array) -> Array:
    """By how much both values of each row must fall before nothing betters it, (m,)."""
    front = values[not_bettered(values)]
    return np.asarray(np.max(values[:, None] - front, axis=2).min(axis=1), np.float64)


def _empty(tables: Tables) -> _Pool:
    return _Pool(np.zeros((0, len(tables)), np.int64), np.zeros((0, 2)), np.zeros(0, np.bool_))


def _exhaustive(tables: Tables, count: int, measure: Measure, alike: float) -> Front:
    pool, tried = _empty(tables), 0
    for block in every_set(len(tables), count, repeats=False):
        pool.take(block, measure(tables.covariances(block)), 0.0, 0.0)
        tried += len(block)
    return _front(pool, alike, tried, exhaustive=True)


def _explored(tables: Tables, count: int, measure: Measure, alike: float, seed: int) -> Front:
    pool, tried = _empty(tables), 0
    for weight in _WEIGHTS:
        start = _weighted(tables, count, measure, np.array([weight, 1.0 - weight]), seed)
        tried += start.tried
        pool.take(start.counts[None], measure(tables.covariances(start.counts[None])), alike, _BAND)
    capacity = np.ones(len(tables), np.int64)
    spent = 0
    while spent < _EVALUATIONS and (row := pool.next()) is not None:
        pool.open[row] = False
        counts = pool.counts[row]
        leaving, coming = exchanges(counts, capacity)
        values = measure(tables.after_exchange(counts, leaving, coming))
        spent += len(values)
        near = np.flatnonzero(_behind(np.concatenate((pool.values, values)))[-len(values) :] <= _BAND)
        sets = np.repeat(counts[None], len(near), axis=0)
        sets[np.arange(len(near)), leaving[near]] -= 1
        sets[np.arange(len(near)), coming[near]] += 1
        pool.take(sets, values[near], alike, _BAND)
    return _front(pool, alike, tried + spent, exhaustive=False)


def _weighted(tables: Tables, count: int, measure: Measure, weights: Array, seed: int) -> Found:
    """The set with the smallest weighted product of both variances that an exchange finds."""

    def judge(found: Array) -> Array:
        return measure(found) @ weights

    return best_set(tables, count, judge, seed=seed, exhaustive_up_to=0, effort=1 / len(_WEIGHTS))


def _front(pool: _Pool, alike: float, tried: int, *, exhaustive: bool) -> Front:
    rows = not_bettered(pool.values, 2 * alike)
    return Front(pool.counts[rows], np.exp(pool.values[rows] / 2), exhaustive, tried)
