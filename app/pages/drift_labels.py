"""Names of findings, causes, events, baselines and models in words."""

from collections.abc import Sequence
from datetime import date
from typing import Final

from markupsafe import Markup, escape

from app import figures
from app.i18n import gettext, marked, translate
from app.pages import labels
from app.pages.labels import Mark
from app.services.drift.acts import Act
from app.services.drift.due import Due
from app.services.drift.views import EventView
from solver.drift.control.false_alarms import Chances
from solver.drift.control.run_rules import RULES

ALARM_KINDS: Final = {
    "out-of-limits": Mark("out", marked("Out of limits")),
    "beyond-limits": Mark("out", marked("Beyond control")),
    "step": Mark("out", marked("Step")),
    "ewma": Mark("out", marked("Shifted (EWMA)")),
    "cusum": Mark("out", marked("Shifted (CUSUM)")),
    "trend": Mark("attention", marked("Drifting")),
    "limit-ahead": Mark("attention", marked("Limit ahead")),
    "repeatability": Mark("attention", marked("Scatters too much")),
    "stand-azimuth": Mark("out", marked("Stand turned in azimuth")),
    "stand-level-north": Mark("out", marked("Stand tilted about north")),
    "stand-level-east": Mark("out", marked("Stand tilted about east")),
    "stand-certificate": Mark("out", marked("Stand’s certificate doubtful")),
}
"""Kinds of alarm with the shape of their mark; a run rule is none of them and reads `_RUN`."""

_SHORT: Final = 10
_RUN: Final = Mark("attention", marked("Not by chance"))
_SHAPES: Final = {"serious": "out", "warning": "attention", "notice": "due"}
BEYOND: Final = "nelson-1"
"""Signal of a value that lies beyond its own control limits."""

CAUSES: Final = {
    "gyro": marked("The gyro itself"), "stand": marked("The stand"), "certificate": marked("The stand’s certificate"),
    "operator": marked("How it was measured"), "environment": marked("Temperature, vibration, power"),
    "repair": marked("A repair or an adjustment"),
    "false-alarm": marked("False alarm"), "other": marked("Something else"),
}  # fmt: skip
"""What a person may name as the cause of an alarm; pass through `cause`."""

EVENT_KINDS: Final = {
    "repair": marked("Repair"), "adjustment": marked("Adjustment"), "moved": marked("Moved"),
    "method": marked("Change of method"), "other": marked("Other"), "certificate": marked("New certificate"),
    "solver": marked("New solver version"), "stand": marked("Another stand"),
}  # fmt: skip

_ACTS: Final = {
    "event-entered": marked("event entered"), "event-withdrawn": marked("event withdrawn"),
    "baseline-frozen": marked("baseline frozen"), "baseline-retired": marked("baseline retired"),
    "alarm-acknowledged": marked("alarm acknowledged"),
}  # fmt: skip

_SOURCES: Final = {
    "within-position": marked("Within a position"), "between-positions": marked("Between positions"),
    "between-sessions": marked("Between sessions"), "between-starts": marked("Between starts"),
    "between-days": marked("Between days"), "fixed": marked("The course itself"),
}  # fmt: skip

_STATUSES: Final = {
    "in-control": Mark("ok", marked("in control")),
    "beyond-control": Mark("out", marked("beyond control")),
    "no-baseline": Mark("todo", marked("no baseline")),
}

_ESTIMATORS: Final = {
    "moving-range": marked("mean moving range"), "standard-deviation": marked("standard deviation"),
    "paule-mandel": marked("Paule–Mandel"),
}  # fmt: skip
_LIMITS: Final = {
    "prediction": marked("prediction limits of stated probability"), "three-sigma": marked("three standard deviations"),
}  # fmt: skip
_MODELS: Final = {
    "constant": marked("constant"), "linear": marked("linear"), "exponential": marked("exponential ageing"),
}  # fmt: skip
_GROUPS: Final = {
    "session": marked("session"), "start": marked("start"), "day": marked("day"), "month": marked("month"),
    "year": marked("year"),
}  # fmt: skip
_STATES: Final = {
    "open": Mark("due", marked("Open")), "acknowledged": Mark("saved", marked("Acknowledged")),
    "replaced": Mark("excluded", marked("Corrected")), "lapsed": Mark("ok", marked("Over")),
}  # fmt: skip
_METHODS: Final = {
    "staircase": marked("Staircase"), "control-chart": marked("Control chart"), "in-use": marked("Time in use"),
    "in-service": marked("Check in service"), "statistical": marked("Statistics of the type"),
}  # fmt: skip


