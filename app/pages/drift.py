"""One parameter of a gyro in depth: four control charts, what they found, the course and its tests, the scatter."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from typing import Any, Final, Literal

from fastapi import APIRouter, Request, Response
from fastapi.responses import HTMLResponse
from markupsafe import escape

from app import figures, plots
from app.errors import NotFound, problem
from app.i18n import gettext, marked
from app.pages import drift_labels, drift_panels, drift_tables, drift_words
from app.pages.alarms import may_judge
from app.pages.base import Reader, TheLab, render
from app.pages.drift_panels import Window
from app.pages.history import COLUMNS, Method, Wanted, bounds, choices, chosen, last_repair, value_row
from app.pages.tables import csv_answer, parquet_answer
from app.plots.theme import Spec
from app.services import gyros
from app.services.drift import alarms, baselines, events, grouping, previewing, reading
from app.services.drift.alarms import CAUSES
from app.services.drift.views import DriftPoint, GyroDrift, ParameterDrift
from solver.records import PARAMETERS

router = APIRouter()

_LARGE_PX: Final = 240
_STATISTIC_PX: Final = 120
_MOST_ROWS: Final = 50
_STATISTICS: Final = ("moving_range", "ewma", "cusum_above", "cusum_below")


@dataclass(frozen=True, slots=True)
class Statistic:
    """A chart of something computed from the values."""

    name: str
    title: str
    note: str
    spec: Spec


@router.get("/gyros/{serial}/drift/{parameter}.{form}")
def exported(
    person: Reader, lab: TheLab, serial: str, parameter: str, form: Literal["csv", "parquet"], wanted: Wanted
) -> Response:
    """The values with every statistic of the charts as a file."""
    with lab.read(person) as work:
        since, until = bounds(wanted, last_repair(events.of_gyro(work, serial)), datetime.now(UTC))
        found = reading.gyro_drift(
            work,
            serial,
            method=wanted.method,
            parameters=[parameter],
            since=since,
            until=until,
            by=wanted.by,
            most=None,
        )
    item = found.parameters[0]
    statistics = sorted({name for point in item.points for name in point.charts})
    rows = [
        value_row(found, item, point) | {name: point.charts.get(name) for name in statistics}
        for point in item.points
    ]
    answer = csv_answer if form == "csv" else parquet_answer
    return answer(rows, [*COLUMNS, *statistics], f"drift-{serial}-{parameter}")


@router.get("/gyros/{serial}/drift/{parameter}")
def page(
    request: Request, person: Reader, lab: TheLab, serial: str, parameter: str, wanted: Wanted
) -> Response:
    """One parameter of one gyro."""
    if parameter not in PARAMETERS:
        raise NotFound(problem("unknown-parameter", "There is no parameter “%(name)s”.", name=parameter))
    now = datetime.now(UTC)
    with lab.read(person) as work:
        gyro = gyros.gyro(work, serial)
        repaired = last_repair(events.of_gyro(work, serial))
        since, until = bounds(wanted, repaired, now)
        found = reading.gyro_drift(
            work, serial, method=wanted.method, parameters=[parameter], since=since, until=until, by=wanted.by,
            newest=_MOST_ROWS, statistics=_STATISTICS,
        )  # fmt: skip
        known = alarms.alarms(work, gyro=serial, method=found.method, state=None)
    item = found.parameters[0]
    window = drift_panels.window_of(found, since, until, now)
    return render(
        request, "drift/page.html", gyro=gyro, found=found, item=item, study=item.study or {}, period=chosen(wanted),
        periods=choices(repaired), method=found.method, by=wanted.by, groups=grouping.GROUPS, order=drift_panels.ORDER,
        individuals=drift_panels.chart(found, item, window, height=_LARGE_PX),
        statistics=list(_statistics(found, item, window)), standing=drift_panels.status(item, known, window),
        alarms=[alarm for alarm in known if alarm.parameter == parameter],
        bases=drift_tables.bases(replace(found, baselines=_own(found, parameter))), rows=item.newest[::-1],
        trend=next(iter(drift_tables.trends(found)), None), repeatability=drift_tables.repeatability(found),
        judges=may_judge(person), now=now, causes=CAUSES, drift=drift_labels, words=drift_words,
        measured=figures.measured, columns=_columns(item),
        broken=item.broken[::-1],
    )  # fmt: skip


@router.get("/gyros/{serial}/drift/{parameter}/false-alarms")
def false_alarms(
    person: Reader, lab: TheLab, serial: str, parameter: str, method: Method | None = None
) -> Response:
    """How often the charts of the baseline in force alarm for nothing; takes a second or two when it is new."""
    with lab.read(person) as work:
        lines = baselines.of_gyro(work, serial, method=reading.method_of(work, serial, method))
    mine = [line for line in lines if line.parameter == parameter]
    if not mine:
        return HTMLResponse("")
    return HTMLResponse(escape(drift_labels.chances(previewing.chances(mine[-1]))))


def _own(found: GyroDrift, parameter: str) -> tuple[Any, ...]:
    return tuple(line for line in found.baselines if line.parameter == parameter)


def _statistics(found: GyroDrift, item: ParameterDrift, window: Window) -> Iterator[Statistic]:
    """The charts beside the individuals', as far as a baseline makes them."""
    notes = {
        "moving_range": (gettext("Moving range"), gettext("how far each value lies from the one before")),
        "ewma": (gettext("EWMA"), gettext("exponentially weighted mean: finds small lasting shifts")),
    }  # fmt: skip
    for name, (title, note) in notes.items():
        points = _plotted(item, window, name, name)
        if points:
            stretches = drift_panels.stretches(
                item.parameter, item.statistics[name], found.baselines, window, name
            )
            yield Statistic(name, title, note, _spec(points, stretches, window, title, last=False))
    above, below = (_plotted(item, window, f"cusum_{side}", "cusum") for side in ("above", "below"))
    if above or below:
        shown = item.statistics["cusum_above"]
        lines = drift_panels.stretches(item.parameter, shown, found.baselines, window, "cusum")
        limits = [_both_sides(line) for line in lines]
        note = gettext("cumulative sums of the standardised values, up above zero, down below it")
        yield Statistic(
            "cusum", "CUSUM", note, _spec([*above, *_falling(below)], limits, window, "CUSUM", last=True)
        )


