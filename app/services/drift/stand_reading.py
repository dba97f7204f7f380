"""What a page or a call asks of a stand's drift: a period, a grouping; from the stored study alone."""

import json
from collections.abc import Iterator
from dataclasses import dataclass
from datetime import datetime
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from app.errors import Invalid, problem
from app.services.drift import alarms, events, following, series
from app.services.drift.series import SeriesTable, aware
from app.services.drift.views import AlarmView, EventView
from app.services.job_views import job_view
from app.services.lab import Work
from app.services.stands import find_stand
from app.services.views import JobView
from app.store import drift, results
from solver.records import PARAMETERS

GROUPS: Final = ("session", "day", "week", "month", "year")
MOST_POINTS: Final = 200
AXES: Final = ("azimuth", "level_north", "level_east")
LIMIT: Final = 3.0
"""Of the common mode: so many standard deviations of a mean of gyros that do nothing together."""
_UNITS: Final = {"day": "D", "week": "W", "month": "M", "year": "Y"}


@dataclass(frozen=True, slots=True)
class StandPoint:
    """Sessions taken together: a weighted mean of what they show; None where they show nothing.

    `session`, `calibration`, `gyro` and `certificate` are of the last one; `values` and `u` by axis in arcsec, `common`
    by parameter the mean of its gyros’ mean deviations in standard deviations of one, each between ± `limits`.
    """

    at: datetime
    until: datetime
    sessions: int
    gyros: int
    session: int
    calibration: int
    gyro: str
    certificate: str
    values: dict[str, float | None]
    u: dict[str, float | None]
    common: dict[str, float | None]
    limits: dict[str, float | None]


@dataclass(frozen=True, slots=True)
class StandSession:
    """A session on the stand."""

    session: int
    calibration: int
    gyro: str
    at: datetime


@dataclass(frozen=True, slots=True)
class StandDrift:
    """A stand's drift: what was found, and the points of a period.

    Attributes
    ----------
    document
        Of the study; None before the first one.
    by
        What a point stands for, as it was asked for or as it had to be for at most `MOST_POINTS` points.
    reduced
        Whether `points` are the newest `MOST_POINTS` of the period only.
    together
        The same sessions by the month at least: what gyros have in common shows in means of several.
    affected_since, affected
        The last change of the stand that no event explains, and every session from it on, the newest first.
    """

    stand: str
    method: str
    up_to_date: bool
    studied_at: datetime | None
    job: JobView | None
    sessions: int
    document: dict[str, Any] | None
    by: str
    reduced: bool
    points: tuple[StandPoint, ...]
    together: tuple[StandPoint, ...]
    events: tuple[EventView, ...]
    alarms: tuple[AlarmView, ...]
    affected_since: datetime | None
    affected: tuple[StandSession, ...]


def stand_drift(
    work: Work,
    name: str,
    *,
    since: datetime | None = None,
    until: datetime | None = None,
    by: str | None = None,
) -> StandDrift:
    """A stand's drift for a period, both ends included.

    Raises
    ------
    NotFound
        There is no such stand.
    Invalid
        There is no such grouping.
    """
    if by is not None and by not in GROUPS:
        raise Invalid(problem("unknown-grouping", "There is no grouping “%(name)s”; choose among %(names)s.",
                              column="by", name=by, names=", ".join(GROUPS)))  # fmt: skip
    stand = find_stand(work, name)
    row = drift.study(work.db, None, stand.id, following.STAND_METHOD)
    table = None if row is None or row.series is None else series.decode(row.series)
    document = None if row is None or row.document is None else json.loads(row.document)
    shown = None if table is None else _coded(table.between(since, until))
    grouping, groups = (by or "session", []) if shown is None else _grouped(shown, by)
    job = None if row is None or row.job_id is None else results.job(work.db, row.job_id)
    since_change = _last_change(document)
    return StandDrift(
        stand=stand.name, method=following.STAND_METHOD, up_to_date=row is None or row.studied >= row.changed,
        studied_at=row.studied_at if row else None, job=job_view(job) if job else None,
        sessions=0 if table is None else len(table), document=document, by=grouping,
        reduced=len(groups) > MOST_POINTS,
        points=() if shown is None else tuple(_point(shown, members) for members in groups[-MOST_POINTS:]),
        together=() if shown is None else tuple(_point(shown, members) for members in _together(shown, grouping)),
        events=events.of_stand(work, name), alarms=alarms.alarms(work, stand=name), affected_since=since_change,
        affected=() if table is None or since_change is None else tuple(_since(table, since_change)),
    )  # fmt: skip


