"""The best positions for a session, by several ideas of what is best.

A covariance is judged in rates, so that scale factors and drifts can be compared: a scale factor
counts by the rate that its uncertainty makes at the current of the whole Earth rate, u(K)·Ω/|K|, a
g-sensitive drift by its rate at 1 g. The criteria:

- ``D``: the volume of the region of confidence; its figure is the root mean product of the eight rates;
- ``A``: the root mean square of the eight rates;
- the name of a parameter: its own uncertainty.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from solver.constants import EARTH_RATE
from solver.error_model import design_matrix, scale_matrix
from solver.errors import InputError, Message
from solver.geometry import commanded, elements
from solver.inputs import by_angles, by_common
from solver.least_squares import column_scale
from solver.planning import (
    FEWEST,
    Circumstances,
    Places,
    Prediction,
    duration_at,
    elements_at,
    predict,
    whitened,
)
from solver.position_search import EXHAUSTIVE_UP_TO, Counts, Found, Judge, Tables, best_set
from solver.records import PARAMETERS, Array, Observations

CRITERIA: Final = ("D", "A", *PARAMETERS)
_SAME_ORIENTATION: Final = 9
"""Decimals of a, b, c, d to which twins agree."""
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
        What the criterion makes of it, SI: see the module. It says nothing unless `determines`.
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
    judge = judge_of(criterion, tables.scale, at)
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
        judge = judge_of(criterion, tables.scale, at)
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
    figure = float(np.exp(found.value / 2))
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


def judge_of(criterion: str, scale: Array, at: Circumstances) -> Judge:
    """The criterion as the logarithm of a variance, for covariances in parameters over `scale`."""
    rates = rates_of(at) * scale
    if criterion == "D":
        constant = 2.0 * float(np.log(rates).sum())
        return lambda found: np.asarray((np.linalg.slogdet(found)[1] + constant) / len(PARAMETERS))
    if criterion == "A":
        return lambda found: np.asarray(np.log(np.einsum("bii,i->b", found, rates**2) / len(PARAMETERS)))
    row = PARAMETERS.index(criterion)
    return lambda found: np.asarray(np.log(found[:, row, row] * scale[row] ** 2))


def tables_of(candidates: Places, duration: float, at: Circumstances) -> Tables:
    """What each candidate adds to the information, for `solver.position_search`."""
    jx, jy = at.currents(candidates)
    whitening = at.whitening(duration)
    design = whitened(whitening, design_matrix(elements_at(candidates), jx, jy))
    scale = 1.0 / column_scale(design)
    rows = (design * scale).reshape(-1, 2, len(PARAMETERS))
    transposed = rows.transpose(0, 2, 1)
    own, common = _uncertain(candidates, jx, jy, at, transposed @ whitening)
    information = (transposed @ rows).reshape(len(candidates), -1)
    return Tables(information, own, common, scale, _twins(candidates))


def _uncertain(
    candidates: Places, jx: Array, jy: Array, at: Circumstances, weights: Array
) -> tuple[Array | None, Array | None]:
    """How uncertain angles and common inputs enter, by the weights (n, 8, 2) of each candidate's residuals."""
    observed = _in_this_order(candidates, jx, jy, at)
    own = common = None
    u_angles = np.stack((candidates.u_alpha, candidates.u_beta, candidates.u_gamma), axis=1)
    if u_angles.any():
        effect = weights @ (by_angles(observed, at.parameters) * u_angles[:, None, :])
        own = (effect @ effect.transpose(0, 2, 1)).reshape(len(candidates), -1)
    if at.common.standard.any():
        variances, vectors = np.linalg.eigh(at.common.covariance)
        root = vectors * np.sqrt(np.maximum(variances, 0.0))
        shown = by_common(observed, at.parameters, at.common).reshape(len(candidates), 2, -1)
        common = (weights @ shown @ root).reshape(len(candidates), -1)
    return own, common


def _in_this_order(places: Places, jx: Array, jy: Array, at: Circumstances) -> Observations:
    """Every candidate once, not sorted as `Observations.sorted_from` would."""
    n = len(places)
    none, infinite = np.zeros(n), np.full(n, np.inf)
    return Observations(
        theta=places.theta, psi=places.psi, repeat=np.zeros(n, np.int64), alpha=places.alpha,
        beta=places.beta, gamma=places.gamma, jx=jx, jy=jy, u_jx=None, u_jy=None, duration=none, rate=none,
        time=none, u_alpha=places.u_alpha, u_beta=places.u_beta, u_gamma=places.u_gamma, dof_jx=infinite,
        dof_jy=infinite, latitude=at.latitude,
    )  # fmt: skip


def _twins(places: Places) -> NDArray[np.int64]:
    """One number for positions whose commanded orientation has the same a, b, c, d, as θ + 180°, ψ + 180° has."""
    nominal = elements(commanded(places.theta, places.psi))
    key = np.round(np.stack((nominal.a, nominal.b, nominal.c, nominal.d), axis=1), _SAME_ORIENTATION) + 0.0
    return np.unique(key, axis=0, return_inverse=True)[1].ravel()
