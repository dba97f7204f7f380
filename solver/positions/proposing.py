"""The best positions for a session, by several ideas of what is best.

A covariance is judged in rates, so that scale factors and drifts can be compared: a scale factor
counts by the rate that its uncertainty makes at the current of the whole Earth rate, u(K)·Ω/|K|, a
g-sensitive drift by its rate at 1 g. The criteria:

- ``D``: the volume of the region of confidence; its figure is the root mean product of the eight rates;
- ``A``: the root mean square of the eight rates;
- the name of a parameter: its own uncertainty.

Sets by which the scale factors would hardly stand out from the noise are kept out as far as there
are others: the noise of the currents, which stand in the design matrix, would then hide a loss of
rank and a session would name those parameters as not determined (`solver.estimators.observability`).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from solver.constants import EARTH_RATE
from solver.error_model import scale_matrix
from solver.errors import InputError, Message
from solver.estimators.observability import visible_from
from solver.positions.planning import (
    FEWEST,
    Circumstances,
    Places,
    Prediction,
    duration_at,
    predict,
)
from solver.positions.position_search import EXHAUSTIVE_UP_TO, Counts, Found, Judge, Tables, best_set
from solver.positions.position_tables import tables_of
from solver.records import PARAMETERS, Array

CRITERIA: Final = ("D", "A", *PARAMETERS)
_KEPT_OUT: Final = 10.0
_EFFORT_OF_EACH: Final = 0.15
"""Share of the starts when one count after the other is tried, each from the best of the one before."""


@dataclass(frozen=True, slots=True)
class Proposal:
    """The best positions found.

    Attributes
    ----------
    rows : (N,) int array
        Of the candidates, in their order; one that is repeated stands there several times.
    figure : float
        What the criterion makes of it, SI: see the module. NaN unless `determines`.
    determines : bool
        Whether what the criterion asks for is determined; when not, no other choice does it either.
    prediction
        What these positions will tell.
    exhaustive : bool
        Whether every set was tried, so that none is better.
    starts, tried : int
        Of the exchange otherwise; and how many sets were judged.
    """

    rows: NDArray[np.int64]
    figure: float
    determines: bool
    prediction: Prediction
    exhaustive: bool
    starts: int
    tried: int


def propose(
    candidates: Places,
    count: int,
    total: float,
    moving: float,
    at: Circumstances,
    criterion: str = "D",
    *,
    repeats: bool = False,
    seed: int = 0,
    exhaustive_up_to: int = EXHAUSTIVE_UP_TO,
) -> Proposal:
    """Find the best `count` positions among candidates for a total time.

    Parameters
    ----------
    candidates
    count
        At least four; without `repeats` at most as many as there are candidates.
    total, moving : float
        Time for the whole session, and how much of it each position takes to be reached, s.
    at
    criterion
        One of `CRITERIA`.
    repeats
        Whether a position may be measured several times.
    seed
        Of the exchange's starts.
    exhaustive_up_to
        As many sets are all tried.

    Raises
    ------
    InputError
        Unknown criterion, too few or too many positions, no time to measure.
    """
    check(candidates, count, criterion, repeats=repeats)
    duration = duration_at(total, moving, count)
    tables = tables_of(candidates, duration, at)
    judge = judge_of(criterion, tables.scale, at, count)
    found = best_set(tables, count, judge, repeats=repeats, seed=seed, exhaustive_up_to=exhaustive_up_to)
    return _proposal(candidates, found, duration, at, criterion)


def best_counts(
    candidates: Places,
    counts: Sequence[int],
    total: float,
    moving: float,
    at: Circumstances,
    criterion: str = "D",
    *,
    repeats: bool = False,
) -> tuple[Proposal, ...]:
    """How many positions are worth it: the best ones of each number of them, in the same total time.

    Numbers for which there are no positions or no time are left out. The search for each number
    starts from the best of the number before and is shorter than that of `propose`.
    """
    found: list[Proposal] = []
    for count in sorted(set(counts)):
        possible = count >= FEWEST and (repeats or count <= len(candidates))
        if not possible or total / count <= moving:
            continue
        duration = duration_at(total, moving, count)
        tables = tables_of(candidates, duration, at)
        judge = judge_of(criterion, tables.scale, at, count)
        near = _grown(tables, found[-1].rows, count, judge, repeats=repeats) if found else None
        best = best_set(
            tables, count, judge, repeats=repeats, near=near, effort=_EFFORT_OF_EACH,
            exhaustive_up_to=EXHAUSTIVE_UP_TO // 10,
        )  # fmt: skip
        found.append(_proposal(candidates, best, duration, at, criterion))
    return tuple(found)


def check(candidates: Places, count: int, criterion: str, *, repeats: bool) -> None:
    """Refuse a question that has no answer.

    Raises
    ------
    InputError
    """
    if criterion not in CRITERIA:
        raise InputError(
            Message("unknown-criterion", "There is no criterion “%(name)s”. Choose one of %(names)s.",
                    {"name": criterion, "names": ", ".join(CRITERIA)})
        )  # fmt: skip
    if count < FEWEST:
        raise InputError(
            Message(
                "too-few-positions",
                "Eight parameters need at least four positions: each gives two equations.",
            )
        )
    if not repeats and count > len(candidates):
        raise InputError(
            Message("too-many-positions", "There are %(candidates)d positions to choose from, so %(count)d different "
                    "ones cannot be chosen. Ask for fewer, take a finer grid, or allow repeats.",
                    {"candidates": len(candidates), "count": count})
        )  # fmt: skip


def _proposal(
    candidates: Places, found: Found, duration: float, at: Circumstances, criterion: str
) -> Proposal:
    rows = np.repeat(np.arange(len(candidates)), found.counts)
    prediction = predict(candidates.chosen(rows), duration, at)
    asked = [PARAMETERS.index(criterion)] if criterion in PARAMETERS else list(range(len(PARAMETERS)))
    determines = not prediction.undetermined[asked].any()
    figure = figure_of(criterion, prediction.covariance, at) if determines else float("nan")
    return Proposal(rows, figure, determines, prediction, found.exhaustive, found.starts, found.tried)


def _grown(
    tables: Tables, rows: NDArray[np.int64], count: int, judge: Judge, *, repeats: bool
) -> Counts | None:
    """A set with the candidate added that helps most; None where more than one is to be added."""
    if count != len(rows) + 1:
        return None
    counts = np.bincount(rows, minlength=len(tables))
    free = np.arange(len(tables)) if repeats else np.flatnonzero(counts == 0)
    larger = np.repeat(counts[None], len(free), axis=0)
    larger[np.arange(len(free)), free] += 1
    grown: Counts = larger[int(np.argmin(judge(tables.covariances(larger))))]
    return grown


def rates_of(at: Circumstances) -> Array:
    """By what each parameter's uncertainty, SI, is multiplied to count as a rate, rad/s, (8,)."""
    typical = float(np.sqrt(abs(np.linalg.det(scale_matrix(at.parameters)))))
    return np.array([EARTH_RATE / typical] * 4 + [1.0] * 4)


