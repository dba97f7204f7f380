"""The reasons that `solver.drift.recalibrating.recalibration` gives, each with its numbers."""

from typing import Literal

from solver.drift.recalibrating.in_use import Use, UseFit
from solver.drift.recalibrating.interval_evidence import Check
from solver.errors import Message

Method = Literal["staircase", "control-chart", "in-use", "in-service", "statistical"]


def beyond(days: float, shorter: float, used: float) -> Message:
    """Staircase: down."""
    return Message(
        "staircase-beyond",
        "The last calibration, after %(days)d days, found %(used)d %% of a limit used: beyond it. One step "
        "shorter is %(shorter)d days.",
        {"used": round(100.0 * min(used, 1e6)), "days": round(days), "shorter": round(shorter)},
    )


def comfortable(longer: float, used: float) -> Message:
    """Staircase: up."""
    return Message(
        "staircase-longer",
        "Twice running no more than %(used)d %% of the limits were used at the end of the interval. One step "
        "longer is %(longer)d days.",
        {"used": round(100.0 * used), "longer": round(longer)},
    )


def stays(days: float, used: float) -> Message:
    """Staircase: as it is."""
    return Message(
        "staircase-stays",
        "The last calibration that counts found %(used)d %% of the limits used: within them, but not twice running "
        "within 80 %%. The interval of %(days)d days stays.",
        {"used": round(100.0 * used), "days": round(days)},
    )


def no_findings(days: float, count: int) -> Message:
    """Staircase: nothing to go by."""
    return Message(
        "staircase-none",
        "No recalibration near the end of the interval of %(days)d days is known (known in all: %(count)d); a longer "
        "interval needs two.",
        {"count": count, "days": round(days)},
    )


def band(parameter: str, days: float) -> Message:
    """Control chart."""
    return Message(
        "chart-band",
        "By its drift and scatter, the next value of %(parameter)s may lie beyond its limit from %(days)d days "
        "after the last calibration.",
        {"parameter": parameter, "days": round(days)},
    )


def band_over(parameter: str) -> Message:
    """Control chart: too late."""
    return Message(
        "chart-over",
        "By its drift and scatter, the next value of %(parameter)s may lie beyond its limit already now.",
        {"parameter": parameter},
    )


def band_stays(days: float) -> Message:
    """Control chart: no end in sight."""
    return Message(
        "chart-stays",
        "By their drift and scatter, the next values of all parameters with limits lie within them for "
        "%(days)d days at least; nothing further was looked at.",
        {"days": round(days)},
    )


def no_outlook() -> Message:
    """Control chart: nothing to go by."""
    return Message(
        "chart-none", "No parameter has both limits and enough calibrations for a forecast of its next value."
    )


def by_use(use: Use, fit: UseFit) -> Message:
    """In-use time."""
    numbers = {
        "parameter": use.parameter,
        "per_use": fit.per_use,
        "per_day": fit.per_day,
        "unit": use.unit,
        "uses": int(fit.uses or 0.0),
        "days": round(fit.days or 0.0),
    }
    if use.counted == "hours":
        return Message(
            "use-limit-hours",
            "%(parameter)s changes by %(per_use).3g %(unit)s with each hour of running, and by %(per_day).3g "
            "%(unit)s a day beside; its next value may lie beyond its limit after %(uses)d more hours, "
            "in %(days)d days at the present rate.",
            numbers,
        )
    return Message(
        "use-limit-starts",
        "%(parameter)s changes by %(per_use).3g %(unit)s with each start, and by %(per_day).3g %(unit)s a day beside; "
        "its next value may lie beyond its limit after %(uses)d more starts, in %(days)d days at the present rate.",
        numbers,
    )


def use_stays(days: float) -> Message:
    """In-use time: no end in sight."""
    return Message(
        "use-stays",
        "What changes with the use stays within its limits for %(days)d days at least at the present "
        "rate; nothing further was looked at.",
        {"days": round(days)},
    )


def not_by_use(p_value: float) -> Message:
    """In-use time: it does not matter."""
    return Message(
        "use-none-follows",
        "No parameter is seen to change with the use, starts or hours, beside the calendar (p = %(p).2g).",
        {"p": min(1.0, p_value)},
    )


def no_use() -> Message:
    """In-use time: nothing to go by."""
    return Message(
        "use-none",
        "Not known: five calibrations of a parameter with limits are needed, and the starts or hours between them.",
    )


