"""Queries for the drift history: studies, events, baselines, alarms."""

from collections.abc import Collection, Mapping, Sequence
from datetime import datetime
from typing import Any, NamedTuple, TypeVar

import sqlalchemy as sa
from sqlalchemy.orm import InstrumentedAttribute, Session, aliased, selectinload, undefer

from app.store.tables import (
    Alarm,
    Baseline,
    Calibration,
    CalibrationParameter,
    DriftStudy,
    Event,
    Gyro,
    Job,
    MeasuringSession,
    Stand,
)

Row = TypeVar("Row", Alarm, Baseline, Event)


def locked(db: Session, gyro_id: int | None, stand_id: int | None) -> None:
    """Nobody else changes the subject's studies until the transaction ends."""
    table, key = (Gyro, gyro_id) if stand_id is None else (Stand, stand_id)
    db.execute(sa.select(table.id).where(table.id == key).with_for_update())


def studies(
    db: Session, gyro_id: int | None, stand_id: int | None, *, whole: bool = False
) -> Sequence[DriftStudy]:
    """The studies of a gyro or of a stand, one for each method; `whole`: with documents and series."""
    query = sa.select(DriftStudy).where(_subject(DriftStudy, gyro_id, stand_id)).order_by(DriftStudy.method)
    if whole:
        query = query.options(undefer(DriftStudy.document), undefer(DriftStudy.series))
    return db.scalars(query).all()


def study(db: Session, gyro_id: int | None, stand_id: int | None, method: str) -> DriftStudy | None:
    """One study, its document and series fetched when they are asked for."""
    return db.scalar(
        sa.select(DriftStudy).where(_subject(DriftStudy, gyro_id, stand_id), DriftStudy.method == method)
    )


def queued_job(db: Session, job_ids: Sequence[str]) -> str | None:
    """Which of these jobs still waits to begin."""
    return db.scalar(sa.select(Job.id).where(Job.id.in_(job_ids), Job.state == "queued").limit(1))


def jobs(db: Session, job_ids: Collection[str]) -> Sequence[Job]:
    """The jobs of these ids that have not ended."""
    return db.scalars(sa.select(Job).where(Job.id.in_(job_ids), Job.state.in_(("queued", "running")))).all()


def behind(db: Session, limit: int = 1000) -> Sequence[DriftStudy]:
    """Studies that something has come in for since they were made."""
    return db.scalars(sa.select(DriftStudy).where(DriftStudy.studied < DriftStudy.changed).limit(limit)).all()


def without_study(db: Session) -> Sequence[tuple[int, str]]:
    """Gyros with results by methods that no study is of: id and method."""
    studied = sa.select(DriftStudy.gyro_id).where(DriftStudy.gyro_id.is_not(None))
    rows = db.execute(
        sa.select(MeasuringSession.gyro_id, CalibrationParameter.method)
        .join(Calibration, Calibration.session_id == MeasuringSession.id)
        .join(CalibrationParameter, CalibrationParameter.calibration_id == Calibration.id)
        .where(MeasuringSession.gyro_id.not_in(studied))
        .distinct()
        .order_by(MeasuringSession.gyro_id, CalibrationParameter.method)
    )
    return [(row[0], row[1]) for row in rows]


def outdated(db: Session, solver_version: str) -> Sequence[DriftStudy]:
    """Studies that were made by another version of the solver."""
    return db.scalars(
        sa.select(DriftStudy).where(
            DriftStudy.solver_version.is_not(None), DriftStudy.solver_version != solver_version
        )
    ).all()


def unattended(db: Session) -> Sequence[DriftStudy]:
    """Studies that are behind, and that no job waits or runs for."""
    at_work = sa.exists().where(Job.id == DriftStudy.job_id, Job.state.in_(("queued", "running")))
    return db.scalars(sa.select(DriftStudy).where(DriftStudy.studied < DriftStudy.changed, ~at_work)).all()


def gyros_on(db: Session, stand_id: int) -> Sequence[int]:
    """Ids of the gyros that were measured on a stand."""
    return db.scalars(
        sa.select(MeasuringSession.gyro_id)
        .where(MeasuringSession.stand_id == stand_id)
        .distinct()
        .order_by(MeasuringSession.gyro_id)
    ).all()


def gyros_of_type(db: Session, type_id: int) -> Sequence[int]:
    """Ids of the gyros of a type."""
    return db.scalars(sa.select(Gyro.id).where(Gyro.type_id == type_id).order_by(Gyro.id)).all()


def event(db: Session, event_id: int) -> Event | None:
    """The event of that number."""
    return db.get(Event, event_id)


def events(
    db: Session, gyro_id: int | None, stand_ids: Sequence[int] = (), *, withdrawn: bool = False
) -> Sequence[Event]:
    """What happened to a gyro (None for none) and to stands, in the order of time."""
    about = sa.or_(Event.gyro_id == gyro_id, Event.stand_id.in_(stand_ids)) if gyro_id else (
        Event.stand_id.in_(stand_ids)
    )  # fmt: skip
    query = sa.select(Event).where(about).order_by(Event.happened_at, Event.id)
    if not withdrawn:
        query = query.where(Event.withdrawn_at.is_(None))
    return db.scalars(query).all()


