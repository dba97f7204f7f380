"""Queries for jobs, calibrations and replies already given."""

from collections.abc import Mapping, Sequence
from datetime import datetime

import sqlalchemy as sa
from sqlalchemy.orm import Session, aliased

from app.store.measurement import LAST_FIRST, follows
from app.store.tables import (
    Calibration,
    Gyro,
    GyroType,
    IdempotentReply,
    Job,
    MeasuringSession,
)

ACTIVE = ("queued", "running")


def job(db: Session, job_id: str) -> Job | None:
    """The job of that id."""
    return db.get(Job, job_id)


def jobs_of(db: Session, session_ids: Sequence[int]) -> Mapping[int, Job]:
    """The newest job of each session."""
    rows = db.scalars(sa.select(Job).where(Job.session_id.in_(session_ids)).order_by(Job.created_at))
    return {row.session_id: row for row in rows if row.session_id is not None}


def active_jobs(db: Session) -> Sequence[Job]:
    """Jobs that wait or run, the oldest first."""
    return db.scalars(sa.select(Job).where(Job.state.in_(ACTIVE)).order_by(Job.created_at)).all()


def job_counts(db: Session) -> Mapping[str, int]:
    """How many jobs there are in each state."""
    return {row[0]: row[1] for row in db.execute(sa.select(Job.state, sa.func.count()).group_by(Job.state))}


def calibration(db: Session, calibration_id: int) -> Calibration | None:
    """The calibration of that number."""
    return db.get(Calibration, calibration_id)


def last_calibration(db: Session, session_id: int) -> Calibration | None:
    """The session's highest revision."""
    return db.scalar(
        sa.select(Calibration)
        .where(Calibration.session_id == session_id)
        .order_by(Calibration.revision.desc())
        .limit(1)
    )


def calibrations_of(db: Session, session_id: int) -> Sequence[Calibration]:
    """Every revision of a session's result, the newest first."""
    return db.scalars(
        sa.select(Calibration)
        .where(Calibration.session_id == session_id)
        .order_by(Calibration.revision.desc())
    ).all()


def last_calibrations(db: Session, session_ids: Sequence[int]) -> Mapping[int, Calibration]:
    """The newest result of each session that has one."""
    newest = (
        sa.select(sa.func.max(Calibration.id))
        .where(Calibration.session_id.in_(session_ids))
        .group_by(Calibration.session_id)
    )
    rows = db.scalars(sa.select(Calibration).where(Calibration.id.in_(newest)))
    return {row.session_id: row for row in rows}


def calibrations(
    db: Session,
    *,
    gyro: str | None = None,
    type_name: str | None = None,
    before: int | None = None,
    limit: int = 50,
) -> Sequence[Calibration]:
    """The newest result of each session, the last one measured first, those after the result `before`."""
    newest = sa.select(sa.func.max(Calibration.id)).group_by(Calibration.session_id)
    query = (
        sa.select(Calibration)
        .join(MeasuringSession, MeasuringSession.id == Calibration.session_id)
        .join(Gyro, Gyro.id == MeasuringSession.gyro_id)
        .join(GyroType, GyroType.id == Gyro.type_id)
        .where(Calibration.id.in_(newest))
        .order_by(*LAST_FIRST)
        .limit(limit)
    )
    if gyro is not None:
        query = query.where(Gyro.serial == gyro)
    if type_name is not None:
        query = query.where(GyroType.name == type_name)
    if before is not None:
        shown = calibration(db, before)
        query = query.where(follows(0 if shown is None else shown.session_id))
    return db.scalars(query).all()


def newest_of_gyros(db: Session, gyro_ids: Sequence[int]) -> Mapping[int, Calibration]:
    """Of each gyro the newest result of its latest session that has one.

    A gyro's sessions are walked backwards along their index up to the first with a result, so that a long
    history costs no more than a short one.
    """
    newest = (
        sa.select(Calibration.id)
        .join(MeasuringSession, MeasuringSession.id == Calibration.session_id)
        .where(MeasuringSession.gyro_id == Gyro.id)
        .order_by(
            MeasuringSession.started_at.desc(), Calibration.session_id.desc(), Calibration.revision.desc()
        )
        .limit(1)
        .correlate(Gyro)
        .scalar_subquery()
    )
    ids = sa.select(newest).where(Gyro.id.in_(gyro_ids))
    rows = db.scalars(sa.select(Calibration).where(Calibration.id.in_(ids)))
    return {row.session.gyro_id: row for row in rows}


def earlier_calibrations(
    db: Session, gyro_id: int, before: datetime, limit: int = 5
) -> Sequence[Calibration]:
    """Newest results of the gyro's sessions that began before a time, the latest session first."""
    later = aliased(Calibration)
    replaced = sa.exists().where(
        later.session_id == Calibration.session_id, later.revision > Calibration.revision
    )
    return db.scalars(
        sa.select(Calibration)
        .join(MeasuringSession, MeasuringSession.id == Calibration.session_id)
        .where(MeasuringSession.gyro_id == gyro_id, MeasuringSession.started_at < before, ~replaced)
        .order_by(MeasuringSession.started_at.desc())
        .limit(limit)
    ).all()


def reply(db: Session, account: str, key: str) -> IdempotentReply | None:
    """What was answered to this account's request with this key."""
    return db.get(IdempotentReply, (account, key))
