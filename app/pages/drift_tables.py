"""Rows of a gyro's drift: results by session, trends, repeatability, what the limits stand on."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from typing import Any, Final

from app import figures
from app.figures import Figure
from app.i18n import gettext, ngettext
from app.pages import drift_labels, drift_words
from app.pages.drift_panels import ORDER, explained
from app.pages.labels import Mark
from app.services.drift.views import BaselineView, DriftPoint, GyroDrift, ParameterDrift

SOURCES: Final = (
    "within-position",
    "between-positions",
    "between-sessions",
    "between-starts",
    "between-days",
)
_DISTINGUISHED: Final = (*SOURCES, "fixed")
Entry = Mapping[str, Any]
_LEVEL: Final = 0.05


def by_session(
    parameters: Sequence[ParameterDrift], most: int
) -> list[tuple[DriftPoint, dict[str, DriftPoint]]]:
    """Of each result every parameter's point, the newest first, at most so many."""
    found: dict[int, dict[str, DriftPoint]] = {}
    for item in parameters:
        for point in item.points:
            found.setdefault(point.calibration, {})[item.parameter] = point
    rows = [(next(iter(values.values())), values) for values in found.values()]
    return sorted(rows, key=lambda row: row[0].at, reverse=True)[:most]


@dataclass(frozen=True, slots=True)
class Step:
    """A step in words, and the first result after it; `explained`: an event is the reason."""

    size: str
    day: str
    calibration: int
    explained: bool


@dataclass(frozen=True, slots=True)
class Trend:
    """Course, steps and forecast of a parameter, in words; `leaves`: it is to leave its limits.

    `largest` is the largest step that no event explains, where that is not the last step.
    """

    parameter: str
    course: str
    step: Step | None
    largest: Step | None
    forecast: str
    leaves: bool
    outside: bool


def trends(found: GyroDrift) -> list[Trend]:
    """One row for each parameter that was studied."""
    beyond = {alarm.parameter: alarm.at for alarm in found.alarms
              if alarm.kind == "out-of-limits" and alarm.state in ("open", "acknowledged")}  # fmt: skip
    return [
        _trend(item, item.study, beyond.get(item.parameter))
        for item in found.parameters if item.study and item.study.get("trend")
    ]  # fmt: skip


def _trend(item: ParameterDrift, study: Entry, since: datetime | None) -> Trend:
    steps = [
        change for change in study.get("changes", ()) if change["kind"] == "step" and _is_significant(change)
    ]
    last = steps[-1] if steps else None
    unexplained = [change for change in steps if not explained(change)]
    largest = max(unexplained, key=lambda change: abs(change["size"]), default=None)
    ahead = study.get("forecast")
    outside = (study.get("latest") or {}).get("verdict") == "fails"
    return Trend(
        parameter=item.parameter,
        course=drift_words.course(study["trend"], item.unit),
        step=_step(last, item.unit) if last else None,
        largest=_step(largest, item.unit) if largest and largest is not last else None,
        forecast=drift_words.outside(since)
        if outside
        else drift_words.forecast(ahead, item.unit, limited=not item.low is item.high is None),
        leaves=not outside and bool(ahead and ahead.get("leaves")),
        outside=outside,
    )


def _step(change: Entry, unit: str) -> Step:
    return Step(
        drift_words.change(change, unit),
        drift_words.day(change["at"]),
        change["calibration"],
        explained(change),
    )


def _is_significant(change: Entry) -> bool:
    """A repair lets the level change; it need not have."""
    return change["p_value"] is not None and change["p_value"] < _LEVEL


@dataclass(frozen=True, slots=True)
class Share:
    """Scatter of one source: standard deviation, its interval, p of the F-test."""

    source: str
    sd: Figure
    interval: str
    p: float | None


@dataclass(frozen=True, slots=True)
class Scatter:
    """Scatter of one parameter by source; `places` are the decimals of the row."""

    parameter: str
    unit: str
    cells: tuple[Share | None, ...]
    together: Figure
    limit: str
    limited: bool
    verdict: Mark
    places: int


