"""The values of one start as one: they share what the start brought, and would count it again and again.

Of the values ``x_ij`` of a quantity, the j-th of start i,

    x_ij = course + s_i + b_ij + e_ij,    e_ij ~ N(0, u_ij²) known,  b_ij ~ N(0, τ_w²),  s_i ~ N(0, τ_s²)

those of one start have s_i in common. Tests and limits that take values for independent are right for their means

    x̄_i = Σ_j w_ij·x_ij / Σ_j w_ij,   w_ij = 1/(u_ij² + τ_w²),   u²(x̄_i) = 1/Σ_j w_ij

with τ_s² as their scatter. The deviations from the plain means of the m starts give τ_w²: of all n values

    E Σ_ij (x_ij − mean_i)² = (n − m)·τ_w² + Σ_i (1 − 1/n_i)·Σ_j u_ij²

(analysis of variance, one-way and unbalanced; see `solver.drift.repeatability`).
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from solver.drift.history import History
from solver.records import Array

Whole = NDArray[np.int64]


@dataclass(frozen=True, slots=True)
class StartMeans:
    """A history with one value for each start.

    Attributes
    ----------
    history : History
        m values; their u hold the scatter within a start.
    member : (n,) int array
        The start, an index of `history`, of each value that was averaged.
    first : (m,) int array
        The first value of each start.
    within : float
        τ_w, in the quantity's unit; 0 where no start has two values.
    """

    history: History
    member: Whole
    first: Whole
    within: float


def occasions(start: Whole) -> Whole:
    """What scatters by itself: labels from 0 on, of the starts; of the values where there is one start alone.

    A single start does not tell how starts scatter: its values stand for themselves.
    """
    labels = np.unique(start, return_inverse=True)[1]
    return labels if labels.max(initial=0) > 0 else np.arange(len(start))


def start_means(history: History, within: float | None = None) -> StartMeans:
    """Average the values of each start.

    Parameters
    ----------
    history
        Any number of values.
    within : float, optional
        τ_w where it is known already; estimated if not given.
    """
    label = occasions(history.start)
    count = np.bincount(label)
    scatter = _within(history, label, count) if within is None else within
    if len(count) == len(history) and not scatter:
        return StartMeans(history, np.arange(len(history)), np.arange(len(history)), 0.0)
    variance = history.u**2 + scatter**2
    weight = 1.0 / variance if variance.min(initial=np.inf) > 0.0 else np.ones(len(history))
    total = np.bincount(label, weight).astype(np.float64)
    first = np.full(len(count), len(history))
    np.minimum.at(first, label, np.arange(len(history)))
    means = History(
        time=_mean(history.time - history.time[0], weight, label, total) + history.time[0],
        value=_mean(history.value - history.value[0], weight, label, total) + history.value[0],
        u=np.sqrt(np.bincount(label, weight**2 * variance)) / total,
        start=history.start[first],
    )
    order = np.argsort(means.time, kind="stable")
    return StartMeans(means[order], np.argsort(order)[label], first[order], scatter)


def _within(history: History, label: Whole, count: Whole) -> float:
    free = len(history) - len(count)
    if free < 1:
        return 0.0
    apart = history.value - (np.bincount(label, history.value) / count)[label]
    known = float((1.0 - 1.0 / count) @ np.bincount(label, history.u**2))
    return float(np.sqrt(max(0.0, (float(apart @ apart) - known) / free)))


def _mean(values: Array, weight: Array, label: Whole, total: Array) -> Array:
    return np.asarray(np.bincount(label, weight * values) / total)
