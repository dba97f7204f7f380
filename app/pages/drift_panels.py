"""Drift charts of a gyro: what `reading.gyro_drift` found, as panels that share their dates and events."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime, timedelta
from itertools import pairwise
from typing import Any, Final, Literal

from app import figures, plots
from app.i18n import gettext, ngettext
from app.pages import drift_labels, drift_words, labels
from app.pages.labels import Mark
from app.plots.theme import Spec
from app.services.drift.views import AlarmView, BaselineView, DriftPoint, EventView, GyroDrift, ParameterDrift

ORDER: Final = ("w0x", "w0y", "wg", "wk", "kx", "ky", "kxy", "kyx")
"""Parameters as the pages show them."""
SOLID: Final = ("repair", "adjustment")
"""Events after which the gyro is another one: nothing is drawn across them."""
_AHEAD: Final = 0.3
"""How much of a panel's period is added for what is to come."""
_LABEL_PX, _LETTER_PX, _PLOT_PX = 10.0, 6.3, 500.0
_STATES: Final[dict[str, Literal["beyond", "conditional"]]] = {
    "fails": "beyond",
    "conditional": "conditional",
}


@dataclass(frozen=True, slots=True)
class Window:
    """The dates that all panels of a page share, and what happened in them."""

    begin: datetime
    end: datetime
    now: datetime
    events: tuple[EventView, ...]

    @property
    def breaks(self) -> tuple[datetime, ...]:
        """Moments of repairs and adjustments."""
        return tuple(event.at for event in self.events if event.kind in SOLID)

    def part(self, moment: datetime) -> int:
        """How many of them lie before a moment."""
        return sum(item <= moment for item in self.breaks)


@dataclass(frozen=True, slots=True)
class Panel:
    """One parameter: its points, its chart, its state in words, and the last value of its whole life."""

    drift: ParameterDrift
    spec: Spec
    status: Mark
    latest: DriftPoint | None


def window_of(found: GyroDrift, since: datetime | None, until: datetime | None, now: datetime) -> Window:
    """The dates to show: the period asked for, or all there is; and ahead as far as a forecast is worth it."""
    moments = [
        moment for item in found.parameters for point in item.points for moment in (point.at, point.until)
    ]
    begin = since or min(moments, default=now)
    last = until or max([now, *moments])
    spare = max(timedelta(days=1), (last - begin) * 0.02)
    ahead = (last - begin) * _AHEAD if until is None and _is_forecast(found) else timedelta()
    begin, end = begin - spare, last + max(spare, ahead)
    return Window(begin, end, now, tuple(item for item in found.events if begin <= item.at <= end))


def _is_forecast(found: GyroDrift) -> bool:
    return any((item.study or {}).get("forecast") for item in found.parameters)


def panels(found: GyroDrift, window: Window) -> Iterator[Panel]:
    """A panel for each parameter; events and today are named once, above the first."""
    for item in found.parameters:
        first, last = item is found.parameters[0], item is found.parameters[-1]
        spec = chart(found, item, window, named=first, with_dates=last)
        yield Panel(item, spec, status(item, found.alarms, window), item.points[-1] if item.points else None)


def chart(
    found: GyroDrift, item: ParameterDrift, window: Window, *, named: bool = True, with_dates: bool = True,
    height: int | None = None,
) -> Spec:  # fmt: skip
    """The individuals chart of one parameter."""
    study = item.study or {}
    return plots.drift(
        [plotted(item, point, window) for point in item.points if point.value is not None],
        marks(window, named=named),
        list(_limits(item)),
        (window.begin, window.end),
        _description(found, item),
        stretches=stretches(item.parameter, item.points, found.baselines, window, "individuals"),
        changes=_steps(study, item, window),
        forecast=_forecast(study, window),
        today=_today(window, named=named),
        with_dates=with_dates,
        height=height,
    )