def _both_sides(line: plots.ControlStretch) -> plots.ControlStretch:
    """A decision interval holds for the sum below as for the one above."""
    steps = [(moment, None if high is None else -high, high) for moment, _, high in line.steps]
    return plots.ControlStretch(0.0, steps, line.until)


def _falling(points: Sequence[plots.DriftPoint]) -> list[plots.DriftPoint]:
    """The sum of what lies below the centre, drawn downwards and not joined to the other one."""
    return [replace(point, value=-point.value, part=-1 - point.part) for point in points]


def _spec(
    points: Sequence[plots.DriftPoint], stretches: Sequence[plots.ControlStretch], window: Window, title: str,
    *, last: bool,
) -> Spec:  # fmt: skip
    return plots.drift(
        points, drift_panels.marks(window, named=False), [], (window.begin, window.end), title,
        stretches=stretches, with_dates=last, height=_STATISTIC_PX,
    )  # fmt: skip


def _plotted(item: ParameterDrift, window: Window, column: str, chart: str) -> list[plots.DriftPoint]:
    return [
        plots.DriftPoint(
            point.at, point.charts[column] or 0.0, None, "beyond" if _is_outside(point, column, chart) else "within",
            _named(point, column, chart), "", drift_panels.href(point), window.part(point.at),
        )
        for point in item.statistics.get(column, ())
    ]  # fmt: skip


def _is_outside(point: DriftPoint, column: str, chart: str) -> bool:
    """Whether a statistic lies beyond the limits of its chart, also where that raises no alarm."""
    value, low, high = (point.charts.get(name) for name in (column, f"{chart}_low", f"{chart}_high"))
    return value is not None and ((high is not None and value > high) or (low is not None and value < low))


def _named(point: DriftPoint, column: str, chart: str) -> str:
    said = gettext("%(day)s, session %(session)d: %(value)s") % {
        "day": figures.day(point.at), "session": point.session,
        "value": figures.significant(point.charts[column], 3),
    }  # fmt: skip
    return f"{said}, {gettext('beyond the control limit')}" if _is_outside(point, column, chart) else said


@dataclass(frozen=True, slots=True)
class Column:
    """A chart's statistic in the table of values: in the parameter's unit, or a pure number."""

    name: str
    title: str
    decimals: int | None

    def shown(self, value: float | None, beside: figures.Measured) -> str:
        """The statistic with the digits of the value beside it, or its own."""
        places = len(beside.value.fraction) - 1 if self.decimals is None else self.decimals
        return str(figures.figure(value, max(0, places)))


def _columns(item: ParameterDrift) -> list[Column]:
    known = {name for point in item.newest for name, value in point.charts.items() if value is not None}
    return [
        Column(name, gettext(title), decimals)
        for name, title, decimals in (
            ("individuals", "z", 2), ("moving_range", marked("Moving range"), None), ("ewma", "EWMA", None),
            ("cusum_above", marked("CUSUM up"), 2), ("cusum_below", marked("CUSUM down"), 2),
        )
        if name in known
    ]  # fmt: skip
