"""A gyro's history: every parameter over time with its uncertainty, limits and changes of certificate."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from itertools import pairwise
from typing import Final, Literal

from fastapi import APIRouter, Request, Response

from app import plots
from app.figures import day, measured, plain
from app.i18n import gettext
from app.pages import labels
from app.pages.base import Reader, TheLab, render
from app.pages.result_view import limit_text
from app.pages.tables import Row, csv_answer, json_answer
from app.services import gyros, history, session_index
from app.services.views import HistoryPoint, HistorySeries

router = APIRouter()

PERIODS: Final = {"quarter": 92, "half": 183, "year": 366, "all": None}
"""Choices of the period, in days back from today."""
Period = Literal["quarter", "half", "year", "all"]
Method = Literal["least-squares", "paper"]

_ORDER: Final = ("w0x", "w0y", "wg", "wk", "kx", "ky", "kxy", "kyx")
_STATES: Final[dict[str, Literal["within", "conditional", "beyond"]]] = {
    "fails": "beyond",
    "conditional": "conditional",
}


@dataclass(frozen=True, slots=True)
class Panel:
    """One parameter: its series, its chart, and the latest value."""

    series: HistorySeries
    spec: plots.theme.Spec
    latest: HistoryPoint | None
    limit: str


@router.get("/gyros/{serial}")
def page(
    request: Request, person: Reader, lab: TheLab, serial: str, period: Period = "year",
    method: Method = "least-squares",
) -> Response:  # fmt: skip
    """The drift of one gyro."""
    now = datetime.now(UTC)
    with lab.read(person) as work:
        gyro = gyros.gyro(work, serial)
        found = history.history(work, serial, since=_since(period, now), method=method)
        index = session_index.find(work, gyro=serial, limit=12)
    series = sorted(found, key=lambda item: _ORDER.index(item.parameter))
    return render(
        request, "history/page.html", gyro=gyro, period=period, periods=PERIODS, method=method,
        panels=list(_panels(series, period, now)), index=index, rows=list(_by_session(series)),
        order=_ORDER, events=_events(series), measured=measured,
    )  # fmt: skip


@router.get("/gyros/{serial}/history.{form}")
def exported(
    person: Reader, lab: TheLab, serial: str, form: Literal["csv", "json"], period: Period = "all",
    method: Method = "least-squares",
) -> Response:  # fmt: skip
    """The same values as a file: one row for each parameter of each session."""
    with lab.read(person) as work:
        found = history.history(work, serial, since=_since(period, datetime.now(UTC)), method=method)
    rows = [_row(serial, series, point) for series in found for point in series.points]
    if form == "json":
        return json_answer(rows)
    return csv_answer(rows, _COLUMNS, f"history-{serial}")


def _since(period: Period, now: datetime) -> datetime | None:
    days = PERIODS[period]
    return None if days is None else now - timedelta(days=days)


def _panels(series: Sequence[HistorySeries], period: Period, now: datetime) -> Iterator[Panel]:
    moments = [point.measured_at for item in series for point in item.points]
    begin = _since(period, now) or min(moments, default=now)
    spare = max(timedelta(days=1), (now - begin) * 0.02)
    window = (begin - spare, max([now, *moments]) + spare)
    events = [
        plots.DriftEvent(moment, label)
        for moment, label in _events(series)
        if window[0] <= moment <= window[1]
    ]
    for item in series:
        latest = item.points[-1] if item.points else None
        # Events are named once, above the first panel; their line goes through all.
        named = events if item is series[0] else [plots.DriftEvent(event.moment, "") for event in events]
        spec = plots.drift(
            [_point(item, point) for point in item.points if point.value is not None],
            named,
            list(_limits(item)),
            window,
            gettext("%(parameter)s by session, %(count)d values, with expanded uncertainty")
            % {"parameter": labels.parameter(item.parameter), "count": len(item.points)},
            with_dates=item is series[-1],
        )
        yield Panel(item, spec, latest, limit_text(item.low, item.high))


def _limits(item: HistorySeries) -> Iterator[plots.DriftLimit]:
    for value, side in ((item.low, "below"), (item.high, "above")):
        if value is not None:
            text = gettext("limit %(value)s") % {"value": plain(value)}
            yield plots.DriftLimit(value, "below" if side == "below" else "above", text)


def _point(item: HistorySeries, point: HistoryPoint) -> plots.DriftPoint:
    name = gettext("%(day)s, session %(session)d: %(value)s %(unit)s") % {
        "day": day(point.measured_at), "session": point.session, "value": measured(point.value, point.expanded),
        "unit": labels.unit(item.unit),
    }  # fmt: skip
    state = _STATES.get(point.verdict, "within")
    return plots.DriftPoint(
        point.measured_at,
        point.value or 0.0,
        point.expanded,
        state,
        name,
        "",
        f"/results/{point.calibration}",
    )


def _events(series: Sequence[HistorySeries]) -> list[tuple[datetime, str]]:
    """When a session first used another certificate than the session before: (moment, its number)."""
    points = max((item.points for item in series), key=len, default=())
    found = []
    for before, now in pairwise(points):
        if (before.stand, before.certificate) != (now.stand, now.certificate):
            between = before.measured_at + (now.measured_at - before.measured_at) / 2
            found.append(
                (between, now.certificate if before.stand == now.stand else f"{now.stand} {now.certificate}")
            )
    return found


def _by_session(series: Sequence[HistorySeries]) -> Iterator[tuple[HistoryPoint, dict[str, HistoryPoint]]]:
    """The table behind the charts: of each result every parameter's point, the newest first."""
    found: dict[int, dict[str, HistoryPoint]] = {}
    for item in series:
        for point in item.points:
            found.setdefault(point.calibration, {})[item.parameter] = point
    rows = [(next(iter(values.values())), values) for values in found.values()]
    yield from sorted(rows, key=lambda row: row[0].measured_at, reverse=True)


_COLUMNS: Final = (
    "gyro", "measured_at", "session", "start", "stand", "certificate", "result", "parameter", "value",
    "standard_uncertainty", "expanded_uncertainty", "coverage_factor", "unit", "low", "high", "verdict",
)  # fmt: skip


def _row(serial: str, series: HistorySeries, point: HistoryPoint) -> Row:
    return {
        "gyro": serial, "measured_at": point.measured_at.astimezone(UTC), "session": point.session,
        "start": point.start, "stand": point.stand, "certificate": point.certificate,
        "result": point.calibration, "parameter": series.parameter, "value": point.value,
        "standard_uncertainty": point.u,
        "expanded_uncertainty": point.expanded,
        "coverage_factor": point.k, "unit": series.unit, "low": series.low, "high": series.high,
        "verdict": point.verdict,
    }  # fmt: skip