@dataclass(frozen=True, slots=True)
class Repeatability:
    """The table of all parameters, and what of it cannot be told apart."""

    sources: tuple[str, ...]
    rows: tuple[Scatter, ...]
    confounded: str


def repeatability(found: GyroDrift) -> Repeatability:
    """Scatter by source, as far as the sessions tell it."""
    studied = [item for item in found.parameters if item.study and item.study.get("components")]
    parts = [part for item in studied for part in (item.study or {})["components"]]
    known = {part["source"] for part in parts if part["sd"] is not None}
    sources = tuple(source for source in SOURCES if source in known)
    rows = tuple(_scatter(item, item.study or {}, sources) for item in studied)
    return Repeatability(sources, rows, _confounded(studied))


def _scatter(item: ParameterDrift, study: Entry, sources: Sequence[str]) -> Scatter:
    parts = {part["source"]: part for part in study["components"]}
    together = (study.get("together") or {}).get("sd")
    places = figures.decimals_of(together) or 4
    limit = study.get("repeatability_limit")
    return Scatter(
        item.parameter, item.unit, tuple(_share(parts.get(source), places) for source in sources),
        figures.figure(together, places), figures.DASH if limit is None else figures.plain(limit),
        limit is not None, _judged(study.get("repeatability_verdict")), places,
    )  # fmt: skip


def _share(part: Entry | None, places: int) -> Share | None:
    if part is None or part.get("sd") is None:
        return None
    ends = [figures.figure(part.get(name), places) for name in ("low", "high")]
    known = part.get("low") is not None and part.get("high") is not None and ends[0] != ends[1]
    interval = f"{ends[0]}–{ends[1]}" if known else ""
    return Share(part["source"], figures.figure(part["sd"], places), interval, part.get("p_value"))


_VERDICTS: Final = {
    "conforms": "ok",
    "within": "ok",
    "fails": "out",
    "beyond": "out",
    "conditional": "attention",
}


def _judged(verdict: str | None) -> Mark:
    shape = _VERDICTS.get(verdict or "", "todo")
    words = {"ok": gettext("Within"), "out": gettext("Beyond"), "attention": gettext("Conditional"),
             "todo": gettext("No limit")}  # fmt: skip
    return Mark(shape, words[shape])


def _confounded(studied: Sequence[ParameterDrift]) -> str:
    """Sources that these sessions cannot tell apart, named once for all parameters."""
    groups: dict[tuple[str, ...], None] = {}
    for item in studied:
        for part in (item.study or {})["components"]:
            if part.get("confounded_with"):
                together = (part["source"], *part["confounded_with"])
                groups[tuple(sorted(together, key=_DISTINGUISHED.index))] = None
    said = (" + ".join(drift_labels.source(name).lower() for name in group) for group in groups)
    text = "; ".join(said)
    return gettext("These sessions cannot tell apart: %(sources)s.") % {"sources": text} if text else ""


@dataclass(frozen=True, slots=True)
class Basis:
    """What the limits of some parameters stand on."""

    parameters: list[str]
    text: str


def bases(found: GyroDrift) -> list[Basis]:
    """One sentence for all parameters whose baselines were frozen together."""
    groups: dict[str, list[str]] = {}
    for line in found.baselines:
        names = groups.setdefault(_basis(line), [])
        if line.parameter not in names:
            names.append(line.parameter)
    return [Basis(sorted(names, key=ORDER.index), text) for text, names in groups.items()]


def _basis(line: BaselineView) -> str:
    count = len(line.calibrations)
    values = {
        "sessions": ngettext("%(num)d session", "%(num)d sessions", count) % {"num": count},
        "since": figures.day(line.valid_from), "estimator": drift_labels.estimator(line.estimator),
        "limits": drift_labels.control_limits(line.limits), "day": figures.day(line.frozen_at),
        "name": line.frozen_by,
    }  # fmt: skip
    text = gettext("individuals chart from %(since)s, %(sessions)s, %(estimator)s, %(limits)s, frozen on "
                   "%(day)s by %(name)s.") % values  # fmt: skip
    return f"{text} {line.reason}".strip()