def stands_of(db: Session, gyro_id: int) -> Sequence[Stand]:
    """The stands that a gyro was measured on."""
    used = sa.select(MeasuringSession.stand_id).where(MeasuringSession.gyro_id == gyro_id).distinct()
    return db.scalars(sa.select(Stand).where(Stand.id.in_(used)).order_by(Stand.name)).all()


def baseline(db: Session, baseline_id: int) -> Baseline | None:
    """The baseline of that number."""
    return db.get(Baseline, baseline_id)


def baselines(
    db: Session, gyro_id: int, *, method: str | None = None, retired: bool = False
) -> Sequence[Baseline]:
    """A gyro's baselines by parameter, then by what they are valid from."""
    query = (
        sa.select(Baseline)
        .where(Baseline.gyro_id == gyro_id)
        .order_by(Baseline.parameter, Baseline.valid_from, Baseline.id)
    )
    if method is not None:
        query = query.where(Baseline.method == method)
    if not retired:
        query = query.where(Baseline.retired_at.is_(None))
    return db.scalars(query).all()


def alarm(db: Session, alarm_id: int) -> Alarm | None:
    """The alarm of that number."""
    return db.get(Alarm, alarm_id)


def alarms_of(db: Session, gyro_id: int | None, stand_id: int | None, method: str) -> Sequence[Alarm]:
    """Every alarm of a gyro or of a stand by a method, the oldest first."""
    return db.scalars(
        sa.select(Alarm).where(_subject(Alarm, gyro_id, stand_id), Alarm.method == method).order_by(Alarm.id)
    ).all()


def _subject(
    table: type[DriftStudy] | type[Alarm], gyro_id: int | None, stand_id: int | None
) -> sa.ColumnElement[bool]:
    if stand_id is not None:
        return table.stand_id == stand_id
    return table.gyro_id == gyro_id


class AlarmRow(NamedTuple):
    """An alarm, and when and in which sessions its first and its last result were measured."""

    alarm: Alarm
    session: int
    at: datetime
    last_session: int
    last_at: datetime


def alarm_rows(
    db: Session,
    *,
    alarm_id: int | None = None,
    gyro: str | None = None,
    stand: str | None = None,
    kind: str | None = None,
    state: str | None = None,
    method: str | None = None,
    start: int = 0,
    limit: int = 200,
) -> Sequence[AlarmRow]:
    """Alarms, the worst first, of those equally bad the one raised last."""
    first, last = aliased(MeasuringSession), aliased(MeasuringSession)
    shown, kept = aliased(Calibration), aliased(Calibration)
    rank = sa.case({"serious": 0, "warning": 1}, value=Alarm.severity, else_=2)
    query = (
        sa.select(Alarm, first.id, first.started_at, last.id, last.started_at)
        .join(shown, shown.id == Alarm.calibration_id)
        .join(first, first.id == shown.session_id)
        .join(kept, kept.id == Alarm.last_calibration_id)
        .join(last, last.id == kept.session_id)
        .options(selectinload(Alarm.gyro), selectinload(Alarm.stand))
        .order_by(rank, Alarm.raised_at.desc(), Alarm.id.desc())
        .offset(start)
        .limit(limit)
    )
    wanted = (
        (alarm_id, Alarm.id), (kind, Alarm.kind), (state, Alarm.state), (method, Alarm.method),
    )  # fmt: skip
    for value, column in wanted:
        if value is not None:
            query = query.where(column == value)
    if gyro is not None:
        query = query.where(Alarm.gyro_id == sa.select(Gyro.id).where(Gyro.serial == gyro).scalar_subquery())
    if stand is not None:
        query = query.where(
            Alarm.stand_id == sa.select(Stand.id).where(Stand.name == stand).scalar_subquery()
        )
    return [AlarmRow(*row) for row in db.execute(query)]


def alarm_counts(db: Session) -> Mapping[str, int]:
    """How many open alarms there are of each severity."""
    rows = db.execute(
        sa.select(Alarm.severity, sa.func.count()).where(Alarm.state == "open").group_by(Alarm.severity)
    )
    return {row[0]: row[1] for row in rows}


def sessions_of(db: Session, calibration_ids: Collection[int]) -> dict[int, int]:
    """The session of each of these results."""
    rows = db.execute(
        sa.select(Calibration.id, Calibration.session_id).where(Calibration.id.in_(calibration_ids))
    )
    return {row[0]: row[1] for row in rows}


def measured_at(db: Session, calibration_ids: Collection[int]) -> dict[int, datetime]:
    """When the sessions of these results were."""
    rows = db.execute(
        sa.select(Calibration.id, MeasuringSession.started_at)
        .join(MeasuringSession, MeasuringSession.id == Calibration.session_id)
        .where(Calibration.id.in_(calibration_ids))
    )
    return {row[0]: row[1] for row in rows}


def subject_names(db: Session, gyro_id: int | None, stand_id: int | None) -> tuple[str | None, str | None]:
    """The gyro's serial number and the stand's name."""
    return (
        db.scalar(sa.select(Gyro.serial).where(Gyro.id == gyro_id)),
        db.scalar(sa.select(Stand.name).where(Stand.id == stand_id)),
    )


def latest(db: Session, table: type[Row], column: InstrumentedAttribute[Any], limit: int) -> Sequence[Row]:
    """Rows by a time of theirs, the newest first; those without it left out."""
    return db.scalars(
        sa.select(table).where(column.is_not(None)).order_by(column.desc(), table.id.desc()).limit(limit)
    ).all()