def alarm(kind: str, severity: str = "") -> Mark:
    """What was found, in a word or two."""
    known = ALARM_KINDS.get(kind, _RUN)
    return Mark(_SHAPES.get(severity, known.shape), gettext(known.word))


def alarm_state(state: str) -> Mark:
    """Whether somebody has acknowledged it."""
    mark = _STATES[state]
    return Mark(mark.shape, gettext(mark.word))


def is_beyond(signals: tuple[str, ...]) -> bool:
    """Whether a value lies beyond its own control limits."""
    return BEYOND in signals


def rule(name: str) -> str:
    """A run rule in words; ``ewma`` and ``cusum`` are rules of their charts."""
    if name in RULES:
        return translate(RULES[name].description)
    return alarm(name).word


def chart_rule(name: str) -> str:
    """A rule to choose: a pattern of single values, or a chart that watches for small shifts."""
    charts = {"ewma": gettext("EWMA: a weighted average beyond its limits"),
              "cusum": gettext("CUSUM: a cumulative sum beyond its decision interval")}  # fmt: skip
    return charts.get(name) or rule(name)


def chances(found: Chances) -> str:
    """How often the charts chosen alarm for nothing."""
    if not found.rate > 0.0:
        return gettext("No rule is chosen: nothing will raise an alarm.")
    return gettext(
        "While the gyro is well, expect one false alarm in about %(count)s sessions of each parameter."
    ) % {"count": figures.significant(float(f"{found.values_between:.2g}"), 4)}


def cause(name: str) -> str:
    """The cause that a person named."""
    return gettext(CAUSES.get(name, name))


def due(found: Due, today: date) -> Mark:
    """When the gyro is due, with the state of that."""
    said = gettext("calibration due %(day)s, %(term)s")
    if found.due is None:
        return labels.due(found.state)
    values = {"day": figures.day(found.due), "term": figures.term(found.due, today)}
    return Mark(labels.due(found.state).shape, said % values)


def interval_method(name: str) -> str:
    """A method of finding the interval between calibrations."""
    return gettext(_METHODS.get(name, name))


def event_label(event: EventView) -> str:
    """An event where there is room for a few letters only."""
    if event.kind in ("certificate", "stand"):
        return event.note
    if event.kind == "solver":
        return gettext("solver %(version)s") % {"version": event.note}
    word = gettext(EVENT_KINDS.get(event.kind, event.kind)).lower()
    word = f"{event.stand} {word}" if event.stand else word
    return f"{word} {event.note}" if event.note and len(event.note) <= _SHORT else word


def event(kind: str) -> str:
    """What happened."""
    return gettext(EVENT_KINDS.get(kind, kind))


def act(done: Act) -> str:
    """What a person did about the drift, in words."""
    said = gettext(_ACTS[done.kind])
    if not done.about:
        return said
    about = event(done.about) if done.kind.startswith("event") else alarm(done.about).word
    return f"{said} ({about})"


def source(name: str) -> str:
    """A source of scatter."""
    return gettext(_SOURCES.get(name, name))


def status(name: str) -> Mark:
    """Whether a parameter is in control."""
    mark = _STATUSES[name]
    return Mark(mark.shape, gettext(mark.word))


def estimator(name: str) -> str:
    """How a baseline's scatter was estimated."""
    return gettext(_ESTIMATORS.get(name, name))


def control_limits(name: str) -> str:
    """How a baseline's limits are meant."""
    return gettext(_LIMITS.get(name, name))


def model(name: str) -> str:
    """A course in a word."""
    return gettext(_MODELS.get(name, name))


def group(name: str) -> str:
    """What a history is grouped by."""
    return gettext(_GROUPS.get(name, name))


def names(parameters: Sequence[str]) -> Markup:
    """Symbols of several parameters; all eight in words."""
    if len(parameters) == len(labels.PARAMETER_NAMES):
        return escape(gettext("All parameters"))
    return Markup(", ").join(labels.symbol(name) for name in parameters)
