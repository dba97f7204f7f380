"""Gyro or stand: what changed, judged from all sessions on one stand.

- Azimuth and level about north: no gyro can make what a session's residuals show of them
  (`solver.drift.stands.stand_changes`). A change of theirs is the stand's, or noise.
- Level about east: it shows in the gyros' parameters alone, in a pattern that is known for each gyro. It is
  the stand's when the gyros change by it together (`common_shift`), and when this does not hang on one
  gyro: if it does, nobody can tell yet, and the finding says so.
- A new certificate: at its date, any shift common to all gyros beyond what the certificates state.
- A gyro: what changes in it alone.

Probabilities are those of `solver.drift.stands.belief`, and false alarms are bounded by it.
"""

from dataclasses import dataclass, field
from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray
from scipy import special

from solver.constants import EARTH_RATE
from solver.drift.stands.belief import Belief, Odds, log_date_odds, odds
from solver.drift.stands.common_shift import Shared, Splits, shared, split, unturned
from solver.drift.stands.stand_changes import KINDS, Attitudes, Turn, stand_turns
from solver.drift.stands.starts import Starts, starts_of
from solver.records import Array

Whole = NDArray[np.int64]
Verdict = Literal["stand", "certificate", "gyro", "unclear", "none"]
Direction = Literal["azimuth", "level-north", "both", "level-east", "certificate", "own"]

_LIKELY: Final = 1e-3
_MOST: Final = 8
_MOST_DATES: Final = 400
_BLUNDER: Final = 1e-4
"""Probability of residuals as large as those of a session that is left out."""
_OTHERS: Final = float(np.log(3.0))
"""Logarithm of the evidence that must be left without the gyro on which most of it hangs."""


@dataclass(frozen=True, slots=True)
class StandHistory:
    """All sessions on one stand, in the order of time.

    Attributes
    ----------
    time : (n,) array
        s.
    gyro, kind, certificate, start : (n,) int array
        Labels: of the gyro; of its type; of the certificate; of the start, unique for its gyro.
    value, u : (n, 8) array
        Parameters and their standard uncertainties from noise, SI; NaN where not determined.
    level_east : (n, 8) array
        `solver.estimators.stand_attitude.StandAttitude.level_east`.
    turn, u_turn, u_certificate : (n, 2) array
        Level about north and azimuth, their standard uncertainties from noise, and those from the certificate, rad;
        NaN where not shown.
    correlation : (n,) array
        Of the two.
    chi2, dof : (n,) array or None
        χ² of each session's residuals and its degrees of freedom; NaN where u(J) is not given. A session whose
        residuals are too large by more than a turn explains, and by more than those of the other sessions,
        has a blunder in it and tells nothing of the stand.
    """

    time: Array
    gyro: Whole
    kind: Whole
    certificate: Whole
    start: Whole
    value: Array
    u: Array
    level_east: Array
    turn: Array
    u_turn: Array
    correlation: Array
    u_certificate: Array
    chi2: Array | None = None
    dof: Array | None = None

    @property
    def attitudes(self) -> Attitudes:
        """What the residuals show."""
        every = Attitudes.of(self.time, self.certificate, self.turn, self.u_turn, self.correlation)
        if self.chi2 is None or self.dof is None:
            return every
        freedom = np.maximum(self.dof - 2.0, 1.0)
        rest = np.maximum(self.chi2 - every.explained, 0.0)
        known = np.isfinite(rest)
        usual = max(1.0, float(np.median((rest / freedom)[known]))) if known.any() else 1.0
        blundered = special.chdtrc(freedom, rest / usual) < _BLUNDER
        return every.without(blundered)

    @property
    def starts(self) -> Starts:
        """What the parameters show."""
        return starts_of(
            self.time, self.gyro, self.kind, self.certificate, self.start, self.value, self.u, self.level_east
        )


