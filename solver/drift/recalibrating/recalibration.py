"""When to recalibrate: the five methods of ILAC-G24:2022 / OIML D 10:2022, clause 6, each with its reason.

Staircase (6.2)
    Intervals are steps of `GRID`. Twice running within 80 % of the limits at the end of the interval: one step
    longer; once beyond a limit: one step shorter than the interval in which it happened; else as it is. A finding
    before three quarters of the interval are over says nothing for a longer one.
Control chart (6.3)
    Until the band that holds the next value, from drift and scatter, meets a limit.
In-use time (6.4)
    The same by the starts or hours that a gyro has run: `solver.drift.recalibrating.in_use`.
In-service checking (6.5)
    An interval of checks, not of calibrations. A check of standard uncertainty u finds a deviation with
    95 % probability, at 5 % false alarms, if it is (z_0.975 + z_0.95)·u or more. So that it is found before the limit
    is reached, checks must follow one another within the time in which the drift takes the rest of the way.
Other statistical approaches (6.6)
    Share of findings within tolerance: `reliability`, by the reliability model where the intervals
    were of different lengths, else by the test of the one interval; it judges the interval so far if the findings
    count as found at its end. Findings of which none is beyond a limit never speak for a shorter one.

The recommendation is the shortest that applies, down to the next step of the grid, and at most twice the interval so
far: nothing is known of what lies further ahead.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, Literal

import numpy as np
from scipy import special

from solver.drift.recalibrating import interval_reasons as reasons
from solver.drift.recalibrating.in_use import Use, band_meets, follow_use
from solver.drift.recalibrating.interval_evidence import COUNTS_FROM, Check, Evidence, Findings, Outlook
from solver.drift.recalibrating.interval_reasons import Method
from solver.drift.recalibrating.reliability import TARGET, judge_interval, reliability_model
from solver.errors import InputError, Message
from solver.records import Array

__all__ = [
    "Check", "Evidence", "Findings", "Method", "MethodAdvice", "Outlook", "Recommendation", "Use",
    "choose", "control_chart", "in_service", "in_use", "recommend", "staircase", "statistical",
]  # fmt: skip
GRID: Final = (7, 14, 30, 61, 91, 122, 183, 274, 365, 548, 730, 1096, 1461, 1826)
"""Days: one and two weeks, one, two, three, four, six, nine months, one year, and so on to five."""
COMFORTABLE: Final = 0.8
"""Share of the limits within which a finding speaks for a longer interval."""
SIGNIFICANT: Final = 0.05
_LARGEST_CHANGE: Final = 2.0
_FEWEST_FINDINGS: Final = 5
_ONE_LENGTH: Final = 1.5
"""Intervals that differ by no more than this factor count as one."""
_DETECTED: Final = float(special.ndtri(0.975) + special.ndtri(0.95))


@dataclass(frozen=True, slots=True)
class MethodAdvice:
    """What one method advises.

    Attributes
    ----------
    method
    days : float or None
        None where it does not apply; the reason says why.
    reason
    interval_of
        ``recalibration``, or ``check`` for in-service checking.
    """

    method: Method
    days: float | None
    reason: Message
    interval_of: Literal["recalibration", "check"] = "recalibration"


@dataclass(frozen=True, slots=True)
class Recommendation:
    """The interval to be recommended; 0 days if it is over.

    Attributes
    ----------
    days : int
    methods : tuple of MethodAdvice
        In the order of ILAC-G24.
    reason
    """

    days: int
    methods: tuple[MethodAdvice, ...]
    reason: Message


def recommend(evidence: Evidence) -> Recommendation:
    """Ask every method, and take the shortest interval that any gives.

    Raises
    ------
    InputError
        When the interval so far is not positive, or the evidence does not fit together.
    """
    if not (np.isfinite(evidence.days) and evidence.days > 0.0):
        raise InputError(_INTERVAL)
    methods = (
        staircase(evidence.days, evidence.own),
        control_chart(evidence.outlooks, evidence.horizon),
        in_use(evidence.uses, evidence.horizon),
        in_service(evidence.checks, evidence.horizon),
        statistical(evidence.days, evidence.own, evidence.of_type, evidence.target),
    )
    return choose(evidence.days, methods)


def choose(days: float, methods: tuple[MethodAdvice, ...]) -> Recommendation:
    """Take the shortest interval that any method gives.

    Parameters
    ----------
    days : float
        Interval so far.
    methods
        In the order of ILAC-G24.
    """
    given = [one for one in methods if one.days is not None and one.interval_of == "recalibration"]
    if not given:
        return Recommendation(round(days), methods, reasons.nothing(days))
    shortest = min(given, key=lambda one: one.days or 0.0)
    wanted = shortest.days or 0.0
    taken = _down(min(wanted, _LARGEST_CHANGE * days), days)
    return Recommendation(taken, methods, reasons.chosen(shortest.method, taken, wanted, days))


def staircase(days: float, findings: Findings | None) -> MethodAdvice:
    """Method 1: a step longer or shorter by the last findings."""
    times, used = (np.empty(0), np.empty(0)) if findings is None else findings.checked()
    if len(used) and used[-1] > 1.0:
        failed = min(days, float(times[-1]))
        shorter = _step(failed, -1)
        return MethodAdvice("staircase", shorter, reasons.beyond(failed, shorter, float(used[-1])))
    counting = used[(times >= COUNTS_FROM * days) | (used > 1.0)]
    if len(counting) == 0:
        return MethodAdvice("staircase", None, reasons.no_findings(days, len(used)))
    last = counting[-2:]
    if len(last) == 2 and last.max() <= COMFORTABLE:
        longer = _step(days, 1)
        return MethodAdvice("staircase", longer, reasons.comfortable(longer, float(last.max())))
    return MethodAdvice("staircase", days, reasons.stays(days, float(last[-1])))


def control_chart(outlooks: Sequence[Outlook], horizon: float) -> MethodAdvice:
    """Method 2: until the first band meets a limit."""
    met = []
    for one in outlooks:
        days, low, high = (np.asarray(column, np.float64) for column in (one.days, one.low, one.high))
        if not (days.ndim == 1 and len(days) and low.shape == high.shape == days.shape):
            raise InputError(_OUTLOOK)
        day = band_meets(days, low, high, one.lower_limit, one.upper_limit)
        met.append((np.inf if day is None else day, one.parameter))
    if not met:
        return MethodAdvice("control-chart", None, reasons.no_outlook())
    first, parameter = min(met)
    if not np.isfinite(first):
        return MethodAdvice("control-chart", horizon, reasons.band_stays(horizon))
    reason = reasons.band_over(parameter) if first <= 0.0 else reasons.band(parameter, first)
    return MethodAdvice("control-chart", first, reason)


def in_use(uses: Sequence[Use], horizon: float) -> MethodAdvice:
    """Method 3: until the use has taken a parameter to its limit, for those that follow the use."""
    fits = [(one, follow_use(one, horizon)) for one in uses]
    known = [(one, fit) for one, fit in fits if fit is not None]
    if not known:
        return MethodAdvice("in-use", None, reasons.no_use())
    level = SIGNIFICANT / len(known)  # Bonferroni: no parameter is to follow the use by chance
    following = [(one, fit) for one, fit in known if fit.p_value < level]
    if not following:
        return MethodAdvice(
            "in-use", None, reasons.not_by_use(min(fit.p_value for _, fit in known) * len(known))
        )
    met = [(one, fit) for one, fit in following if fit.days is not None]
    if not met:
        return MethodAdvice("in-use", horizon, reasons.use_stays(horizon))
    one, fit = min(met, key=lambda pair: pair[1].days or 0.0)
    return MethodAdvice("in-use", fit.days, reasons.by_use(one, fit))


def in_service(checks: Sequence[Check], horizon: float) -> MethodAdvice:
    """Method 4: how often to check."""
    if not checks:
        return MethodAdvice("in-service", None, reasons.no_check(), "check")
    found = []
    for one in checks:
        if not (one.u >= 0.0 and one.drift >= 0.0 and np.isfinite(one.margin)):
            raise InputError(_CHECK)
        rest = one.margin - _DETECTED * one.u
        found.append((rest / one.drift if one.drift > 0.0 else np.copysign(np.inf, rest), one))
    days, one = min(found, key=lambda pair: pair[0])
    seen = _DETECTED * one.u
    if days <= 0.0:
        return MethodAdvice("in-service", None, reasons.check_blind(one, seen), "check")
    days = min(days, horizon)
    return MethodAdvice("in-service", days, reasons.check(one, days, seen), "check")


def statistical(
    days: float, own: Findings | None, of_type: Findings | None, target: float = TARGET
) -> MethodAdvice:
    """Method 5: by the share of findings within tolerance, of the type if there are any, else of the gyro."""
    findings = own if of_type is None else of_type
    times, used = (np.empty(0), np.empty(0)) if findings is None else findings.checked()
    if len(times) < _FEWEST_FINDINGS:
        return MethodAdvice("statistical", None, reasons.few_findings(len(times)))
    within, longest = used <= 1.0, float(times.max())
    count, good = len(times), int(within.sum())
    length = _judged(days, times)
    if longest <= _ONE_LENGTH * float(times.min()):
        one = judge_interval(good, count, length, target)
        return MethodAdvice(
            "statistical", one.days, reasons.tested(one.changed, good, count, one.days, target)
        )
    model = reliability_model(times, within, target)
    ahead = min(model.days, _LARGEST_CHANGE * longest)
    if good == count and ahead < length:  # few findings, all of them good, are no ground for a shorter one
        return MethodAdvice("statistical", length, reasons.all_within(count, length))
    return MethodAdvice("statistical", ahead, reasons.modelled(good, count, ahead, model.at_least, target))


def _judged(days: float, times: Array) -> float:
    """The interval that findings judge: the one so far, if they count as found at its end, else their middle."""
    middle = float(np.median(times))
    return days if COUNTS_FROM * days <= middle <= days / COUNTS_FROM else middle


def _step(days: float, by: int) -> float:
    """The next step of the grid above or below."""
    if by > 0:
        return float(next((step for step in GRID if step > days), max(GRID[-1], days)))
    return float(next((step for step in reversed(GRID) if step < days), GRID[0]))


def _down(days: float, now: float) -> int:
    """To the grid or the interval so far, whichever is next below; less than its first step is over."""
    steps = sorted({*GRID, round(now)})
    return int(max((step for step in steps if step <= days + 0.5), default=0))


_INTERVAL = Message("interval-length", "The interval so far must be a positive number of days.")
_OUTLOOK = Message("interval-outlook", "The band of a forecast needs as many ends as moments.")
_CHECK = Message(
    "interval-check", "A check needs an uncertainty and a drift that are not negative, and a finite margin."
)
