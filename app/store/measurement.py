"""Queries for sessions and their measurements."""

from collections.abc import Mapping, Sequence
from datetime import datetime
from typing import Final

import sqlalchemy as sa
from sqlalchemy.orm import Session

from app.store.tables import Gyro, Measurement, MeasuringSession, Record, Stand

LAST_FIRST: Final = (MeasuringSession.started_at.desc(), MeasuringSession.id.desc())
"""Order of sessions by when they were measured; of one moment the one that was opened later comes first."""


def follows(number: int) -> sa.ColumnElement[bool]:
    """Whether a session comes after the one of that number in `LAST_FIRST`."""
    one = sa.orm.aliased(MeasuringSession)
    at = sa.select(one.started_at).where(one.id == number).scalar_subquery()
    here = MeasuringSession
    return sa.and_(here.started_at <= at, sa.or_(here.started_at < at, here.id < number))


def session(db: Session, session_id: int) -> MeasuringSession | None:
    """The session of that number."""
    return db.get(MeasuringSession, session_id)


def sessions(
    db: Session,
    *,
    gyro: str | None = None,
    stand: str | None = None,
    since: datetime | None = None,
    until: datetime | None = None,
    before: int | None = None,
    limit: int = 50,
) -> Sequence[MeasuringSession]:
    """Sessions, the last one measured first, those that come after the one of number `before`."""
    query = sa.select(MeasuringSession).order_by(*LAST_FIRST).limit(limit)
    if gyro is not None:
        query = query.join(Gyro, Gyro.id == MeasuringSession.gyro_id).where(Gyro.serial == gyro)
    if stand is not None:
        query = query.join(Stand, Stand.id == MeasuringSession.stand_id).where(Stand.name == stand)
    if since is not None:
        query = query.where(MeasuringSession.started_at >= since)
    if until is not None:
        query = query.where(MeasuringSession.started_at <= until)
    if before is not None:
        query = query.where(follows(before))
    return db.scalars(query).all()


def unsolved(db: Session, limit: int) -> Sequence[MeasuringSession]:
    """Sessions without any result, the newest first."""
    return db.scalars(
        sa.select(MeasuringSession)
        .where(sa.text("NOT session.solved"))
        .order_by(MeasuringSession.id.desc())
        .limit(limit)
    ).all()


def revisions(db: Session, session_id: int) -> Sequence[Measurement]:
    """Every revision of every position of a session, by position, repeat and revision."""
    return db.scalars(
        sa.select(Measurement)
        .where(Measurement.session_id == session_id)
        .order_by(Measurement.theta_deg, Measurement.psi_deg, Measurement.repeat, Measurement.revision)
    ).all()


def newest(db: Session, session_id: int) -> dict[tuple[float, float, int], Measurement]:
    """The highest revision of each position and repeat, by (theta_deg, psi_deg, repeat) and in that order."""
    return {(row.theta_deg, row.psi_deg, row.repeat): row for row in revisions(db, session_id)}


def current(db: Session, session_id: int) -> Sequence[Measurement]:
    """What counts: of each position and repeat the highest revision, unless it was withdrawn."""
    return [row for row in newest(db, session_id).values() if row.jx_ma is not None]


def last_revision(
    db: Session, session_id: int, theta_deg: float, psi_deg: float, repeat: int
) -> Measurement | None:
    """The highest revision of one position and repeat, withdrawn or not."""
    return db.scalar(
        sa.select(Measurement)
        .where(
            Measurement.session_id == session_id,
            Measurement.theta_deg == theta_deg,
            Measurement.psi_deg == psi_deg,
            Measurement.repeat == repeat,
        )
        .order_by(Measurement.revision.desc())
        .limit(1)
    )


def measurements(db: Session, ids: Sequence[int]) -> Sequence[Measurement]:
    """Measurements by their ids, in the order of the ids."""
    found = {row.id: row for row in db.scalars(sa.select(Measurement).where(Measurement.id.in_(ids)))}
    return [found[item] for item in ids]


def measurement(db: Session, measurement_id: int) -> Measurement | None:
    """One revision of one position."""
    return db.get(Measurement, measurement_id)


def measured_positions(db: Session, session_ids: Sequence[int]) -> Mapping[int, int]:
    """How many different positions of each session have a measurement that counts."""
    newest = (
        sa.select(sa.func.max(Measurement.id))
        .where(Measurement.session_id.in_(session_ids))
        .group_by(Measurement.session_id, Measurement.theta_deg, Measurement.psi_deg, Measurement.repeat)
    )
    positions = (
        sa.select(Measurement.session_id, Measurement.theta_deg, Measurement.psi_deg)
        .where(Measurement.id.in_(newest), Measurement.jx_ma.is_not(None))
        .distinct()
        .subquery()
    )
    counted = sa.select(positions.c.session_id, sa.func.count()).group_by(positions.c.session_id)
    return {row[0]: row[1] for row in db.execute(counted)}


def record(db: Session, digest: str) -> Record | None:
    """What is known of a record file."""
    return db.get(Record, digest)


def known_records(db: Session, digests: Sequence[str]) -> frozenset[str]:
    """Which of these record files are known."""
    return frozenset(db.scalars(sa.select(Record.digest).where(Record.digest.in_(digests))))