@dataclass(frozen=True, slots=True)
class Finding:
    """Something that changed, or a new certificate judged.

    Attributes
    ----------
    verdict
        Whose change it is. ``none`` for a new certificate at which nothing shows.
    direction
        Of a stand's turn; ``own`` for a gyro's change.
    session : int
        Most probable first session after it.
    dates : tuple of (int, float)
        Sessions with their probability, from 0.001 on, of being the first after it.
    size, u : float
        Turn of the base, rad: about the axis of `direction`; NaN for a gyro's change.
    shift, u_shift : (8,) array
        Change of the parameters, SI, that it makes in `gyro`, or that all gyros share; NaN where it makes none.
    probability : dict
        Of ``stand``, ``gyro``, ``certificate``, ``nothing``: those that compete.
    directions : dict
        Of a turn that shows in the residuals: probabilities of its directions, if there is one.
    gyro : int or None
        Label of the gyro that changed, or on which an unclear finding hangs.
    """

    verdict: Verdict
    direction: Direction
    session: int
    dates: tuple[tuple[int, float], ...]
    size: float
    u: float
    shift: Array = field(default_factory=lambda: np.full(8, np.nan))
    u_shift: Array = field(default_factory=lambda: np.full(8, np.nan))
    probability: dict[str, float] = field(default_factory=dict)
    directions: dict[str, float] = field(default_factory=dict)
    gyro: int | None = None


def attribute(history: StandHistory, belief: Belief | None = None) -> tuple[Finding, ...]:
    """Find what changed on a stand, and whether it was the stand or a gyro.

    Returns
    -------
    tuple of Finding
        In the order of sessions.
    """
    believed = belief or Belief()
    found: list[Finding] = []
    for turn in stand_turns(history.attitudes, believed, history.u_certificate):
        found.extend(_turned(turn, believed))
    found.extend(_from_parameters(history.starts, believed))
    return tuple(sorted(found, key=lambda finding: finding.session))


def _turned(turn: Turn, belief: Belief) -> list[Finding]:
    """A turn in azimuth, level about north, or one finding for each."""
    owner: Verdict = "certificate" if turn.certificate else "stand"
    said = owner if turn.probability >= belief.threshold else "none"
    kind = int(np.argmax(turn.kinds))
    odd = {owner: turn.probability, "nothing": 1.0 - turn.probability}
    directions = dict(zip(KINDS, turn.kinds.tolist(), strict=True))
    axes: tuple[tuple[int, Direction], ...] = ((0, "level-north"), (1, "azimuth"))
    return [
        Finding(
            said, name, turn.index, turn.dates, float(turn.size[axis]), float(turn.u[axis]),
            probability=odd, directions=directions,
        )
        for axis, name in axes
        if kind in (axis, 2)
    ]  # fmt: skip


def _from_parameters(starts: Starts, belief: Belief) -> list[Finding]:
    """Turns about east, wrong certificates, gyros' own changes."""
    found: list[Finding] = []
    for label in np.unique(starts.certificate):
        mine = starts[starts.certificate == label]
        mine, turns = _east(mine, belief)
        found += turns + _own(mine, belief)
    changed = np.flatnonzero(np.diff(starts.certificate)) + 1
    found += [_certificate(starts, int(place), belief) for place in changed]
    return found


def _east(starts: Starts, belief: Belief) -> tuple[Starts, list[Finding]]:
    """Turns about east under one certificate, and the starts as they would be without."""
    found: list[Finding] = []
    for _ in range(_MOST):
        if len(starts.time) < 2:
            break
        places = places_of(len(starts.time))
        cut = split(starts, places, belief)
        signatures = signatures_of(starts, cut)
        seen = shared(cut, signatures, np.array([[belief.move_size**2]]))
        prior = log_date_odds(starts.time[np.r_[0, places]], belief.moves)
        told = odds(seen.log_evidence[None], prior[None])
        if told.log < belief.log_odds:
            break
        at = int(np.argmax(told.dates))
        found.append(_turned_east(starts, places, told, seen, at, belief))
        starts = unturned(starts, int(places[at]), float(seen.value[at, 0]))
        if found[-1].verdict == "unclear":
            break
    return starts, found