def _description(found: GyroDrift, item: ParameterDrift) -> str:
    values = {
        "parameter": labels.parameter(item.parameter), "gyro": found.gyro,
        "points": ngettext("%(num)d value", "%(num)d values", len(item.points)) % {"num": len(item.points)},
    }  # fmt: skip
    return gettext("%(parameter)s of gyro %(gyro)s over time, %(points)s with expanded uncertainty") % values


def plotted(item: ParameterDrift, point: DriftPoint, window: Window) -> plots.DriftPoint:
    """A point as the chart has it: its state, its name, and what it opens."""
    beyond = drift_labels.is_beyond(point.signals)
    state: Literal["within", "conditional", "beyond"] = (
        "beyond" if beyond else _STATES.get(point.verdict, "within")
    )
    return plots.DriftPoint(
        point.at, point.value or 0.0, point.expanded, state, _name(item, point, beyond=beyond), "",
        href(point), window.part(point.at),
    )  # fmt: skip


def href(point: DriftPoint) -> str:
    """What a point opens: its result, or the sessions that it stands for."""
    if point.sessions == 1:
        return f"/results/{point.calibration}"
    return f"?from={point.at:%Y-%m-%d}&until={point.until:%Y-%m-%d}&by=session"


def _name(item: ParameterDrift, point: DriftPoint, *, beyond: bool) -> str:
    values = {
        "day": figures.day(point.at), "until": figures.day(point.until), "session": point.session,
        "value": figures.measured(point.value, point.expanded), "unit": labels.unit(item.unit),
        "sessions": ngettext("%(num)d session", "%(num)d sessions", point.sessions) % {"num": point.sessions},
    }  # fmt: skip
    if point.sessions > 1:
        return gettext("%(day)s to %(until)s, mean of %(sessions)s: %(value)s %(unit)s") % values
    said = [gettext("%(day)s, session %(session)d: %(value)s %(unit)s") % values]
    if beyond:
        said.append(gettext("beyond the control limit"))
    if point.verdict == "fails":
        said.append(gettext("beyond the type’s limit"))
    if point.revisions > 1:
        said.append(gettext("revision %(n)d") % {"n": point.revisions})
    return ", ".join(said)


def _limits(item: ParameterDrift) -> Iterator[plots.DriftLimit]:
    if item.low is not None:
        yield plots.DriftLimit(
            item.low, "below", gettext("limit %(value)s") % {"value": figures.plain(item.low)}
        )
    if item.high is not None:
        yield plots.DriftLimit(
            item.high, "above", gettext("limit %(value)s") % {"value": figures.plain(item.high)}
        )


def marks(window: Window, *, named: bool) -> list[plots.DriftEvent]:
    """The events as rules; those names are written that do not run into each other, repairs first."""
    written = _written(window) if named else {}
    return [plots.DriftEvent(item.at, written.get(item, ""), item.kind in SOLID) for item in window.events]


def _written(window: Window) -> Mapping[EventView, str]:
    length = (window.end - window.begin) / timedelta(days=1)
    taken = [_span(window.now, gettext("today"), window, length)] if window.now < window.end else []
    written = {}
    for item in sorted(window.events, key=lambda event: event.kind not in SOLID):
        text = drift_labels.event_label(item)
        span = _span(item.at, text, window, length)
        if all(span[1] < other[0] or other[1] < span[0] for other in taken) and span[1] < _PLOT_PX:
            taken.append(span)
            written[item] = text
    return written


def _span(at: datetime, text: str, window: Window, length_days: float) -> tuple[float, float]:
    left = (at - window.begin) / timedelta(days=1) / length_days * _PLOT_PX
    return left, left + _LABEL_PX + _LETTER_PX * len(text)


def stretches(
    parameter: str, points: Sequence[DriftPoint], baselines: Sequence[BaselineView], window: Window, name: str
) -> list[plots.ControlStretch]:
    """Limits of a chart, one stretch for each baseline and not across a repair."""
    known = sorted(
        (line for line in baselines if line.parameter == parameter), key=lambda line: line.valid_from
    )
    borders = sorted({*(line.valid_from for line in known), *window.breaks})
    edges = [window.begin, *(border for border in borders if window.begin < border < window.end), window.end]
    made = []
    for begin, end in pairwise(edges):
        inside = [point for point in points if begin <= point.at < end and _drawn(point, name)]
        if inside:
            # A mean has limits over what was measured; the last baseline's go on, for what comes is judged by it.
            made.append(_stretch(inside, name, begin, end))
    return made


