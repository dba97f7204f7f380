"""Blunders of a session explained: every hypothesis under one objective.

For a hypothesis h that puts the data right (`solver.blunders.hypotheses`, `solver.blunders.symmetries`),

    T(h) = χ²(data put right) + D²(fit, prior) + Occam(h)

with χ² whitened by the covariance of all inputs, D² of `solver.blunders.prior`, and an Occam term: twice the
logarithm of the number of hypotheses of the kind, and `OCCAM` for each free unknown. Hypotheses are
ranked by T. One is *reported* only when it is significant by itself, at a level of its kind, and
those within `EQUIVALENT` of the best form one class: named together, with what would separate them.

Without u(J) the noise is estimated under each hypothesis: ν·ln s² takes the place of χ², and F the
place of χ² in tests. The same where χ² stays improbable with the blunder taken out, so that noise
larger than stated is not taken for a blunder.

Levels (false alarms per session of good data): `LEVEL` for each kind visible in the fit, together about
3e-3; `PRIOR_LEVEL` for all that only a prior can tell, which with the usual prior (ωg around zero by
5 °/h/g, latitude 56°, so that the latitude's wrong sign moves ωg by 5 standard deviations) is where
missing it is as improbable.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Final

import numpy as np
from scipy import special

from solver.blunders.channel_faults import surely_stuck
from solver.blunders.explanations import INVISIBLE, Explanation, invisible, twins, visible
from solver.blunders.hypothesis_fit import Fitted
from solver.blunders.hypothesis_score import Session
from solver.blunders.prior import Prior
from solver.blunders.suspicion import NOTICED, hidden, suspect
from solver.blunders.verdicts import (
    cannot_exclude,
    differences,
    errors_hidden,
    factor_text,
    far_from_prior,
    or_changed,
    place,
    places,
    scattered,
    separate,
    small_angles,
    twins_alike,
    unexplained,
    verdict,
)
from solver.errors import Message
from solver.inputs import CommonUncertainty
from solver.records import PARAMETERS, Observations

UNEXPLAINED_LEVEL: Final = 1e-6
EQUIVALENT: Final = 9.2
"""2·ln 100: odds of less than a hundred to one."""
_LEAST_POSITIONS: Final = 2
_OVERSTATED: Final = 1e-3
"""χ² over its freedom below which the stated noise is of no use: u(J) in another unit than J, perhaps."""
_ABSURD: Final = 0.01
"""Scatter without u(J), relative to the Earth rate, that is no gyro's noise: 0.15 °/h, by which a K is uncertain by
about 1 % of itself."""
_MOST_EQUIVALENT: Final = 6
_APART: Final = 3.0
_CONCEIVABLE: Final = 5.0
"""How many times more than the prior says a gyro may have changed, at most, to be believed."""


@dataclass(frozen=True, slots=True)
class Finding:
    """One blunder that explains the data.

    Attributes
    ----------
    code
        ``unexplained`` and ``far-from-prior`` say that something is wrong and no blunder explains it.
    message
        What it is and what to do.
    positions
        (θ, ψ), or (θ, ψ, repeat) where the position was repeated, rad.
    chi2_before, chi2_after
        None without u(J).
    details
        ``channel``, ``actual`` (θ, ψ in rad), ``factor``, … and ``equivalents``: the other members of
        its class, each a mapping with ``code``, ``positions`` and its details.
    advice
        What would separate the members of the class; for one that only the prior tells, what else could be.
    """

    code: str
    message: Message
    positions: tuple[tuple[float, ...], ...]
    chi2_before: float | None
    chi2_after: float | None
    details: Mapping[str, Any] = field(default_factory=dict)
    advice: Message | None = None


@dataclass(frozen=True, slots=True)
class Diagnosis:
    """Findings, best explanation first, and what could not be excluded."""

    findings: tuple[Finding, ...] = ()
    not_excluded: tuple[Message, ...] = ()


def diagnose(
    observations: Observations, common: CommonUncertainty | None = None, prior: Prior | None = None
) -> Diagnosis:
    """Look for blunders in a session.

    Parameters
    ----------
    observations
    common
        Uncertainty of what the positions share.
    prior
        What the gyro is expected to be; without it, mistakes that turn one gyro into another are
        listed as not excluded.
    """
    if len(observations) < _LEAST_POSITIONS:
        return Diagnosis()
    session = Session.of(observations, common, None if prior is None else prior.with_coupling())
    best = session.good.best
    if session.told and best.dof > 0 and best.variance < _OVERSTATED:
        return diagnose(replace(observations, u_jx=None, u_jy=None), common, prior)
    explanations = invisible(session)
    suspicion = suspect(session)
    if suspicion.search or surely_stuck(observations, session.x, visible=session.visible):
        explanations += visible(session, suspicion)
    explanations = _distinct(explanations)
    findings = _findings(session, explanations)
    findings = findings or _unexplained(session) or _changed(session)
    return Diagnosis(findings, _not_excluded(session, explanations))


def _distinct(explanations: list[Explanation]) -> list[Explanation]:
    """Of those that say the same, the best; best first."""
    kept: dict[tuple[Any, ...], Explanation] = {}
    for item in sorted(explanations, key=lambda item: (not item.significant, item.total)):
        kept.setdefault(item.claim, item)
    return sorted(kept.values(), key=lambda item: item.total)


def _findings(session: Session, explanations: list[Explanation]) -> tuple[Finding, ...]:
    """The best significant explanation and those that are as good."""
    best = next((item for item in explanations if item.significant), None)
    if best is None:
        return ()
    alike = [
        item
        for item in explanations
        if item is not best
        and abs(item.total - best.total) < EQUIVALENT
        and (item.significant or {item.code, best.code} <= INVISIBLE)
    ][:_MOST_EQUIVALENT]
    members = [best, *alike]
    more = session.reported() - session.good.best.squares if session.told and not session.by_currents else 0.0
    found = tuple(
        _finding(session, item, [other for other in members if other is not item], more) for item in members
    )
    return found + (() if best.scatter is None else _scattered(best.scatter))


def _unexplained(session: Session) -> tuple[Finding, ...]:
    """A misfit far beyond the stated noise, or without u(J) beyond that of any gyro that the method is for."""
    best = session.good.best
    if session.improbable(session.good, UNEXPLAINED_LEVEL):
        chi2 = session.reported()
        message = unexplained("χ²", chi2, best.dof)
        return (Finding(message.code, message, (), chi2, None),)
    if session.told or best.dof < 1:
        return ()
    return _scattered(session.good.scatter)


def _scattered(scatter: float) -> tuple[Finding, ...]:
    """That what scatters so much, relative to what is measured, is not noise."""
    if scatter < _ABSURD:
        return ()
    message = scattered(scatter)
    return (Finding(message.code, message, (), None, None),)


def _changed(session: Session) -> tuple[Finding, ...]:
    """That a sound fit is not the gyro which the prior expects."""
    prior, fitted = session.prior, session.good.fitted
    if prior is None or fitted is None or fitted.dof < 1:
        return ()
    distance, compared = prior.distance(fitted.values, session.covariance(fitted), fitted.known)
    if not compared or _chance_of(session, distance, compared, fitted.dof) > UNEXPLAINED_LEVEL:
        return ()
    message = far_from_prior(_differences(session, prior, fitted), distance, compared)
    chi2 = session.reported() if session.told else None
    return (Finding(message.code, message, (), chi2, None, {"distance": distance}),)


def _differences(session: Session, prior: Prior, fitted: Fitted) -> str:
    apart = prior.apart(fitted.values, session.covariance(fitted), fitted.known)
    return differences(fitted.values - prior.values, apart)


def _or_changed(session: Session, item: Explanation) -> Message | None:
    """What a mistake that only the prior tells leaves to believe when it was none, where that can be believed."""
    prior, fitted, distance = session.prior, session.good.fitted, session.good.distance
    if item.code not in INVISIBLE or prior is None or fitted is None or distance is None:
        return None
    conceivable = distance < _CONCEIVABLE**2 * int(prior.says.sum())
    return or_changed(_differences(session, prior, fitted)) if conceivable else None


def _chance_of(session: Session, distance: float, compared: int, dof: int) -> float:
    """Probability of such a D² of the gyro that the prior expects."""
    if session.told:
        return float(special.chdtrc(compared, distance))
    return float(special.fdtrc(compared, dof, distance / compared))


def _finding(session: Session, item: Explanation, others: list[Explanation], more: float) -> Finding:
    """A finding; `more` is what a result states as χ² beyond what the explanations start from."""
    observations = session.observations
    measure, before, after = item.fall
    message = verdict(item.code, observations, item.rows, item.details, (measure, before + more, after))
    details = dict(item.details)
    advice = _or_changed(session, item)
    if others:
        details["equivalents"] = tuple(
            {"code": other.code, "positions": _positions(observations, other.rows), **other.details}
            for other in others
        )
        advice = separate([_named(observations, other) for other in others], _apart(item, others))
    return Finding(
        item.code, message, _positions(observations, item.rows),
        item.before + more if session.told else None, item.after if session.told else None, details, advice,
    )  # fmt: skip


def _positions(observations: Observations, rows: Sequence[int]) -> tuple[tuple[float, ...], ...]:
    at = observations
    named = []
    for row in rows:
        position: tuple[float, ...] = (float(at.theta[row]), float(at.psi[row]))
        alike = (at.theta == at.theta[row]) & (at.psi == at.psi[row])
        named.append((*position, int(at.repeat[row])) if alike.sum() > 1 else position)
    return tuple(named)


def _named(observations: Observations, item: Explanation) -> str:
    """A member of a class in no language: its code, channel or factor, and positions."""
    parts = [item.code]
    if "channel" in item.details:
        parts.append(item.details["channel"])
    if "factor" in item.details:
        parts.append(f"×{factor_text(item.details['factor'])}")
    if item.rows:
        parts.append(f"({places(observations, item.rows)})")
    if "actual" in item.details:
        parts.append(f"→ {place(*item.details['actual'])}")
    return " ".join(parts)


def _apart(item: Explanation, others: list[Explanation]) -> list[str]:
    """Parameters by which members of a class differ, where they are blunders of the whole session."""
    if item.rows or item.values is None or item.u is None:
        return []
    found = np.zeros(len(PARAMETERS), dtype=np.bool_)
    for other in others:
        if other.rows or other.values is None or other.u is None:
            return []
        found |= np.abs(item.values - other.values) > _APART * np.hypot(item.u, other.u)
    return [name for name, apart in zip(PARAMETERS, found, strict=True) if apart]


def _not_excluded(session: Session, explanations: list[Explanation]) -> tuple[Message, ...]:
    """What neither fit nor prior can tell from good data."""
    near = [item for item in explanations if not item.significant and item.gain > -EQUIVALENT]
    codes = list(dict.fromkeys(item.code for item in near if item.code in INVISIBLE))
    messages = []
    if codes:
        messages.append(cannot_exclude(codes, prior_given=session.prior is not None))
    factors = sorted(item.details["factor"] for item in near if item.code == "angle-unit")
    if factors:
        messages.append(small_angles(factors))
    faint = hidden(session)
    if faint:
        messages.append(errors_hidden(session.observations, faint, NOTICED))
    pairs = twins(session)
    if pairs:
        messages.append(twins_alike(session.observations, pairs))
    return tuple(messages)