def places_of(count: int) -> Whole:
    """Dates to look at, as numbers of starts: all of them, or evenly some."""
    every = np.arange(1, count)
    if len(every) <= _MOST_DATES:
        return every
    return np.unique(np.linspace(1, count - 1, _MOST_DATES).astype(np.int64))


def signatures_of(starts: Starts, cut: Splits) -> Array:
    """Mean signature of each gyro, (G, 8, 1)."""
    return np.array([starts.signature[starts.gyro == gyro].mean(axis=0) for gyro in cut.gyros])[:, :, None]


def _turned_east(starts: Starts, places: Whole, told: Odds, seen: Shared, at: int, belief: Belief) -> Finding:
    """Tell of a turn about east; where it hangs on one gyro, only the prior rates tell the stand from that gyro."""
    size = float(told.dates @ seen.value[:, 0])
    u = float(np.sqrt(told.dates @ (seen.covariance[:, 0, 0] + (seen.value[:, 0] - size) ** 2)))
    clear = float(seen.without[at]) > _OTHERS
    p = told.probability
    stand = p * (1.0 if clear else belief.moves / (belief.moves + belief.gyro_changes))
    return Finding(
        "stand" if clear else "unclear", "level-east", int(starts.session[places[at]]),
        _dated(starts, places, told.dates), size, u,
        probability={"stand": stand, "gyro": p - stand, "nothing": 1.0 - p},
        gyro=None if clear else int(seen.leading[at]),
    )  # fmt: skip


def _dated(starts: Starts, places: Whole, dates: Array) -> tuple[tuple[int, float], ...]:
    likely = np.flatnonzero(dates >= _LIKELY)
    return tuple((int(starts.session[places[k]]), float(dates[k])) for k in likely)


def _own(starts: Starts, belief: Belief) -> list[Finding]:
    """What changed in single gyros under one certificate: of each the clearest."""
    found = []
    for gyro in np.unique(starts.gyro):
        mine = starts[starts.gyro == gyro]
        if len(mine.time) < 2:
            continue
        places = np.arange(1, len(mine.time))
        cut = split(mine, places, belief)
        told = odds(cut.worth, log_date_odds(mine.time, belief.gyro_changes)[None])
        if told.log < belief.log_odds:
            continue
        at = int(np.argmax(told.dates))
        covariance = np.linalg.inv(cut.information[0, at])
        p = told.probability
        found.append(
            Finding(
                "gyro", "own", int(mine.session[places[at]]), _dated(mine, places, told.dates), np.nan, np.nan,
                covariance @ cut.score[0, at] * starts.scale,
                np.sqrt(np.diagonal(covariance)) * starts.scale,
                {"gyro": p, "nothing": 1.0 - p}, gyro=int(gyro),
            )
        )  # fmt: skip
    return found


def _certificate(starts: Starts, place: int, belief: Belief) -> Finding:
    """The shift that all gyros share at a new certificate."""
    around = starts.certificate
    mine = starts[(around == around[place - 1]) | (around == around[place])]
    at = int(np.searchsorted(mine.session, starts.session[place]))
    cut = split(mine, np.array([at]), belief)
    prior = np.diag((belief.move_size * _full_scale(mine) / starts.scale) ** 2)
    seen = shared(cut, np.broadcast_to(np.eye(8), (len(cut.gyros), 8, 8)), prior)
    p = float(special.expit(seen.log_evidence[0] + special.logit(belief.wrong_certificate)))
    return Finding(
        "certificate" if p >= belief.threshold else "none", "certificate", int(starts.session[place]),
        ((int(starts.session[place]), 1.0),), np.nan, np.nan,
        seen.value[0] * starts.scale, np.sqrt(np.diagonal(seen.covariance[0])) * starts.scale,
        {"certificate": p, "nothing": 1.0 - p},
    )  # fmt: skip


def _full_scale(starts: Starts) -> Array:
    """What 1 rad of wrong angles changes, about: the Earth rate, and of the scale factors themselves, (8,)."""
    factor = float(np.median(np.abs(starts.value[:, :2] * starts.scale[:2])))
    return np.array([factor] * 4 + [EARTH_RATE] * 4)
