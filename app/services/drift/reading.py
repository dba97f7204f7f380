"""What a page or a call asks of a gyro's drift: a period, a grouping, some parameters; from the stored study alone."""

import json
from collections.abc import Iterator, Sequence
from datetime import UTC, datetime
from itertools import repeat
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from app.errors import Invalid, problem
from app.exchange.json_values import Json
from app.exchange.si import PARAMETER_UNITS
from app.services.drift import alarms, baselines, events, grouping, series, type_intervals
from app.services.drift.charting import CHARTS
from app.services.drift.methods import METHODS, main_method
from app.services.drift.series import SeriesTable, aware
from app.services.drift.views import (
    DriftPoint,
    EventView,
    GyroDrift,
    ParameterDrift,
    ReplacedValue,
)
from app.services.job_views import job_view
from app.services.lab import Work
from app.services.lookup import find_gyro
from app.services.verdicts import judge
from app.services.views import COVERAGE_FACTOR
from app.store import drift, drift_series, results
from app.store.tables import DriftStudy, Gyro
from solver.records import PARAMETERS

MOST_POINTS: Final = 120
"""Of one chart: as many as its width shows apart."""
_HEADS: Final = ("calibration", "session", "start", "stand", "certificate", "revisions")


def gyro_drift(
    work: Work,
    serial: str,
    *,
    method: str | None = None,
    parameters: Sequence[str] = PARAMETERS,
    since: datetime | None = None,
    until: datetime | None = None,
    by: str = "session",
    most: int | None = MOST_POINTS,
    newest: int = 0,
    statistics: Sequence[str] = (),
) -> GyroDrift:
    """A gyro's drift by one method: what was found, and the points of a period.

    Parameters
    ----------
    method
        None for the one that stands for the gyro (`main_method`).
    parameters
        Which, and in which order.
    since, until
        Of the period, both included; None for the beginning and the end.
    by
        What a point stands for: session, start, day, month or year.
    most
        Points of each parameter at the most, and of those that broke a rule as many again; None for all.
    newest
        Of how many of the newest sessions, and of the newest that broke a rule, every value is wanted as well.
    statistics
        Columns of the charts (`charting.CHARTS`) of which as few points are wanted as well.

    Raises
    ------
    NotFound
        An unknown gyro.
    Invalid
        An unknown parameter, method or grouping.
    """
    _check(method, parameters, by)
    gyro = find_gyro(work, serial)
    studies = drift.studies(work.db, gyro.id, None)
    methods = sorted((item.method for item in studies), key=METHODS.index)
    method = method or main_method(methods)
    row = next((item for item in studies if item.method == method), None)
    made = row is not None and row.document is not None
    table = series.decode(row.series) if row is not None and row.series is not None else None
    document = json.loads(row.document) if row is not None and row.document is not None else None
    if document is not None:
        document = type_intervals.document_by_type(work, gyro.type, method, document)
    shown = None if table is None else table.between(since, until)
    found = [] if shown is None else [*events.derived(shown, serial)]
    found += [
        item
        for item in events.of_gyro(work, serial)
        if (since is None or item.at >= since) and (until is None or item.at <= until)
    ]
    return GyroDrift(
        gyro=serial, type=gyro.type.name, method=method, methods=tuple(methods),
        by=by, up_to_date=row is None or row.studied >= row.changed,
        studied_at=row.studied_at if row else None, solver_version=row.solver_version if row else None,
        job=_job(work, row), sessions=0 if table is None else len(table),
        since=None if not made or table is None or not len(table) else aware(table["measured_at"][0]),
        until=None if not made or table is None or not len(table) else aware(table["measured_at"][-1]),
        document=document,
        parameters=tuple(
            _parameter(gyro, name, shown, document, by, most, newest, statistics) for name in parameters
        ),
        events=tuple(sorted(found, key=lambda item: item.at)),
        baselines=baselines.of_gyro(work, serial, method=method),
        alarms=alarms.alarms(work, gyro=serial, method=method),
    )  # fmt: skip


