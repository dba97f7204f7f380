"""Queries for the fleet: each gyro's last sound calibration, a type's gyros, who was measured on a stand."""

from collections.abc import Mapping, Sequence
from datetime import datetime
from typing import Any, NamedTuple

import sqlalchemy as sa
from sqlalchemy.orm import Session

from app.store.tables import (
    Alarm,
    Calibration,
    CalibrationParameter,
    DriftStudy,
    Gyro,
    GyroType,
    MeasuringSession,
    Stand,
)
from solver.records import PARAMETERS


class LastSound(NamedTuple):
    """A gyro, and the latest of its sessions whose newest result determines every parameter; None without one."""

    gyro_id: int
    serial: str
    type_name: str
    check: bool
    interval_days: int | None
    session: int | None
    calibration: int | None
    measured_at: datetime | None
    stand: str | None


def last_sound(
    db: Session, *, type_name: str | None = None, serials: Sequence[str] | None = None
) -> Sequence[LastSound]:
    """Every gyro, or a type's, or those named, by serial number.

    The inner query walks a gyro's sessions backwards along their index and stops at the first sound one,
    so that it costs the same for a long history as for a short one.
    """
    latest = sa.orm.aliased(MeasuringSession)
    found = (
        sa.select(latest.id)
        .where(latest.gyro_id == Gyro.id, _determined(latest) == len(PARAMETERS))
        .order_by(latest.started_at.desc())
        .limit(1)
        .correlate(Gyro)
        .scalar_subquery()
    )
    query = (
        sa.select(
            Gyro.id, Gyro.serial, GyroType.name, Gyro.check, GyroType.interval_days, MeasuringSession.id,
            _newest(MeasuringSession), MeasuringSession.started_at, Stand.name,
        )
        .join(GyroType, GyroType.id == Gyro.type_id)
        .outerjoin(MeasuringSession, MeasuringSession.id == found)
        .outerjoin(Stand, Stand.id == MeasuringSession.stand_id)
        .order_by(Gyro.serial)
    )  # fmt: skip
    if type_name is not None:
        query = query.where(GyroType.name == type_name)
    if serials is not None:
        query = query.where(Gyro.serial.in_(serials))
    return [LastSound._make(row) for row in db.execute(query)]


def _newest(session: type[MeasuringSession]) -> sa.ScalarSelect[int]:
    """The highest revision of the outer query's session."""
    result = sa.orm.aliased(Calibration)
    newest = sa.select(sa.func.max(result.id)).where(result.session_id == session.id)
    return newest.correlate(session).scalar_subquery()


def _determined(session: type[MeasuringSession]) -> sa.ScalarSelect[int]:
    """How many parameters its newest result determines by the method that stands for it (`services.verdicts`)."""
    result, value = sa.orm.aliased(Calibration), sa.orm.aliased(CalibrationParameter)
    method = sa.case((result.method == "both", "least-squares"), else_=result.method)
    return (
        sa.select(sa.func.count(value.value))
        .join(result, result.id == value.calibration_id)
        .where(result.id == _newest(session), value.method == method)
        .correlate(session)
        .scalar_subquery()
    )


class Studied(NamedTuple):
    """A gyro's study by one method; `document` is its JSON text, None before the first one."""

    gyro_id: int
    document: str | None
    up_to_date: bool


def studies_of(db: Session, gyro_ids: Sequence[int], method: str) -> Sequence[Studied]:
    """What is known of the drift of these gyros."""
    rows = db.execute(
        sa.select(DriftStudy.gyro_id, DriftStudy.document, DriftStudy.studied >= DriftStudy.changed).where(
            DriftStudy.gyro_id.in_(gyro_ids), DriftStudy.method == method
        )
    )
    return [
        Studied(gyro_id, document, bool(fresh)) for gyro_id, document, fresh in rows if gyro_id is not None
    ]


def studied_methods(db: Session, gyro_ids: Sequence[int]) -> Sequence[tuple[int, str]]:
    """Each of these gyros with each method that it has a study by."""
    rows = db.execute(
        sa.select(DriftStudy.gyro_id, DriftStudy.method)
        .where(DriftStudy.gyro_id.in_(gyro_ids))
        .order_by(DriftStudy.gyro_id, DriftStudy.method)
    )
    return [(gyro_id, method) for gyro_id, method in rows if gyro_id is not None]


def recalibrations(db: Session, type_id: int, method: str) -> Sequence[dict[str, Any]]:
    """What was found at the end of intervals, of each gyro of a type of which anything was."""
    rows = db.scalars(
        sa.select(DriftStudy.recalibrations)
        .join(Gyro, Gyro.id == DriftStudy.gyro_id)
        .where(Gyro.type_id == type_id, DriftStudy.method == method)
        .order_by(Gyro.serial)
    )
    return [row for row in rows if row is not None]


def open_alarms(db: Session, gyro_ids: Sequence[int], method: str) -> Mapping[int, int]:
    """How many alarms are open of each of these gyros."""
    rows = db.execute(
        sa.select(Alarm.gyro_id, sa.func.count())
        .where(Alarm.gyro_id.in_(gyro_ids), Alarm.method == method, Alarm.state == "open")
        .group_by(Alarm.gyro_id)
    )
    return {gyro_id: count for gyro_id, count in rows if gyro_id is not None}


def results_of(db: Session, calibration_ids: Sequence[int]) -> Mapping[int, Calibration]:
    """These results."""
    rows = db.scalars(sa.select(Calibration).where(Calibration.id.in_(calibration_ids)))
    return {row.id: row for row in rows}


class OnStand(NamedTuple):
    """A gyro that was measured on a stand, with the columns of its own study (Arrow)."""

    serial: str
    kind: str
    check: bool
    series: bytes


def series_on(db: Session, stand_id: int, method: str) -> Sequence[OnStand]:
    """The gyros of a stand by serial number, those that have been studied."""
    used = sa.select(MeasuringSession.gyro_id).where(MeasuringSession.stand_id == stand_id).distinct()
    rows = db.execute(
        sa.select(Gyro.serial, GyroType.name, Gyro.check, DriftStudy.series)
        .join(GyroType, GyroType.id == Gyro.type_id)
        .join(DriftStudy, DriftStudy.gyro_id == Gyro.id)
        .where(Gyro.id.in_(used), DriftStudy.method == method, DriftStudy.series.is_not(None))
        .order_by(Gyro.serial)
    )
    return [OnStand._make(row) for row in rows]


def stand_by_id(db: Session, stand_id: int) -> Stand:
    """The stand of that id, which must be there."""
    return db.get_one(Stand, stand_id)
