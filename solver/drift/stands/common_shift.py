"""Whether the gyros of a stand changed together: one shift in all of them, or each for itself.

The gyros' starts are those of `starts`. Cut at a date, those of gyro g before and after it differ by
d_g, with information I_g and score q_g as in `stand_changes`; each gyro's mean is its own. What can
be at a date, and the likelihood ratio to nothing, each with g's own data:

- the stand: d_g = L_g·ε with one ε for all gyros. L_g is what a turn about east does to the parameters of g
  (`solver.estimators.stand_attitude`), or 1 where a certificate may be wrong in any way;
- the gyro: any change of one of its parameters or of all, of some tens of scatters, with evidence C_g.

A gyro may do both, so that with a prior probability η of the latter the evidence of the stand is ::

    ∫ N(ε; 0, σ²)·Π_g [(1 − η)·exp(ε·L_gᵀq_g − ε²·L_gᵀI_gL_g/2) + η·M_g] dε / Π_g [(1 − η) + η·M_g]

by Laplace's method, with M_g the mean of C_g over all dates: without the stand each gyro changes when it likes. A
gyro that changes as the pattern does not foresee is explained by M_g, and lends the stand nothing: a gyro that
jumps does not make a stand move.
"""

from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy import special

from solver.drift.stands.belief import Belief, tempered
from solver.drift.stands.starts import Starts
from solver.records import Array

Whole = NDArray[np.int64]

OWN_CHANGE: Final = 0.05
"""η."""
_ROUNDS: Final = 25


@dataclass(frozen=True, slots=True)
class Splits:
    """Every gyro's starts cut at each of K dates.

    Attributes
    ----------
    information : (G, K, 8, 8) array
        I_g of the difference between after and before; zero where the gyro has no start on either side.
    score : (G, K, 8) array
        q_g.
    own : (G, K) array
        Logarithm of C_g, as if V were exact: it competes with likelihood ratios that are formed so.
    worth : (G, K) array
        The same for a V known with so many degrees of freedom.
    gyros : (G,) int array
        Labels.
    dof : float
        Of the scatter.
    """

    information: Array
    score: Array
    own: Array
    worth: Array
    gyros: Whole
    dof: float


def split(starts: Starts, dates: Whole, belief: Belief) -> Splits:
    """Cut at dates, each the number of the first start after it; the gyros' means are their own on either side."""
    gyros = np.unique(starts.gyro)
    information, score = np.zeros((len(gyros), len(dates), 8, 8)), np.zeros((len(gyros), len(dates), 8))
    for row, gyro in enumerate(gyros):
        mine = np.flatnonzero(starts.gyro == gyro)
        weight = starts.precision[mine]
        pulled = np.einsum("mij,mj->mi", weight, starts.value[mine])
        after = np.searchsorted(mine, dates)
        sums = np.concatenate((np.zeros((1, 8, 8)), np.cumsum(weight, axis=0)))
        pulls = np.concatenate((np.zeros((1, 8)), np.cumsum(pulled, axis=0)))
        inverse = np.linalg.inv(sums[-1])
        share = (sums[-1] - sums) @ inverse
        difference = share @ sums
        information[row] = ((difference + difference.swapaxes(-1, -2)) / 2)[after]
        score[row] = (pulls[-1] - pulls - np.einsum("mij,j->mi", share, pulls[-1]))[after]
    size = belief.gyro_change_size
    own, worth = (own_change(information, score, size, dof) for dof in (np.inf, starts.dof))
    return Splits(information, score, own, worth, gyros, starts.dof)


def own_change(information: Array, score: Array, size: float, dof: float) -> Array:
    """Logarithm of the evidence that a gyro itself changed: in one parameter, any of them, or in all."""
    alone = np.einsum("...ii->...i", information)
    grown = 1.0 + size**2 * alone
    single = tempered(0.5 * score**2 * size**2 / grown, dof) - 0.5 * np.log(grown)
    posterior = information + np.eye(8) / size**2
    _, log_det = np.linalg.slogdet(posterior * size**2)
    explained = np.einsum("...i,...i->...", score, np.linalg.solve(posterior, score[..., None])[..., 0])
    whole = tempered(0.5 * explained, dof) - 0.5 * log_det
    return np.asarray(
        special.logsumexp(np.concatenate((single, whole[..., None]), axis=-1), axis=-1) - np.log(9)
    )