def all_events(work: Work, serial: str, *, withdrawn: bool = False) -> tuple[EventView, ...]:
    """What people entered for a gyro and its stands, and what its sessions by every method tell."""
    gyro = find_gyro(work, serial)
    entered = events.of_gyro(work, serial, withdrawn=withdrawn)
    told: dict[tuple[str, int | None], EventView] = {}
    for row in drift.studies(work.db, gyro.id, None, whole=True):
        if row.series is not None:
            told |= {
                (item.kind, item.session): item for item in events.derived(series.decode(row.series), serial)
            }
    return tuple(sorted([*entered, *told.values()], key=lambda item: item.at))


def method_of(work: Work, serial: str, method: str | None) -> str:
    """The method that was asked for, or the one that stands for the gyro."""
    _check(method, (), "session")
    studies = drift.studies(work.db, find_gyro(work, serial).id, None)
    return method or main_method([item.method for item in studies])


def components(work: Work, serial: str, *, method: str | None = None) -> tuple[Json, ...]:
    """How much each parameter of a gyro scatters, by source: rows of the study's document with parameter and unit."""
    method = method_of(work, serial, method)
    row = drift.study(work.db, find_gyro(work, serial).id, None, method)
    document = (
        json.loads(row.document) if row is not None and row.document is not None else {"parameters": {}}
    )
    return tuple(
        {"parameter": name, "unit": entry["unit"], **line}
        for name, entry in document["parameters"].items()
        for line in (*entry["components"], *([entry["together"]] if entry["together"] else []))
    )


def replaced(work: Work, serial: str, *, method: str | None = None) -> tuple[ReplacedValue, ...]:
    """Results of a gyro by a method that count no more, with the one that counts in their place, if any."""
    method = method_of(work, serial, method)
    gyro = find_gyro(work, serial)
    rows = drift_series.result_rows(work.db, gyro.id)
    values = [item for item in drift_series.value_rows(work.db, gyro.id) if item.method == method]
    solved = {item.calibration for item in values}
    counting = {row.session: row.calibration for row in series.counting(rows, dict.fromkeys(solved))}
    gone = {
        row.calibration: row
        for row in rows
        if row.calibration in solved and counting.get(row.session) != row.calibration
    }
    return tuple(
        ReplacedValue(
            row.session, row.measured_at, row.calibration, row.revision, counting.get(row.session),
            item.parameter, item.value, item.u, item.k or COVERAGE_FACTOR,
        )
        for item in values
        if (row := gone.get(item.calibration)) is not None
    )  # fmt: skip


def _check(method: str | None, parameters: Sequence[str], by: str) -> None:
    if method is not None and method not in METHODS:
        raise Invalid(problem("unknown-method", "There is no method “%(method)s”. Choose one of %(methods)s.",
                              column="method", method=method, methods=", ".join(METHODS)))  # fmt: skip
    for name in parameters:
        if name not in PARAMETERS:
            raise Invalid(problem("unknown-parameter",
                                  "There is no parameter “%(name)s”; choose among %(names)s.",
                                  column="parameter", name=name, names=", ".join(PARAMETERS)))  # fmt: skip
    if by not in grouping.GROUPS:
        raise Invalid(problem("unknown-grouping", "There is no grouping “%(name)s”; choose among %(names)s.",
                              column="by", name=by, names=", ".join(grouping.GROUPS)))  # fmt: skip


def _job(work: Work, row: DriftStudy | None) -> Any:
    job = None if row is None or row.job_id is None else results.job(work.db, row.job_id)
    return None if job is None else job_view(job)


