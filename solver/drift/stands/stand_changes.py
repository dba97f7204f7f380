"""When a stand's base turned, from what every session on it tells of its azimuth and its level about north.

A session gives each of the two as if the other were zero, with standard uncertainties and correlation
(`solver.estimators.stand_attitude`). As information M and score s of the pair x = (level, azimuth)::

    M = [[1/u₂², r/(u₂·u₃)], [r/(u₂·u₃), 1/u₃²]],    s = (x₂/u₂², x₃/u₃²),    E[s] = M·x

whatever gyro it was, also where M is nearly singular and one session cannot tell the two apart. Beyond its own noise
the stand may scatter by τ in both (how a gyro sits on it): W = M·(1 + τ²·M)⁻¹ replaces M and (1 + τ²·M)⁻¹·s replaces s.
τ² makes that sum of squares expected (`solver.drift.scatter`) which the differences of successive sessions have:
steps, which are few, count little in them.

The level before a change is unknown, the certificate being as wrong as it is. With A the sum of the W from the
date on and B the sum before it, the difference d of the two levels has information and score ::

    I = A·(A + B)⁻¹·B,    q = s_A − A·(A + B)⁻¹·(s_A + s_B)

and the likelihood ratio exp(d·q − d·I·d/2). A turn in azimuth alone, in level alone, and in both compete.
`solver.drift.stands.belief` makes odds and dates of it. A change that is found cuts the sessions in two, and both
parts are searched again. A new certificate is a break at a known date: its step is judged against what the two
certificates state and, as everywhere, against the noise.
"""

from dataclasses import dataclass
from itertools import pairwise
from typing import Final

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import special

from solver.drift.scatter import paule_mandel
from solver.drift.stands.belief import Belief, Odds, gaussian_evidence, log_date_odds, odds
from solver.records import Array

Whole = NDArray[np.int64]

KINDS: Final = ("level-north", "azimuth", "both")
"""What a turn may be of, beside one about east."""
KIND_WEIGHTS: Final = np.log([0.4, 0.4, 0.2])
"""Logarithms of their prior probabilities."""
SPANS: Final = (np.array([[1.0], [0.0]]), np.array([[0.0], [1.0]]), np.eye(2))
"""What each of them changes, of level about north and azimuth."""
_SEEN: Final = 1e-6
_MOST: Final = 12