def figure_of(criterion: str, covariance: Array, at: Circumstances) -> float:
    """The criterion of one covariance, (8, 8), SI."""
    logarithm = _criterion(criterion, np.ones(len(PARAMETERS)), at)(covariance[None])[0]
    return float(np.exp(logarithm / 2))


def judge_of(criterion: str, scale: Array, at: Circumstances, count: int) -> Judge:
    """The criterion for covariances in parameters over `scale`, with what keeps buried sets out."""
    plain, buried = _criterion(criterion, scale, at), buried_of(scale, at, count)
    return lambda found: plain(found) + buried(found)


def _criterion(criterion: str, scale: Array, at: Circumstances) -> Judge:
    """The criterion as the logarithm of a variance."""
    rates = rates_of(at) * scale
    if criterion == "D":
        constant = 2.0 * float(np.log(rates).sum())
        return lambda found: np.asarray((np.linalg.slogdet(found)[1] + constant) / len(PARAMETERS))
    if criterion == "A":
        return lambda found: np.asarray(np.log(np.einsum("bii,i->b", found, rates**2) / len(PARAMETERS)))
    row = PARAMETERS.index(criterion)
    return lambda found: np.asarray(np.log(found[:, row, row] * scale[row] ** 2))


def buried_of(scale: Array, at: Circumstances, count: int) -> Judge:
    """How far, as a logarithm, the scale factors are from standing out of the noise; 0 where they do.

    In units of the noise's own, the smallest singular value of the currents' columns is at least
    1/(√N·u(K)/K) with u(K) the root of the sum over all four factors; `solver.estimators.observability` says
    how large it must be.
    """
    limit = 1.0 / (count * visible_from(2 * count) ** 2)
    relative = (rates_of(at)[:4] / EARTH_RATE * scale[:4]) ** 2

    def buried(found: Array) -> Array:
        variances = np.einsum("bii->bi", found)[:, :4] @ relative
        return np.asarray(_KEPT_OUT * np.log(np.maximum(variances / limit, 1.0)))

    return buried
