"""Queries for gyros, their types and starts, stands and their certificates."""

from collections.abc import Sequence
from datetime import date, datetime, timedelta

import sqlalchemy as sa
from sqlalchemy.orm import Session

from app.store.tables import Gyro, GyroType, MeasuringSession, Stand, StandCertificate, Start


def gyro(db: Session, serial: str) -> Gyro | None:
    """The gyro with that serial number."""
    return db.scalar(sa.select(Gyro).where(Gyro.serial == serial))


def gyro_by_id(db: Session, gyro_id: int) -> Gyro:
    """The gyro of that number, which exists."""
    return db.get_one(Gyro, gyro_id)


def gyros(db: Session, *, type_name: str | None, after: str | None, limit: int) -> Sequence[Gyro]:
    """Gyros by serial number, those after `after`."""
    query = sa.select(Gyro).join(GyroType).order_by(Gyro.serial).limit(limit)
    if type_name is not None:
        query = query.where(GyroType.name == type_name)
    if after is not None:
        query = query.where(Gyro.serial > after)
    return db.scalars(query).all()


def gyro_type(db: Session, name: str) -> GyroType | None:
    """The type of that name."""
    return db.scalar(sa.select(GyroType).where(GyroType.name == name))


def types_with_counts(db: Session) -> Sequence[tuple[GyroType, int]]:
    """Every type with the number of its gyros."""
    counted = (
        sa.select(GyroType, sa.func.count(Gyro.id))
        .outerjoin(Gyro)
        .group_by(GyroType.id)
        .order_by(GyroType.name)
    )
    return [(kind, count) for kind, count in db.execute(counted)]


def last_start(db: Session, gyro_id: int) -> Start | None:
    """The gyro's newest power-up."""
    newest = sa.select(Start).where(Start.gyro_id == gyro_id).order_by(Start.number.desc()).limit(1)
    return db.scalar(newest)


def start_at(db: Session, gyro_id: int, at: datetime, within: timedelta) -> Start | None:
    """The power-up that the gyro was on from at a time: of its nearest session, or the latest one before."""
    session = MeasuringSession
    near = sa.select(session.started_at, session.start_id).where(
        session.gyro_id == gyro_id, session.started_at.between(at - within, at + within)
    )
    before = sa.select(Start.powered_up_at, Start.id).where(
        Start.gyro_id == gyro_id, Start.powered_up_at.between(at - within, at)
    )
    found = [(abs(when - at), -key) for when, key in (*db.execute(near), *db.execute(before))]
    return db.get(Start, -min(found)[1]) if found else None


def start(db: Session, gyro_id: int, number: int) -> Start | None:
    """The gyro's power-up of that number."""
    return db.scalar(sa.select(Start).where(Start.gyro_id == gyro_id, Start.number == number))


def stand(db: Session, name: str) -> Stand | None:
    """The stand of that name."""
    return db.scalar(sa.select(Stand).where(Stand.name == name))


def stands(db: Session) -> Sequence[Stand]:
    """Every stand, by name."""
    return db.scalars(sa.select(Stand).order_by(Stand.name)).all()


def certificate(db: Session, stand_id: int, number: str) -> StandCertificate | None:
    """The stand's certificate of that number."""
    return db.scalar(
        sa.select(StandCertificate).where(
            StandCertificate.stand_id == stand_id, StandCertificate.number == number
        )
    )


def certificates(db: Session, stand_id: int | None = None) -> Sequence[StandCertificate]:
    """Certificates of one stand or of all, the newest version first."""
    query = sa.select(StandCertificate).order_by(StandCertificate.stand_id, StandCertificate.version.desc())
    if stand_id is not None:
        query = query.where(StandCertificate.stand_id == stand_id)
    return db.scalars(query).all()


def valid_certificate(db: Session, stand_id: int, on: date) -> StandCertificate | None:
    """The newest certificate of the stand that is valid on that day (both ends included)."""
    return db.scalar(
        sa.select(StandCertificate)
        .where(
            StandCertificate.stand_id == stand_id,
            StandCertificate.valid_from <= on,
            StandCertificate.valid_until >= on,
        )
        .order_by(StandCertificate.version.desc())
        .limit(1)
    )