@dataclass(frozen=True, slots=True)
class Attitudes:
    """What n sessions tell of their stand, in the order of time.

    Attributes
    ----------
    time : (n,) array
        s.
    certificate : (n,) int array
        By which each was solved.
    information : (n, 2, 2) array
        M, rad⁻²; zero where a session shows nothing.
    score : (n, 2) array
        s, rad⁻¹.
    """

    time: Array
    certificate: Whole
    information: Array
    score: Array

    @classmethod
    def of(
        cls, time: ArrayLike, certificate: ArrayLike, value: ArrayLike, u: ArrayLike, correlation: ArrayLike
    ) -> "Attitudes":
        """From estimates that are each as if the other were zero.

        Parameters
        ----------
        time, certificate : (n,) array_like
        value, u : (n, 2) array_like
            Level about north and azimuth, rad; NaN where not shown.
        correlation : (n,) array_like
        """
        estimate, spread = np.asarray(value, np.float64), np.asarray(u, np.float64)
        seen = np.isfinite(estimate) & np.isfinite(spread)
        with np.errstate(invalid="ignore", divide="ignore"):
            root = np.where(seen, 1.0 / spread, 0.0)
        linked = np.nan_to_num(np.asarray(correlation, np.float64)) * root[:, 0] * root[:, 1]
        information = root[:, :, None] ** 2 * np.eye(2)
        information[:, 0, 1] = information[:, 1, 0] = linked
        score = np.where(seen, estimate, 0.0) * root**2
        return cls(np.asarray(time, np.float64), np.asarray(certificate, np.int64), information, score)

    @property
    def explained(self) -> Array:
        """What the two turns take from the χ² of each session's residuals, (n,)."""
        inverse = np.linalg.pinv(self.information, rcond=_SEEN, hermitian=True)
        return np.asarray(np.einsum("ni,nij,nj->n", self.score, inverse, self.score))

    def without(self, which: NDArray[np.bool_]) -> "Attitudes":
        """The same where some sessions (n,) tell nothing."""
        information = np.where(which[:, None, None], 0.0, self.information)
        return Attitudes(self.time, self.certificate, information, np.where(which[:, None], 0.0, self.score))

    def scattered(self, variance: float) -> "Attitudes":
        """The same with a scatter of the stand, τ² in rad²."""
        shrink = np.linalg.inv(np.eye(2) + variance * self.information)
        information = self.information @ shrink
        information = (information + information.swapaxes(-1, -2)) / 2
        score = np.einsum("nij,nj->ni", shrink, self.score)
        return Attitudes(self.time, self.certificate, information, score)

    def scatter(self) -> float:
        """τ², rad², from the differences of successive sessions by one certificate."""
        seen = np.flatnonzero(np.einsum("nii->n", self.information) > 0.0)
        same = np.diff(self.certificate[seen]) == 0
        before, after = seen[:-1][same], seen[1:][same]
        one, other = self.information[before], self.information[after]
        inverse = np.linalg.pinv(one + other, rcond=_SEEN**2, hermitian=True)
        information = one @ inverse @ other
        pulled = np.einsum("nij,nj->ni", other @ inverse, self.score[before] + self.score[after])
        length, axes = np.linalg.eigh((information + information.swapaxes(-1, -2)) / 2)
        along = np.einsum("nij,ni->nj", axes, self.score[after] - pulled)
        used = length > _SEEN * length.max(initial=0.0)
        none = np.zeros((int(used.sum()), 0))
        return paule_mandel(along[used] / length[used], 1.0 / np.sqrt(length[used]), none) / 2


@dataclass(frozen=True, slots=True)
class Turn:
    """A change of the stand's attitude.

    Attributes
    ----------
    index : int
        Most probable first session after it.
    probability : float
        That the base turned; for a new certificate, that the step is larger than both certificates state.
    kinds : (3,) array
        Probabilities of `KINDS`, if it did.
    dates : tuple of (int, float)
        Probabilities of 0.001 and more that a session is the first after it.
    size, u : (2,) array
        New less old level about north and azimuth, rad, by the most probable kind: 0 ± 0 for one that
        it leaves alone.
    certificate : bool
        Whether it lies at a new certificate.
    """

    index: int
    probability: float
    kinds: Array
    dates: tuple[tuple[int, float], ...]
    size: Array
    u: Array
    certificate: bool = False


def stand_turns(
    attitudes: Attitudes, belief: Belief, u_certificate: ArrayLike | None = None
) -> tuple[Turn, ...]:
    """Find when the base turned, and judge the steps at new certificates.

    Parameters
    ----------
    attitudes
    belief
    u_certificate : (n, 2) array_like, optional
        Standard uncertainty of level about north and of azimuth by each session's certificate, rad.

    Returns
    -------
    tuple of Turn
        In the order of time: every change of at least the believed threshold, and every new certificate.
    """
    if not len(attitudes.time):
        return ()
    certificates = np.flatnonzero(np.diff(attitudes.certificate)) + 1
    edges = [0, *certificates.tolist()]
    weighted = attitudes.scattered(attitudes.scatter())
    for _ in range(_MOST):
        found = [_search(weighted, *pair, belief) for pair in pairwise([*edges, len(attitudes.time)])]
        index, told = max(found, key=lambda item: item[1].log)
        if index is None or told.log < belief.log_odds:
            break
        edges = sorted([*edges, index])
    u = (
        np.zeros((len(attitudes.time), 2))
        if u_certificate is None
        else np.nan_to_num(np.asarray(u_certificate))
    )
    bounds = [*edges, len(attitudes.time)]
    return tuple(
        _step(weighted, triple, u, belief)
        if triple[1] in certificates
        else _turn(weighted, triple[0], triple[2], belief)
        for triple in zip(bounds, bounds[1:], bounds[2:], strict=False)
    )