def _drawn(point: DriftPoint, name: str) -> bool:
    return point.charts.get(f"{name}_high") is not None


def _stretch(points: Sequence[DriftPoint], name: str, begin: datetime, end: datetime) -> plots.ControlStretch:
    moments = [begin, *(one.at + (other.at - one.at) / 2 for one, other in pairwise(points))]
    steps: list[tuple[datetime, float | None, float | None]] = []
    for moment, point in zip(moments, points, strict=True):
        limits = (point.charts.get(f"{name}_low"), point.charts.get(f"{name}_high"))
        if not steps or steps[-1][1:] != limits:
            steps.append((moment, *limits))
    return plots.ControlStretch(points[-1].charts.get(f"{name}_centre") or 0.0, steps, end)


def _steps(study: Mapping[str, Any], item: ParameterDrift, window: Window) -> list[plots.DriftChange]:
    """Steps that no event explains, each between two sessions; the surer one is named where names would collide."""
    length = (window.end - window.begin) / timedelta(days=1)
    found = [
        change
        for change in study.get("changes", ())
        if change["kind"] == "step" and not explained(change)
    ]  # fmt: skip
    made: list[plots.DriftChange] = []
    taken: list[tuple[float, float]] = []
    for change in sorted(found, key=lambda change: change["p_value"] or 0.0):
        before, at = datetime.fromisoformat(change["before"]), datetime.fromisoformat(change["at"])
        if not window.begin <= at <= window.end:
            continue
        begin, text = max(before, window.begin), drift_words.size(change)
        span = _span(begin, text, window, length)
        free = all(span[1] < other[0] or other[1] < span[0] for other in taken)
        taken += [span] if free else []
        made.append(plots.DriftChange(begin, at, text if free else ""))
    return made


def explained(change: Mapping[str, Any]) -> bool:
    """Whether an event lies where the change may have happened."""
    return bool(change.get("event") or change.get("event_kind"))


def _forecast(study: Mapping[str, Any], window: Window) -> plots.Forecast | None:
    """As far as the panel goes, and the first moment beyond it."""
    found = study.get("forecast")
    if not found or not found["low"]:
        return None
    moments = [datetime.fromisoformat(text) for text in found["at"]]
    shown = sum(moment < window.end for moment in moments) + 1
    return plots.Forecast(moments[:shown], *(found[name][:shown] for name in ("value", "low", "high")))


def _today(window: Window, *, named: bool) -> plots.DriftEvent | None:
    if not window.begin < window.now < window.end:
        return None
    return plots.DriftEvent(window.now, gettext("today") if named else "")


def status(item: ParameterDrift, alarms: Sequence[AlarmView], window: Window) -> Mark:
    """How a parameter is, in a few words: the worst first."""
    study = item.study or {}
    kinds = {alarm.kind for alarm in alarms if alarm.parameter == item.parameter and alarm.state == "open"}
    said = [
        word
        for kind, word in (
            ("out-of-limits", Mark("out", gettext("out of limits"))),
            ("step", Mark("out", gettext("stepped"))),
            ("trend", Mark("attention", gettext("drifting"))),
        )
        if kind in kinds
    ]
    state = drift_labels.status(study.get("status", "no-baseline"))
    if state.shape == "ok" and window.breaks and not said:
        return Mark("ok", gettext("in control since the repair"))
    if state.shape != "todo" or not said:
        said.insert(0, state)
    shape = next(
        (shape for shape in ("out", "attention", "ok") if shape in {mark.shape for mark in said}), "todo"
    )
    return Mark(shape, ", ".join(mark.word for mark in said))
