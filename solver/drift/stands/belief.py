"""What is believed of stands and gyros before their sessions are looked at, and odds after it.

A change that may begin at any session is judged by its *evidence*: the likelihood of the sessions with a change at
that date, averaged over the sizes that are believed, over their likelihood without it. Multiplied by the prior
odds of each date and summed over dates it gives the odds of a change, and each date's part its probability.

Moves come at a constant rate h, so the first one falls between the sessions at t₁ and t₂ with probability
exp(−h·t₁) − exp(−h·t₂). These stand against 1 for no move at all, which favours the stand that has not moved, the
more the longer it has been watched. Where nothing moves the evidence of every date is expected to be 1, at any time;
the sum over all dates, weighted so, with 1 for the dates to come, is never negative, begins with at most 1 and
is expected to stay what it is. Such a sum exceeds x ever in its life with a probability of 1/x at most (J. Ville,
Étude critique de la notion de collectif, 1939, ch. V; G. Shafer et al., Statist. Sci. 26 (2011) 84-101). So, however
often one looks, a stand that never moves is ever said to have moved, with a probability ≥ p, with a probability of
(1 − p)/p·(1 − exp(−h·T)) at most: `false_alarm_bound`.
"""

from dataclasses import dataclass
from typing import Final

import numpy as np
from scipy import special

from solver.records import Array
from solver.units import rad_from_arcsec

YEAR: Final = 365.25 * 86400.0
"""s."""


@dataclass(frozen=True, slots=True)
class Belief:
    """Stated before the sessions are looked at.

    Attributes
    ----------
    moves : float
        Of a stand, per s: in azimuth, level about north, or both; and as many in level about east.
    move_size : float
        Standard deviation of a move, rad.
    gyro_changes : float
        Of one gyro, per s.
    gyro_change_size : float
        Standard deviation of a gyro's change, in units of the parameter's scatter from start to start.
    wrong_certificate : float
        Probability that a new certificate, or the one before it, errs by more than it states.
    threshold : float
        Probability from which a change is said to be one.
    """

    moves: float = 0.1 / YEAR
    move_size: float = rad_from_arcsec(120.0)
    gyro_changes: float = 0.3 / YEAR
    gyro_change_size: float = 10.0
    wrong_certificate: float = 0.05
    threshold: float = 0.99

    @property
    def log_odds(self) -> float:
        """Logarithm of the odds that belong to `threshold`."""
        return float(special.logit(self.threshold))

    def false_alarm_bound(self, duration: float) -> float:
        """Largest probability that a stand is ever, in `duration`, s, said to have moved without having."""
        return float((1.0 - self.threshold) / self.threshold * -np.expm1(-self.moves * duration))


@dataclass(frozen=True, slots=True)
class Odds:
    """Of a change at some date against none.

    Attributes
    ----------
    log : float
        Logarithm of the odds; −∞ where there is no date.
    dates : (K,) array
        Probability of each date, if there is a change.
    kinds : (H,) array
        Probability of each kind of change, if there is one.
    """

    log: float
    dates: Array
    kinds: Array

    @property
    def probability(self) -> float:
        """That there is a change."""
        return float(special.expit(self.log))


def log_date_odds(time: Array, rate: float) -> Array:
    """Logarithm of the prior odds that the first change falls before each of `time[1:]`, (n − 1,)."""
    since = rate * (time - time[0])
    with np.errstate(divide="ignore"):
        return np.asarray(np.log(-np.expm1(-np.diff(since))) - since[:-1])


def odds(log_evidence: Array, log_prior: Array) -> Odds:
    """Odds of a change from its evidence (H, K), kinds by dates, and the prior odds, of a shape that fits."""
    joint = log_evidence + log_prior
    total = float(special.logsumexp(joint)) if joint.size else -np.inf
    if not np.isfinite(total):
        return Odds(-np.inf, np.zeros(joint.shape[1]), np.full(len(joint), 1.0 / max(1, len(joint))))
    share = np.exp(joint - total)
    return Odds(total, share.sum(axis=0), share.sum(axis=1))


def tempered(gain: Array, dof: float) -> Array:
    """What half a χ² is worth, (...), when it was formed with a variance of `dof` degrees of freedom.

    The logarithm of a ratio of Student's densities, ν/2·log(1 + χ²/ν): a scatter known from few starts may be
    several times as large, and then large differences are nothing unusual.
    """
    if not np.isfinite(dof):
        return gain
    return np.asarray(dof / 2.0 * np.log1p(2.0 * np.maximum(gain, 0.0) / dof) + np.minimum(gain, 0.0))


def gaussian_evidence(information: Array, score: Array, size: float) -> Array:
    """Logarithm of the evidence of a shift d ~ N(0, size²·1), whose likelihood ratio is exp(d·score − d·I·d/2).

    Parameters
    ----------
    information : (..., q, q) array
        I.
    score : (..., q) array
    """
    inverse_variance = np.eye(information.shape[-1]) / size**2
    posterior = information + inverse_variance
    estimate = np.linalg.solve(posterior, score[..., None])[..., 0]
    _, log_det = np.linalg.slogdet(posterior * size**2)
    return np.asarray(0.5 * np.einsum("...i,...i->...", score, estimate) - 0.5 * log_det)