def check(one: Check, days: float, seen: float) -> Message:
    """In-service checking."""
    return Message(
        "check-interval",
        "A check finds a deviation of %(parameter)s by %(seen).3g %(unit)s; it has %(margin).3g %(unit)s to its limit. "
        "A check every %(days)d days finds it before.",
        {
            "parameter": one.parameter,
            "seen": seen,
            "margin": one.margin,
            "unit": one.unit,
            "days": int(days),
        },
    )


def check_blind(one: Check, seen: float) -> Message:
    """In-service checking: too coarse."""
    return Message(
        "check-blind",
        "A check finds a deviation of %(parameter)s only from %(seen).3g %(unit)s, but it has no more than "
        "%(margin).3g %(unit)s to its limit: it may be beyond before a check can tell.",
        {"parameter": one.parameter, "seen": seen, "margin": max(0.0, one.margin), "unit": one.unit},
    )


def no_check() -> Message:
    """In-service checking: nothing to go by."""
    return Message("check-none", "No check measurement between calibrations is known.")


def tested(changed: bool, within: int, count: int, days: float, target: float) -> Message:
    """Statistical: one interval."""
    numbers = {"within": within, "count": count, "days": round(days), "target": round(100.0 * target, 1)}
    if not changed:
        return Message(
            "findings-stand",
            "%(within)d of %(count)d recalibrations found everything within limits: no proof that the share differs "
            "from %(target)g %%. The interval stands at %(days)d days.",
            numbers,
        )
    return Message(
        "findings-change",
        "%(within)d of %(count)d recalibrations found everything within limits, where %(target)g %% are wanted: "
        "%(days)d days (NCSLI RP-1, method A3).",
        numbers,
    )


def modelled(within: int, count: int, days: float, at_least: float, target: float) -> Message:
    """Statistical: a model."""
    return Message(
        "findings-model",
        "%(within)d of %(count)d recalibrations, after intervals of different lengths, found everything within limits: "
        "%(target)g %% stay so for %(days)d days (NCSLI RP-1, method S2; with 95 %% confidence for %(at_least)d).",
        {
            "within": within,
            "count": count,
            "days": round(days),
            "at_least": int(at_least),
            "target": round(100.0 * target, 1),
        },
    )


def all_within(count: int, days: float) -> Message:
    """Statistical: nothing was beyond a limit."""
    return Message(
        "findings-all-within",
        "All of %(count)d recalibrations, after intervals of different lengths, found everything within limits: "
        "nothing speaks against %(days)d days.",
        {"count": count, "days": round(days)},
    )


def few_findings(count: int) -> Message:
    """Statistical: nothing to go by."""
    return Message(
        "findings-few",
        "Recalibrations known: %(count)d; a statement on the share within limits needs five at least.",
        {"count": count},
    )


def nothing(days: float) -> Message:
    """No method applies."""
    return Message(
        "interval-none",
        "None of the methods has enough to go by; the interval of %(days)d days stays.",
        {"days": round(days)},
    )


def chosen(method: Method, days: int, wanted: float, now: float) -> Message:
    """Which method decides."""
    numbers = {"days": days, "wanted": round(wanted), "now": round(now)}
    if days == 0:
        return Message(
            "interval-over",
            "No interval keeps the gyro within its limits: the shortest advice is over within a week. Recalibrate "
            "now, and judge whether it is fit for use.",
            numbers,
        )
    if wanted > 2.0 * now:
        return Message(
            "interval-doubled",
            "%(days)d days: the shortest advice is %(wanted)d days, but no more than twice the interval so far, "
            "%(now)d days, is taken at once.",
            numbers,
        )
    return _shortest(method, numbers)


def _shortest(method: Method, numbers: dict[str, int]) -> Message:
    if method == "staircase":
        return Message(
            "interval-staircase",
            "%(days)d days: the shortest advice is the staircase's, %(wanted)d days.",
            numbers,
        )
    if method == "control-chart":
        return Message(
            "interval-chart",
            "%(days)d days: the shortest advice is the control chart's, %(wanted)d days.",
            numbers,
        )
    if method == "in-use":
        return Message(
            "interval-use",
            "%(days)d days: the shortest advice is by the time in use, %(wanted)d days.",
            numbers,
        )
    return Message(
        "interval-statistical",
        "%(days)d days: the shortest advice is by the share of findings within limits, %(wanted)d days.",
        numbers,
    )
