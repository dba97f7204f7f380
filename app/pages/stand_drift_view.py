"""A stand's drift as its page shows it: charts of its attitude and of its gyros together, and the table behind."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from datetime import datetime, timedelta

from app import plots
from app.figures import Figure, day, decimals_of, figure, measured
from app.i18n import gettext
from app.pages import drift_labels, labels
from app.pages.stand_drift_words import AXES, entries
from app.services.drift.stand_reading import StandDrift, StandPoint
from app.services.views import COVERAGE_FACTOR


@dataclass(frozen=True, slots=True)
class Panel:
    """One axis of the base over time."""

    axis: str
    name: str
    spec: plots.theme.Spec
    latest: str
    u: str


@dataclass(frozen=True, slots=True)
class Row:
    """One point in the table: value and expanded uncertainty of each axis."""

    point: StandPoint
    cells: tuple[tuple[Figure, Figure], ...]


def panels(drift: StandDrift) -> Iterator[Panel]:
    """The base's azimuth and both levels."""
    window = _window(drift)
    for axis, (code, name) in AXES.items():
        points = [_point(drift, item, axis) for item in drift.points if item.values[axis] is not None]
        latest = next((item for item in reversed(drift.points) if item.values[axis] is not None), None)
        events = list(_events(drift, named=axis == "azimuth"))
        spec = plots.drift(
            points, events, [], window,
            gettext("%(name)s of stand %(stand)s in arcseconds, %(count)d points")
            % {"name": gettext(name), "stand": drift.stand, "count": len(points)},
            changes=list(_changes(drift, code)), with_dates=axis == "level_east",
        )  # fmt: skip
        shown = measured(latest.values[axis], _expanded(latest.u[axis])) if latest else None
        yield Panel(
            axis,
            gettext(name),
            spec,
            str(shown.value) if shown else "",
            str(shown.expanded or "") if shown else "",
        )


def _expanded(u: float | None) -> float | None:
    return None if u is None else COVERAGE_FACTOR * u


def _window(drift: StandDrift) -> tuple[datetime, datetime]:
    moments = [item.at for item in drift.points] + [item.until for item in drift.points]
    begin, end = min(moments), max(moments)
    spare = max(timedelta(days=2), (end - begin) * 0.02)
    return begin - spare, end + spare


def _point(drift: StandDrift, item: StandPoint, axis: str) -> plots.DriftPoint:
    value, u = item.values[axis], item.u[axis]
    name = gettext("%(what)s: %(value)s″") % {"what": named(item), "value": measured(value, _expanded(u))}
    return plots.DriftPoint(item.at, value or 0.0, _expanded(u), "within", name, "", href(drift, item))


def named(item: StandPoint) -> str:
    """Which sessions a point stands for, in words."""
    if item.sessions == 1:
        return gettext("%(day)s, gyro %(gyro)s, session %(session)d") % {
            "day": day(item.at), "gyro": item.gyro, "session": item.session,
        }  # fmt: skip
    return gettext("%(since)s to %(until)s, %(sessions)d sessions of %(gyros)d gyros") % {
        "since": day(item.at), "until": day(item.until), "sessions": item.sessions, "gyros": item.gyros,
    }  # fmt: skip


def href(drift: StandDrift, item: StandPoint) -> str:
    """A session's result; of several the page of their days."""
    if item.sessions == 1:
        return f"/results/{item.calibration}"
    return f"/stands/{drift.stand}/drift?since={item.at:%Y-%m-%d}&until={item.until:%Y-%m-%d}"


def _events(drift: StandDrift, *, named: bool) -> Iterator[plots.DriftEvent]:
    begin, end = _window(drift)
    certificates = (drift.document or {}).get("certificates", [])
    for item in certificates[1:]:
        at = datetime.fromisoformat(item["at"])
        if begin <= at <= end:
            yield plots.DriftEvent(at, item["certificate"] if named else "")
    for event in drift.events:
        if begin <= event.at <= end:
            yield plots.DriftEvent(event.at, drift_labels.event_label(event) if named else "", solid=True)


def _changes(drift: StandDrift, direction: str) -> Iterator[plots.DriftChange]:
    for item in entries(drift):
        if item["direction"] == direction and item["verdict"] in ("stand", "unclear"):
            since, until = (datetime.fromisoformat(item[name]) for name in ("since", "until"))
            yield plots.DriftChange(since, until, f"{figure(item['size_arcsec'], 0, sign=True)}″")


def common(drift: StandDrift, parameter: str) -> plots.theme.Spec:
    """All gyros together, about one parameter."""
    known = [item for item in drift.together if item.common[parameter] is not None]
    means = [
        plots.CommonPoint(
            item.at, item.common[parameter] or 0.0, item.limits[parameter] or 0.0,
            abs(item.common[parameter] or 0.0) > (item.limits[parameter] or 0.0),
            gettext("%(what)s: %(value)s")
            % {"what": named(item), "value": figure(item.common[parameter], 2, sign=True)},
            href(drift, item),
        )
        for item in known
    ]  # fmt: skip
    described = gettext("Common mode of %(parameter)s on stand %(stand)s, %(count)d points") % {
        "parameter": labels.parameter(parameter), "stand": drift.stand, "count": len(means),
    }  # fmt: skip
    return plots.common_mode(means, [], list(_events(drift, named=True)), _window(drift), described)


def rows(drift: StandDrift) -> list[Row]:
    """The table behind the charts, the newest first."""
    places = {axis: _places([item.u[axis] for item in drift.points]) for axis in AXES}
    return [
        Row(
            item,
            tuple(
                (figure(item.values[axis], places[axis]), figure(_expanded(item.u[axis]), places[axis]))
                for axis in AXES
            ),
        )
        for item in reversed(drift.points)
    ]  # fmt: skip


def _places(values: Sequence[float | None]) -> int:
    known = [decimals for u in values if (decimals := decimals_of(_expanded(u))) is not None]
    return min(2, max(0, max(known, default=0)))
