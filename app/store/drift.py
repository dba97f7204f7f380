"""Queries for the drift history: what a study is made of, studies, events, baselines, alarms."""

from collections.abc import Collection, Mapping, Sequence
from datetime import datetime
from typing import NamedTuple

import sqlalchemy as sa
from sqlalchemy.orm import Session, aliased, selectinload, undefer

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
    StandAttitude,
    StandCertificate,
    Start,
)


class ResultRow(NamedTuple):
    """One revision of one session's result, with what is known of the session."""

    calibration: int
    session: int
    revision: int
    input_hash: str
    solver_version: str
    chi2: float | None
    fit_dof: int | None
    measured_at: datetime
    temperature_c: float | None
    start: int
    start_at: datetime
    stand: str
    certificate: str
    azimuth_arcsec: float | None
    u_azimuth_arcsec: float | None
    level_north_arcsec: float | None
    u_level_north_arcsec: float | None
    attitude_correlation: float | None
    u_certificate_azimuth_arcsec: float | None
    u_certificate_level_north_arcsec: float | None
    level_east: dict[str, float] | None


class ValueRow(NamedTuple):
    """One parameter of one result by one method."""

    calibration: int
    method: str
    parameter: str
    value: float | None
    u: float | None
    k: float | None
    u_noise: float | None


def result_rows(db: Session, gyro_id: int) -> Sequence[ResultRow]:
    """Every revision of every result of a gyro, in the order of the sessions' times, then of revisions."""
    rows = db.execute(
        sa.select(
            Calibration.id, Calibration.session_id, Calibration.revision, Calibration.input_hash,
            Calibration.solver_version, Calibration.chi2, Calibration.fit_dof, MeasuringSession.started_at,
            MeasuringSession.temperature_c, Start.number, Start.powered_up_at, Stand.name,
            StandCertificate.number, StandAttitude.azimuth_arcsec, StandAttitude.u_azimuth_arcsec,
            StandAttitude.level_north_arcsec, StandAttitude.u_level_north_arcsec, StandAttitude.correlation,
            StandAttitude.u_certificate_azimuth_arcsec, StandAttitude.u_certificate_level_north_arcsec,
            StandAttitude.level_east,
        )
        .select_from(MeasuringSession)
        .join(Calibration, Calibration.session_id == MeasuringSession.id)
        .join(Start, Start.id == MeasuringSession.start_id)
        .join(Stand, Stand.id == MeasuringSession.stand_id)
        .join(StandCertificate, StandCertificate.id == Calibration.certificate_id)
        .outerjoin(StandAttitude, StandAttitude.calibration_id == Calibration.id)
        .where(MeasuringSession.gyro_id == gyro_id)
        .order_by(MeasuringSession.started_at, MeasuringSession.id, Calibration.revision)
    )  # fmt: skip
    return [ResultRow._make(row) for row in rows]


def value_rows(db: Session, gyro_id: int) -> Sequence[ValueRow]:
    """Every parameter of every result of a gyro, by every method."""
    value = CalibrationParameter
    rows = db.execute(
        sa.select(
            value.calibration_id, value.method, value.parameter, value.value, value.standard_uncertainty,
            value.coverage_factor, value.u_noise,
        )
        .select_from(MeasuringSession)
        .join(Calibration, Calibration.session_id == MeasuringSession.id)
        .join(value, value.calibration_id == Calibration.id)
        .where(MeasuringSession.gyro_id == gyro_id)
    )  # fmt: skip
    return [ValueRow._make(row) for row in rows]


def gyro_of_session(db: Session, session_id: int) -> tuple[int, int]:
    """The gyro's and the stand's ids of a session."""
    row = db.execute(
        sa.select(MeasuringSession.gyro_id, MeasuringSession.stand_id).where(
            MeasuringSession.id == session_id
        )
    ).one()
    return row.gyro_id, row.stand_id


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