@dataclass(frozen=True, slots=True)
class Shared:
    """A shift that all gyros share, at each of K dates.

    Attributes
    ----------
    log_evidence : (K,) array
        Against none.
    without : (K,) array
        What is left of it without the gyro that lends most.
    leading : (K,) int array
        Label of that gyro.
    value : (K, q) array
        The shift.
    covariance : (K, q, q) array
    """

    log_evidence: Array
    without: Array
    leading: Whole
    value: Array
    covariance: Array


def shared(splits: Splits, signatures: Array, prior: Array) -> Shared:
    """Judge a shift ε ~ N(0, prior) of all gyros, L_g·ε.

    Parameters
    ----------
    splits
    signatures : (G, 8, q) array
        L_g.
    prior : (q, q) array
    """
    left = signatures.swapaxes(-1, -2)[:, None]
    information = left @ splits.information @ signatures[:, None]
    score = np.einsum(
        "gkqp,gkp->gkq", np.broadcast_to(left, (*splits.own.shape, *left.shape[2:])), splits.score
    )
    own = (
        np.log(OWN_CHANGE)
        + special.logsumexp(splits.own, axis=1, keepdims=True)
        - np.log(splits.own.shape[1])
    )
    weight = _first_weights(information, score)
    inverse = np.linalg.inv(prior)
    value = np.zeros(score.shape[1:])
    for _ in range(_ROUNDS):
        pull = np.einsum("gk,gkq->kq", weight, score)
        normal = np.einsum("gk,gkqr->kqr", weight, information) + inverse
        value = np.linalg.solve(normal, pull[..., None])[..., 0]
        weight = special.expit(np.log1p(-OWN_CHANGE) + _ratio(information, score, value) - own)
    likely = np.logaddexp(np.log1p(-OWN_CHANGE) + _ratio(information, score, value), own)
    each = likely - np.logaddexp(np.log1p(-OWN_CHANGE), own)
    normal = np.einsum("gk,gkqr->kqr", weight, information) + inverse
    _, log_det = np.linalg.slogdet(normal @ prior)
    explained = each.sum(axis=0) - 0.5 * np.einsum("kq,qr,kr->k", value, inverse, value)
    return Shared(
        log_evidence=tempered(explained, splits.dof) - 0.5 * log_det,
        without=tempered(explained - each.max(axis=0), splits.dof) - 0.5 * log_det,
        leading=splits.gyros[np.argmax(each, axis=0)],
        value=value,
        covariance=np.linalg.inv(normal),
    )


def _ratio(information: Array, score: Array, value: Array) -> Array:
    """Logarithm of each gyro's likelihood ratio of a shift (K, q), (G, K)."""
    return np.asarray(
        np.einsum("gkq,kq->gk", score, value) - 0.5 * np.einsum("kq,gkqr,kr->gk", value, information, value)
    )


def _first_weights(information: Array, score: Array) -> Array:
    """Weights to begin with: a gyro far from the median of all of them counts for nothing."""
    size = np.einsum("gkqq->gkq", information)
    with np.errstate(divide="ignore", invalid="ignore"):
        each = np.where(size > 0.0, score / size, np.nan)
        distance = (each - _median(each)) ** 2 * size
    return np.asarray(np.where(np.nansum(distance, axis=-1) < 9.0 * size.shape[-1], 1.0, 0.0))


def _median(each: Array) -> Array:
    """Median over gyros, (K, q); 0 where there is none."""
    known = np.isfinite(each)
    ordered = np.sort(np.where(known, each, np.inf), axis=0)
    count = known.sum(axis=0)
    low, high = (np.maximum(count - 1, 0) // 2)[None], (count // 2)[None]
    both = [np.take_along_axis(ordered, np.minimum(place, len(each) - 1), axis=0)[0] for place in (low, high)]
    middle = (both[0] + both[1]) / 2
    return np.where(np.isfinite(middle), middle, 0.0)


def unturned(starts: Starts, first: int, turn: float) -> Starts:
    """The starts from number `first` on as they would be had the base not turned by `turn` about east, rad."""
    moved = np.where(np.arange(len(starts.gyro))[:, None] >= first, starts.signature * turn, 0.0)
    return replace(starts, value=starts.value - moved)
