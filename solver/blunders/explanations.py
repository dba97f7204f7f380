"""Every hypothesis of a session scored: what `solver.blunders.diagnosis` chooses from.

Mistakes that the fit cannot see (`solver.blunders.symmetries`) cost no fit: their parameters follow from those of
the data as given, and χ² is the same. Whether a prior that separates them from good data by Δ standard
deviations speaks for them is judged by the fall d of T, which under good data is 2·z·Δ − Δ², z standard
normal. With z* the quantile of `PRIOR_LEVEL`, the threshold

    d > z*²  for Δ < z*;    2·z*·Δ − Δ²  for z* ≤ Δ < 2·z*;    0 beyond

never gives more false alarms than that, however vague the prior, and loses nothing where it is sharp. Where the
gyro is far from its prior with the mistake put right too, it must besides be very much less far.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np
from scipy import special

from solver.blunders.channel_faults import saturated_channels, stuck_channels, surely_stuck
from solver.blunders.hypotheses import (
    Hypothesis,
    outliers,
    same_place,
    swaps,
    warm_ups,
    whole_sessions,
    wrong_positions,
)
from solver.blunders.hypothesis_fit import UNTOLD
from solver.blunders.hypothesis_score import CLEAR_RATIO, Score, Session, Sum, discrete_threshold
from solver.blunders.suspicion import Suspicion
from solver.blunders.symmetries import Symmetry, approximate_symmetries, exact_symmetries
from solver.records import Array
from solver.units import deg_per_h_from_rad_per_s

PRIOR_LEVEL: Final = 6e-3
"""False alarms of all that only a prior can tell, together."""
INVISIBLE: Final = frozenset(
    {"channels-swapped", "channel-sign", "psi-reversed", "theta-reversed", "latitude-sign", "latitude-complement",
     "current-unit"}
)  # fmt: skip
_SPEAKS: Final = 1.0
_ALIKE: Final = 1e-3
_NO_EFFECT: Final = 1e-9
_PLAUSIBLE: Final = 5.0
_REFINED: Final = 6
_TWINS: Final = 2.0
_ROUNDING: Final = 1e-20
_CERTAIN: Final = 1e3
"""Bonus of a channel that repeats one value exactly where it cannot."""


@dataclass(frozen=True, slots=True)
class Explanation:
    """One hypothesis with all that is said of it.

    Attributes
    ----------
    code, rows, details
    total
        T, by which explanations are ranked.
    gain
        By how much it is better than good data, without the Occam term.
    significant
    before, after
        χ², with the prior's part.
    fall
        The same as a sentence shows it: χ², or the residuals' standard deviation, before and after.
    values, u : (8,) array or None
        Parameters with the data put right.
    distance
        D² from the prior with the data put right; None without prior or fit.
    scatter
        Without u(J), what the residuals still scatter by, relative to what is measured.
    """

    code: str
    rows: tuple[int, ...]
    details: Mapping[str, Any]
    total: float
    gain: float
    significant: bool
    before: float
    after: float
    fall: tuple[str, float, float] = ("χ²", np.nan, np.nan)
    values: Array | None = None
    u: Array | None = None
    distance: float | None = None
    scatter: float | None = None

    @property
    def claim(self) -> tuple[Any, ...]:
        """What it says: explanations of equal claim are variants of one."""
        if self.code in ("warm-up",):
            return (self.code,)
        if self.code in ("channel-stuck", "channel-saturated"):
            return (self.code, self.details["channel"])
        if self.code == "outlier":
            return (self.code, self.rows)
        told = {**self.details}
        actual = tuple(round(angle, 6) for angle in told.get("actual", ()))
        return (self.code, self.rows, actual, told.get("channel"), told.get("factor"))


def visible(session: Session, suspicion: Suspicion) -> list[Explanation]:
    """Score the blunders of single measurements, channels and times."""
    observations, x, model = session.observations, session.x, session.model
    moved = swaps(observations, x, model) + wrong_positions(observations, x, model)
    moved.sort(key=lambda pair: pair[0])
    chosen = [hypothesis for _, hypothesis in moved[:_REFINED]]
    chosen += outliers(len(x), suspicion.worst)
    chosen += warm_ups(observations)
    chosen += stuck_channels(observations)
    chosen += saturated_channels(observations)
    certain = surely_stuck(observations, x, visible=session.visible)
    scores = session.scores(chosen)
    session.by_currents = any(score.rates is None and session.significant(score) for score in scores)
    return [_explained(session, score, certain) for score in scores]


def _explained(session: Session, score: Score, certain: str = "") -> Explanation:
    hypothesis = score.hypothesis
    assert hypothesis is not None
    details = dict(hypothesis.details)
    if score.fitted is not None and hypothesis.course is not None:
        change = float(np.ptp(hypothesis.course)) * (1 if details["course"] == "linear" else -1)
        details["drift"] = tuple(float(size) * change for size in score.fitted.drift)
    sure = hypothesis.code == "channel-stuck" and details["channel"] in certain
    before, after = session.comparable(score)
    nearer = session.nearer(score)
    apart = (session.good.distance or 0.0, score.distance or 0.0) if nearer else (0.0, 0.0)
    squares = before.squares + apart[0], after.squares + apart[1]
    measure = "χ² + D²" if nearer else "χ²"
    return Explanation(
        hypothesis.code, hypothesis.rows, details, session.total(score) - (_CERTAIN if sure else 0.0),
        session.gain(score) + nearer, sure or session.significant(score), *squares,
        (measure, *squares) if session.told else _scatters(before, after, by_currents=after is score.currents),
        *_parameters(session, score), score.distance, None if session.told else score.scatter,
    )  # fmt: skip


def _scatters(before: Sum, after: Sum, *, by_currents: bool) -> tuple[str, float, float]:
    """Standard deviations of the residuals, of the rates or relative to the currents."""
    one, other = (float(np.sqrt(item.variance)) for item in (before, after))
    if by_currents:
        return "s(J)/J", one, other
    return "s/(°/h)", deg_per_h_from_rad_per_s(UNTOLD * one), deg_per_h_from_rad_per_s(UNTOLD * other)


def _parameters(session: Session, score: Score) -> tuple[Array | None, Array | None]:
    if score.fitted is None:
        return None, None
    return score.fitted.values, np.sqrt(np.diagonal(session.covariance(score.fitted)))


def invisible(session: Session) -> list[Explanation]:
    """Score the mistakes of the session as a whole."""
    exact = exact_symmetries(session.observations.latitude)
    turned = approximate_symmetries(session.observations.latitude)
    thresholds = Thresholds(session, (*exact, *turned.values()))
    found = [_by_prior(session, item, thresholds) for item in exact]
    whole = _whole(session, turned)
    # The batch's gain is off by a few units; by itself a fall of χ² must be larger than that to count.
    least = dict.fromkeys(turned, -_PLAUSIBLE if session.prior is not None else _PLAUSIBLE)
    doubtful = [gain > least.get(hypothesis.code, _PLAUSIBLE) for hypothesis, gain in whole]
    fitted = iter(session.scores([h for (h, _), fit_it in zip(whole, doubtful, strict=True) if fit_it]))
    for (hypothesis, gain), fit_it in zip(whole, doubtful, strict=True):
        if not fit_it:
            total = 2.0 * float(np.log(hypothesis.members)) - gain
            found.append(
                Explanation(hypothesis.code, (), hypothesis.details, total, gain, False, np.nan, np.nan)
            )
            continue
        score = next(fitted)
        explained = _explained(session, score)
        if hypothesis.code in turned and session.nearer(score) > 0 and not explained.significant:
            threshold = min(discrete_threshold(hypothesis.members), thresholds.of(turned[hypothesis.code]))
            threshold = max(threshold, _least_gain(session, score.distance))
            explained = replace(explained, significant=explained.gain > threshold)
        found.append(explained)
    return found


class Thresholds:
    """What the prior must gain for each mistake; worked out only when one is asked for."""

    def __init__(self, session: Session, symmetries: Sequence[Symmetry]) -> None:
        self._session, self._symmetries = session, symmetries
        self._separations: list[float] = []

    def of(self, symmetry: Symmetry) -> float:
        """Threshold of d; infinite where the prior says next to nothing."""
        if not self._separations:
            self._separations = [_separation(self._session, item) for item in self._symmetries]
        separation = self._separations[[item is symmetry for item in self._symmetries].index(True)]
        if separation < _SPEAKS:
            return np.inf
        quantile = _quantile(self._separations)
        if separation < quantile:
            return quantile**2
        return max(0.0, 2.0 * quantile * separation - separation**2)


def _separation(session: Session, symmetry: Symmetry) -> float:
    """Δ: how far from the prior a gyro that fits it would be, put wrong; 0 where the prior is silent."""
    prior, fitted = session.prior, session.good.fitted
    if prior is None or fitted is None:
        return 0.0
    middle = np.where(prior.says, prior.values, fitted.values)
    values, covariance = symmetry.apply(middle, session.covariance(fitted))
    return float(np.sqrt(prior.distance(values, covariance, fitted.known)[0]))


def _quantile(separations: list[float]) -> float:
    """z* with the level shared by the distinct mistakes that the prior separates, but not widely."""
    z = -float(special.ndtri(PRIOR_LEVEL))
    near = sorted(s for s in separations if _SPEAKS <= s < 2.2 * z)
    classes = sum(1 for i, s in enumerate(near) if not i or s - near[i - 1] > _ALIKE * s)
    return -float(special.ndtri(PRIOR_LEVEL / max(classes, 1)))


def _by_prior(session: Session, symmetry: Symmetry, thresholds: Thresholds) -> Explanation:
    fitted, prior = session.good.fitted, session.prior
    before, values, u = session.good.distance or 0.0, None, None
    after = before
    if fitted is not None:
        values, covariance = symmetry.apply(fitted.values, session.covariance(fitted))
        u = np.sqrt(np.diagonal(covariance))
        if prior is not None:
            after = prior.distance(values, covariance, fitted.known)[0]
    gain = 0.0 if prior is None else prior.cost(before) - prior.cost(after)
    significant = gain > 0 and gain > _least_gain(session, after) and gain > thresholds.of(symmetry)
    misfit = session.good.best.squares if session.told else 0.0
    return Explanation(
        symmetry.code, (), symmetry.details, 2.0 * float(np.log(len(INVISIBLE))) - gain, gain, significant,
        misfit + before, misfit + after,
        ("χ² + D²" if session.told else "D²", misfit + before, misfit + after), values, u, after,
    )  # fmt: skip


def _least_gain(session: Session, distance: float | None) -> float:
    """What a mistake must gain at least where the gyro is far from its prior with the mistake put right too."""
    fits = session.prior is None or distance is None or session.prior.fits(distance)
    return 0.0 if fits else CLEAR_RATIO


def _whole(session: Session, turned: Mapping[str, Symmetry]) -> list[tuple[Hypothesis, float]]:
    """Angles reversed or in another unit, with about the gain of each, by one batch."""
    observations, good = session.observations, session.good
    found = whole_sessions(observations, session.x)
    if not found:
        return []
    squares = session.model.whole(
        np.stack([hypothesis.x for hypothesis in found if hypothesis.x is not None])
    )
    before = good.currents.squares
    gains = []
    for hypothesis, square in zip(found, squares, strict=True):
        if session.told:
            gain = before - float(square)
        else:
            floor = _ROUNDING * float(np.sum(session.model.weights * session.model.currents**2))
            gain = max(good.best.dof, 0) * float(np.log((before + floor) / (square + floor)))
        if hypothesis.code in turned and session.prior is not None and good.fitted is not None:
            moved = turned[hypothesis.code].apply(good.fitted.values, session.covariance(good.fitted))
            gain += session.prior.cost(good.distance or 0.0)
            gain -= session.prior.cost(session.prior.distance(*moved, good.fitted.known)[0])
        gains.append((hypothesis, gain))
    return gains


def twins(session: Session) -> list[tuple[int, int]]:
    """Measurements whose exchange would not show: they differ by their misalignment alone."""
    fitted = session.good.fitted
    if fitted is None or session.good.best.dof < 1:
        return []
    at, model = session.observations, session.model
    predicted = model.currents - session.rest
    variance = session.u**2
    if not session.told:
        variance = variance * max(session.good.currents.variance, np.finfo(float).tiny)
    one, other = np.nonzero(np.triu(~same_place(at), 1))
    apart = np.sum((predicted[one] - predicted[other]) ** 2 / (variance[one] + variance[other]), axis=1)
    near = apart < _TWINS * discrete_threshold(max(len(one), 1))
    return [(int(p), int(r)) for p, r in zip(one[near], other[near], strict=True)]
