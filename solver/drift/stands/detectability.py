"""The smallest turn of a stand that its sessions reveal.

Let the base turn by δ before a given session. The evidence at that date is that of a normal score z = q/√I of mean δ·√I
(`stand_changes`, `common_shift`), and at other dates, whose scores are correlated with it
by r_k, of r_k·z but for noise of their own. So the odds that `belief` forms are a function of z alone ::

    odds(z) = Σ_k π_k/π₀·(1 + σ²·I_k)^(−1/2)·exp(r_k²·z²/(2·(1 + 1/(σ²·I_k))))

and reach the threshold at some z₁. With probability P a turn of this size is found ::

    δ = (z₁ + Φ⁻¹(P))/√I

The scores at two dates are those of a Brownian bridge: with w and w' ≥ w the parts of all information that come after
the later and after the earlier date, r² = w·(1 − w')/(w'·(1 − w)).
"""

from dataclasses import dataclass
from typing import Final

import numpy as np
from scipy import optimize, special

from solver.drift.stands.attribution import StandHistory, places_of, signatures_of
from solver.drift.stands.belief import Belief, log_date_odds, tempered
from solver.drift.stands.common_shift import split
from solver.drift.stands.stand_changes import KIND_WEIGHTS, SPANS, differences
from solver.drift.stands.starts import Starts
from solver.records import Array

_FARTHEST: Final = 1e6
"""Square of the largest score looked at: what a thousand standard deviations do not show is not detectable."""


@dataclass(frozen=True, slots=True)
class Detectable:
    """The smallest turns that are found, rad; infinite where the sessions show none.

    Attributes
    ----------
    azimuth, level_north, level_east : float
        About the vertical, about north, about east.
    session : int
        First session after the turn that this holds for.
    power : float
        Probability of finding it.
    """

    azimuth: float
    level_north: float
    level_east: float
    session: int
    power: float


def detectable(
    history: StandHistory, belief: Belief | None = None, *, session: int | None = None, power: float = 0.95
) -> Detectable:
    """Compute the smallest turns of a stand that its sessions reveal.

    Parameters
    ----------
    history
    belief
        Whose threshold a finding has to reach.
    session
        First session after the turn; the middle one under the latest certificate when not given: the turn
        that is easiest to find.
    power
        Probability with which it is to be found.
    """
    believed, count = belief or Belief(), len(history.time)
    changed = np.flatnonzero(np.diff(history.certificate)) + 1
    edges = [0, *changed.tolist()]
    middle = (edges[-1] + count) // 2 if session is None else session
    first = max(edge for edge in edges if edge <= max(0, middle - 1))
    last = min([edge for edge in edges if edge > first] + [count])
    north, azimuth = _by_residuals(history, first, last, middle, believed, power)
    starts = history.starts
    mine = starts[(starts.session >= first) & (starts.session < last)]
    return Detectable(azimuth, north, _by_parameters(mine, middle, believed, power), middle, power)


def _by_residuals(
    history: StandHistory, first: int, last: int, session: int, belief: Belief, power: float
) -> tuple[float, float]:
    """Of level about north, and of azimuth."""
    if not first < session < last:
        return np.inf, np.inf
    attitudes = history.attitudes
    weighted = attitudes.scattered(attitudes.scatter())
    information, _ = differences(weighted, first, last)
    dates = log_date_odds(history.time[first:last], belief.moves)
    smallest = []
    for kind, span in enumerate(SPANS[:2]):
        along = (span.T @ information @ span)[:, 0, 0]
        sums = np.cumsum((span.T @ weighted.information[first:last] @ span)[:, 0, 0])
        smallest.append(
            _smallest(along, sums, dates + KIND_WEIGHTS[kind], session - first - 1, belief, power)
        )
    return smallest[0], smallest[1]


def _by_parameters(starts: Starts, session: int, belief: Belief, power: float) -> float:
    """Of level about east."""
    after = int(np.searchsorted(starts.session, session))
    if not 0 < after < len(starts.time):
        return np.inf
    places = np.union1d(places_of(len(starts.time)), [after])
    cut = split(starts, places, belief)
    pattern = signatures_of(starts, cut)[:, :, 0]
    along = np.einsum("gp,gkpq,gq->k", pattern, cut.information, pattern)
    each = np.einsum("mp,mpq,mq->m", starts.signature, starts.precision, starts.signature)
    dates = log_date_odds(starts.time[np.r_[0, places]], belief.moves)
    sums = np.cumsum(each)[np.r_[places - 1, len(each) - 1]]
    return _smallest(along, sums, dates, int(np.searchsorted(places, after)), belief, power, starts.dof)


def _smallest(
    information: Array,
    sums: Array,
    dates: Array,
    at: int,
    belief: Belief,
    power: float,
    dof: float | None = None,
) -> float:
    """The turn found with probability `power` at one of the dates.

    Parameters
    ----------
    information : (K,) array
        Of the difference at each date.
    sums : (K + 1,) array
        Information of all sessions before each date, and of all.
    dates : (K,) array
        Logarithm of their prior odds.
    """
    if not information[at] > 0.0:
        return np.inf
    after = 1.0 - sums[:-1] / sums[-1]
    low, high = np.minimum(after, after[at]), np.maximum(after, after[at])
    with np.errstate(divide="ignore", invalid="ignore"):
        overlap = np.nan_to_num(low * (1.0 - high) / (high * (1.0 - low)))
    grown = belief.move_size**2 * information
    steep = overlap * grown / (2.0 * (1.0 + grown))
    level = dates - 0.5 * np.log1p(grown)

    def missing(square: float) -> float:
        gain = steep * square
        return (
            float(special.logsumexp(level + (gain if dof is None else tempered(gain, dof)))) - belief.log_odds
        )

    if missing(_FARTHEST) < 0.0:
        return np.inf
    z = float(np.sqrt(optimize.brentq(missing, 0.0, _FARTHEST))) if missing(0.0) < 0.0 else 0.0
    return (z + float(special.ndtri(power))) / float(np.sqrt(information[at]))