def table_of(work: Work, name: str) -> SeriesTable | None:
    """Every session on a stand with what it shows; None before a study."""
    row = drift.study(work.db, None, find_stand(work, name).id, following.STAND_METHOD)
    return None if row is None or row.series is None else series.decode(row.series)


def _coded(table: SeriesTable) -> SeriesTable:
    """With gyros as numbers too, which are counted faster than texts."""
    _, codes = np.unique(table["gyro"].astype(str), return_inverse=True)
    return table.with_columns({"gyro_code": codes.ravel()})


def _grouped(table: SeriesTable, by: str | None) -> tuple[str, list[NDArray[np.int64]]]:
    for name in GROUPS if by is None else (by,):
        keys = (
            table["session"]
            if name == "session"
            else table["measured_at"].astype(f"datetime64[{_UNITS[name]}]")
        )
        _, first = np.unique(keys, return_index=True)
        if by is not None or len(first) <= MOST_POINTS or name == GROUPS[-1]:
            break
    cuts = np.flatnonzero(keys[1:] != keys[:-1]) + 1
    return name, np.split(np.arange(len(table)), cuts) if len(table) else []


def _together(table: SeriesTable, by: str) -> list[NDArray[np.int64]]:
    return _grouped(table, "year" if by == "year" else "month")[1][-MOST_POINTS:]


def _point(table: SeriesTable, members: NDArray[np.int64]) -> StandPoint:
    last = int(members[-1])
    gyro = table["gyro_code"][members]
    found = {axis: _mean(table, axis, members) for axis in AXES}
    common = {name: _common(table[f"z.{name}"][members], gyro) for name in PARAMETERS}
    return StandPoint(
        at=aware(table["measured_at"][members[0]]), until=aware(table["measured_at"][last]),
        sessions=len(members), gyros=len(np.unique(gyro)), session=int(table["session"][last]),
        calibration=int(table["calibration"][last]), gyro=str(table["gyro"][last]),
        certificate=str(table["certificate"][last]),
        values={axis: item[0] for axis, item in found.items()}, u={axis: item[1] for axis, item in found.items()},
        common={name: item[0] for name, item in common.items()},
        limits={name: item[1] for name, item in common.items()},
    )  # fmt: skip


def _mean(table: SeriesTable, axis: str, members: NDArray[np.int64]) -> tuple[float | None, float | None]:
    """Weighted by 1/u²: GUM, H.3.1.2 and its like; what the sessions' certificate errs by is common to them."""
    value, u = table[f"{axis}_arcsec"][members], table[f"u_{axis}_arcsec"][members]
    known = np.isfinite(value) & np.isfinite(u) & (u > 0.0)
    if not known.any():
        return None, None
    weight = 1.0 / u[known] ** 2
    return float(weight @ value[known] / weight.sum()), float(1.0 / np.sqrt(weight.sum()))


def _common(z: NDArray[np.float64], gyro: NDArray[Any]) -> tuple[float | None, float | None]:
    known = np.isfinite(z)
    if not known.any():
        return None, None
    counts = np.bincount(gyro[known])
    means = (np.bincount(gyro[known], z[known]) / np.maximum(counts, 1))[counts > 0]
    return float(means.mean()), float(LIMIT / np.sqrt(len(means)))


def _last_change(document: dict[str, Any] | None) -> datetime | None:
    """When the stand last changed without a word: the session before the first that may be touched."""
    found = [] if document is None else document["findings"]
    times = [
        item["since"]
        for item in found
        if item["verdict"] in ("stand", "certificate") and item["event"] is None
    ]
    return datetime.fromisoformat(max(times)) if times else None


def _since(table: SeriesTable, begin: datetime) -> Iterator[StandSession]:
    for place in np.flatnonzero(table["measured_at"] > series.moment(begin))[::-1].tolist():
        yield StandSession(
            int(table["session"][place]), int(table["calibration"][place]), str(table["gyro"][place]),
            aware(table["measured_at"][place]),
        )  # fmt: skip


def is_up_to_date(work: Work, name: str) -> bool:
    """Whether the stand's study has taken everything in."""
    row = drift.study(work.db, None, find_stand(work, name).id, following.STAND_METHOD)
    return row is None or row.studied >= row.changed
