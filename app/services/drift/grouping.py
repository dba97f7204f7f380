"""Fewer points than sessions: means of a start, a day, a month or a year; the extremes of a long history.

Within a group values are weighted by ``w_i = 1/u_i²``, u_i being the noise of each session's own currents, where it
is known of all, and equally where it is not. The mean's u has two parts: of the noise, the larger of what the u_i
predict, ``1/√Σw``, and of what the values show, ``√(Σw·(x − x̄)² / ((n − 1)·Σw))`` (R. T. Birge, Phys. Rev. 40 (1932)
207, eqs. for internal and external consistency); and of what the sessions have in common, which a mean does not lessen.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from math import inf, sqrt
from typing import Final

import numpy as np
from numpy.typing import NDArray

from app.services.drift.series import Column, SeriesTable
from solver.records import Array

GROUPS: Final = ("session", "start", "day", "month", "year")
_UNITS: Final = {"day": "D", "month": "M", "year": "Y"}


@dataclass(frozen=True, slots=True)
class Group:
    """Sessions taken together: the rows of the first and the last, how many, mean, u, k, standard deviation."""

    first: int
    last: int
    sessions: int
    value: float
    u: float | None
    k: float
    scatter: float | None


def grouped(table: SeriesTable, by: str, parameter: str) -> Iterator[Group]:
    """Weighted means of a parameter by start, day, month or year (UTC), in the order of time."""
    places = table.determined(parameter)
    rows = table.rows(places)
    for members in _members(_keys(rows, by)):
        yield _mean(rows, parameter, members, int(places[members[0]]), int(places[members[-1]]))


def _keys(table: SeriesTable, by: str) -> Column:
    if by in ("session", "start"):
        return table[by]
    return table["measured_at"].astype(f"datetime64[{_UNITS[by]}]")


def _members(keys: Column) -> list[NDArray[np.int64]]:
    """Rows of each key, keys in the order of their first row."""
    if not len(keys):
        return []
    _, first, which = np.unique(keys, return_index=True, return_inverse=True)
    order = np.argsort(which, kind="stable")
    parts = np.split(order, np.cumsum(np.bincount(which))[:-1])
    return [parts[key] for key in np.argsort(first, kind="stable")]


def _mean(table: SeriesTable, parameter: str, members: NDArray[np.int64], first: int, last: int) -> Group:
    value, u, k, noise = (
        np.asarray(table[f"{parameter}.{part}"][members], np.float64)
        for part in ("value", "u", "k", "u_noise")
    )
    known = bool((np.isfinite(noise) & (noise > 0.0)).all())
    weight = 1.0 / np.square(noise) if known else np.ones(len(value))
    mean = float(np.sum(weight * value) / np.sum(weight))
    count = len(value)
    external = _external(value, weight, mean)
    internal = 1.0 / sqrt(float(np.sum(weight))) if known else 0.0
    common = np.square(u) - (np.square(noise) if known else 0.0)
    return Group(
        first, last, count, mean,
        None if np.isnan(u).any() else sqrt(max(internal, external) ** 2 + max(float(np.mean(common)), 0.0)),
        float(np.mean(k)), float(np.std(value, ddof=1)) if count > 1 else None,
    )  # fmt: skip


def _external(value: Array, weight: Array, mean: float) -> float:
    """Standard uncertainty of the mean as the values' own scatter shows it."""
    if len(value) < 2:
        return 0.0
    squares = float(np.sum(weight * np.square(value - mean)))
    return sqrt(squares / ((len(value) - 1) * float(np.sum(weight))))


def reduced(table: SeriesTable, parameter: str, most: int, statistic: str = "value") -> NDArray[np.int64]:
    """Rows that show a column of a parameter in few points, and where rules were broken.

    At most `most` of all by their `extremes`, four at the least; and of those that broke a rule as many again.
    """
    places = np.flatnonzero(np.isfinite(table[f"{parameter}.{statistic}"]))
    broken = places[np.isin(places, table.broken(parameter))]
    parts = [_spread(table, some, f"{parameter}.{statistic}", most) for some in (places, broken)]
    return np.union1d(*parts)


def _spread(table: SeriesTable, places: NDArray[np.int64], name: str, most: int) -> NDArray[np.int64]:
    times = table["measured_at"][places].astype(np.int64)
    kept: NDArray[np.int64] = places[extremes(times, table[name][places], most)]
    return kept


def extremes(times: Column, values: Array, most: int) -> NDArray[np.int64]:
    """Places that show values in at most `most` points: of equal spans of time the lowest and the highest.

    The first and the last one stay; every extreme of the whole is among them.

    Parameters
    ----------
    times : (n,) int array
        Rising.
    values : (n,) array
        Finite.
    """
    if len(times) <= most:
        return np.arange(len(times))
    bins = max(1, (most - 2) // 2)
    span = float(times[-1] - times[0]) or inf
    which = np.minimum(((times - times[0]) / span * bins).astype(np.int64), bins - 1)
    kept = {0, len(times) - 1}
    for extreme in (values, -values):
        order = np.lexsort((extreme, which))
        kept |= set(order[np.flatnonzero(np.diff(which[order], prepend=-1))].tolist())
    return np.array(sorted(kept), np.int64)