def _parameter(
    gyro: Gyro,
    name: str,
    table: SeriesTable | None,
    document: dict[str, Any] | None,
    by: str,
    most: int | None,
    newest: int,
    statistics: Sequence[str],
) -> ParameterDrift:
    limits = next((item for item in gyro.type.limits if item.parameter == name), None)
    low, high = (limits.low, limits.high) if limits else (None, None)
    places, broken = (
        (np.array([], np.int64),) * 2 if table is None else (table.determined(name), table.broken(name))
    )

    def at(which: NDArray[np.int64]) -> tuple[DriftPoint, ...]:
        return () if table is None else tuple(_points(table.rows(which), name, low, high))

    points: Sequence[DriftPoint] = ()
    drawn: dict[str, tuple[DriftPoint, ...]] = {}
    whole = len(places)
    if table is not None and by == "session":
        few = len(places) if most is None else most
        points = at(grouping.reduced(table, name, few))
        known = [column for column in statistics if f"{name}.{column}" in table]
        drawn = {column: at(grouping.reduced(table, name, few, column)) for column in known}
    elif table is not None:
        points = list(_groups(table, name, by, low, high))
        whole = len(points)
        points = points if most is None else _fewer(points, most)
    return ParameterDrift(
        parameter=name, unit=PARAMETER_UNITS[name][0], low=low, high=high,
        repeatability=limits.repeatability if limits else None, sessions=len(places),
        reduced=len(points) < whole, points=tuple(points), statistics=drawn,
        newest=at(places[max(0, len(places) - newest) :]), broken=at(broken[max(0, len(broken) - newest) :]),
        breaking=len(broken), study=None if document is None else document["parameters"].get(name),
    )  # fmt: skip


def _fewer(points: list[DriftPoint], most: int) -> list[DriftPoint]:
    times = np.array([round(point.at.timestamp()) for point in points], np.int64)
    values = np.array([point.value for point in points], np.float64)
    return [points[place] for place in grouping.extremes(times, values, most)]


def _points(table: SeriesTable, name: str, low: float | None, high: float | None) -> Iterator[DriftPoint]:
    drawn = [chart for chart in CHARTS if f"{name}.{chart}" in table]
    charts = zip(*(series.known(table[f"{name}.{chart}"]) for chart in drawn), strict=True)
    signals = (
        table[f"{name}.signals"] if f"{name}.signals" in table.columns else np.full(len(table), "", object)
    )
    heads = zip(*(table[part].tolist() for part in _HEADS), strict=True)
    values = zip(
        table[f"{name}.value"].tolist(),
        series.known(table[f"{name}.u"]),
        table[f"{name}.k"].tolist(),
        strict=True,
    )
    times = (at.replace(tzinfo=UTC) for at in table["measured_at"].tolist())
    said = charts if drawn else repeat((), len(table))
    for head, at, (value, u, k), chart, rules in zip(heads, times, values, said, signals, strict=True):
        calibration, session, start, stand, certificate, revisions = head
        yield DriftPoint(
            calibration=calibration, session=session, at=at, until=at, sessions=1, start=start, stand=stand,
            certificate=certificate, revisions=revisions, value=value, u=u, k=k, scatter=None,
            verdict=judge(value, u, low, high, k), charts=dict(zip(drawn, chart, strict=True)),
            signals=tuple(rules.split()),
        )  # fmt: skip


def _groups(
    table: SeriesTable, name: str, by: str, low: float | None, high: float | None
) -> Iterator[DriftPoint]:
    for group in grouping.grouped(table, by, name):
        yield DriftPoint(
            calibration=int(table["calibration"][group.last]), session=int(table["session"][group.last]),
            at=aware(table["measured_at"][group.first]), until=aware(table["measured_at"][group.last]),
            sessions=group.sessions, start=int(table["start"][group.last]), stand=str(table["stand"][group.last]),
            certificate=str(table["certificate"][group.last]), revisions=int(table["revisions"][group.last]),
            value=group.value, u=group.u, k=group.k, scatter=group.scatter,
            verdict=judge(group.value, group.u, low, high, group.k), charts={}, signals=(),
        )  # fmt: skip