def differences(attitudes: Attitudes, first: int, last: int) -> tuple[Array, Array]:
    """I and q of a change at each of the sessions first + 1, …, last − 1: (K, 2, 2) and (K, 2)."""
    information = np.cumsum(attitudes.information[first:last], axis=0)
    score = np.cumsum(attitudes.score[first:last], axis=0)
    inverse = np.linalg.pinv(information[-1], rcond=_SEEN**2, hermitian=True)
    before, after = information[:-1], information[-1] - information[:-1]
    share = after @ inverse
    shift = share @ before
    return (shift + shift.swapaxes(-1, -2)) / 2, score[-1] - score[:-1] - share @ score[-1]


def _evidence(information: Array, score: Array, belief: Belief) -> Array:
    """Logarithm of the evidence of each kind at each date, (3, K)."""
    size = belief.move_size
    return np.stack([gaussian_evidence(p.T @ information @ p, score @ p, size) for p in SPANS])


def _search(attitudes: Attitudes, first: int, last: int, belief: Belief) -> tuple[int | None, Odds]:
    """The most probable date between two edges, and the odds of a change there."""
    if last - first < 2:
        return None, Odds(-np.inf, np.zeros(0), np.zeros(3))
    dates = log_date_odds(attitudes.time[first:last], belief.moves)
    told = odds(_evidence(*differences(attitudes, first, last), belief), KIND_WEIGHTS[:, None] + dates)
    return (first + 1 + int(np.argmax(told.dates)) if np.isfinite(told.log) else None), told


def _turn(attitudes: Attitudes, first: int, last: int, belief: Belief) -> Turn:
    """A change between its neighbours, told in full."""
    index, told = _search(attitudes, first, last, belief)
    assert index is not None
    information, score = differences(attitudes, first, last)
    kind = int(np.argmax(told.kinds))
    each, spread = _sizes(information, score, kind)
    size = told.dates @ each
    u = np.sqrt(told.dates @ (spread**2 + (each - size) ** 2))
    likely = np.flatnonzero(told.dates >= 1e-3)
    dates = tuple((first + 1 + int(k), float(told.dates[k])) for k in likely)
    return Turn(index, told.probability, told.kinds, dates, size, u)


def _step(attitudes: Attitudes, triple: tuple[int, int, int], u_certificate: Array, belief: Belief) -> Turn:
    """Whether the step at a new certificate is larger than the two certificates state."""
    first, index, last = triple
    information, score = (part[index - first - 1] for part in differences(attitudes, first, last))
    stated = np.diag(u_certificate[index - 1] ** 2 + u_certificate[index] ** 2)
    shrink = np.linalg.inv(np.eye(2) + information @ stated)
    evidence = _evidence(shrink @ information, (shrink @ score)[None], belief)
    told = odds(evidence, KIND_WEIGHTS[:, None] + special.logit(belief.wrong_certificate))
    kind = int(np.argmax(told.kinds))
    size, u = (part[0] for part in _sizes(information[None], score[None], kind))
    return Turn(index, told.probability, told.kinds, ((index, 1.0),), size, u, certificate=True)


def _sizes(information: Array, score: Array, kind: int) -> tuple[Array, Array]:
    """Least squares of a change of one kind at each date, (K, 2), and its standard uncertainties."""
    span = SPANS[kind]
    covariance = np.linalg.pinv(span.T @ information @ span, hermitian=True)
    size = np.einsum("kij,kj->ki", covariance, score @ span) @ span.T
    u = np.sqrt(np.einsum("kii->ki", span @ covariance @ span.T))
    return size, u
