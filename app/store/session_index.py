"""The index of sessions: which there are by gyro, stand and state, counted and filtered in one query."""

from collections.abc import Mapping, Sequence
from typing import Any

import sqlalchemy as sa
from sqlalchemy.orm import Session

from app.store.measurement import LAST_FIRST, follows
from app.store.results import ACTIVE
from app.store.tables import (
    Calibration,
    CertificatePosition,
    Gyro,
    Job,
    Measurement,
    MeasuringSession,
    Stand,
)


def _indexed() -> sa.Subquery:
    """One row for each session: its number, gyro, stand and state (see `services.sessions`)."""
    newest_job = sa.select(
        Job.session_id,
        Job.state,
        sa.func.row_number().over(partition_by=Job.session_id, order_by=Job.created_at.desc()).label("place"),
    ).subquery()
    last_revision = sa.select(sa.func.max(Measurement.id)).group_by(
        Measurement.session_id, Measurement.theta_deg, Measurement.psi_deg, Measurement.repeat
    )
    measured = (
        sa.select(Measurement.session_id, Measurement.theta_deg, Measurement.psi_deg)
        .where(Measurement.id.in_(last_revision), Measurement.jx_ma.is_not(None))
        .distinct()
        .subquery()
    )
    counts = (
        sa.select(measured.c.session_id, sa.func.count().label("measured"))
        .group_by(measured.c.session_id)
        .subquery()
    )
    totals = (
        sa.select(CertificatePosition.certificate_id, sa.func.count().label("total"))
        .group_by(CertificatePosition.certificate_id)
        .subquery()
    )
    solved = sa.select(Calibration.session_id).distinct().subquery()
    state = sa.case(
        (newest_job.c.state.in_(ACTIVE), "solving"),
        (newest_job.c.state == "failed", "failed"),
        (solved.c.session_id.is_not(None), "solved"),
        (sa.func.coalesce(counts.c.measured, 0) >= sa.func.coalesce(totals.c.total, 0), "ready"),
        else_="measuring",
    )
    here = MeasuringSession
    return (
        sa.select(here.id, Gyro.serial.label("gyro"), Stand.name.label("stand"), state.label("state"))
        .join(Gyro, Gyro.id == here.gyro_id)
        .join(Stand, Stand.id == here.stand_id)
        .outerjoin(newest_job, sa.and_(newest_job.c.session_id == here.id, newest_job.c.place == 1))
        .outerjoin(counts, counts.c.session_id == here.id)
        .outerjoin(totals, totals.c.certificate_id == here.certificate_id)
        .outerjoin(solved, solved.c.session_id == here.id)
        .subquery()
    )


def counted(db: Session) -> Sequence[tuple[str, str, str, int]]:
    """How many sessions there are of each gyro, on each stand, in each state."""
    index = _indexed()
    keys = (index.c.gyro, index.c.stand, index.c.state)
    rows = db.execute(sa.select(*keys, sa.func.count()).group_by(*keys).order_by(*keys))
    return [(gyro, stand, state, count) for gyro, stand, state, count in rows]


def found(
    db: Session, wanted: Mapping[str, Any], *, before: int | None = None, limit: int = 50
) -> Sequence[MeasuringSession]:
    """Sessions whose gyro, stand and state are as wanted, the last one measured first, after that of `before`."""
    index = _indexed()
    query = sa.select(MeasuringSession).join(index, index.c.id == MeasuringSession.id)
    query = query.where(*(index.c[key] == value for key, value in wanted.items()))
    if before is not None:
        query = query.where(follows(before))
    return db.scalars(query.order_by(*LAST_FIRST).limit(limit)).all()
