"""Queries for what stands' programs report and are asked."""

from collections.abc import Mapping, Sequence
from datetime import datetime
from typing import NamedTuple

import sqlalchemy as sa
from sqlalchemy.orm import Session

from app.store.tables import MeasuringSession, StationCommand, StationEvent, StationRun


class Mark(NamedTuple):
    """What tells one state of a session's run from the next, read without its long columns."""

    run_id: int
    sequence: int
    last_command: int
    answered: int


class Brief(NamedTuple):
    """A run in one line."""

    phase: str
    settled: bool | None
    left_s: float | None
    received_at: datetime


def locked(db: Session, session_id: int) -> bool:
    """Whether there is such a session; until the transaction ends nobody else reports in it."""
    found = sa.select(MeasuringSession.id).where(MeasuringSession.id == session_id).with_for_update()
    return db.scalar(found) is not None


def current_run(db: Session, session_id: int) -> StationRun | None:
    """The run of a session that was heard of last for the first time."""
    return db.scalar(
        sa.select(StationRun)
        .where(StationRun.session_id == session_id)
        .order_by(StationRun.id.desc())
        .limit(1)
    )


def is_known(db: Session, session_id: int, run: str) -> bool:
    """Whether a run of this name has reported in the session before."""
    named = (StationRun.session_id == session_id) & (StationRun.run == run)
    return bool(db.scalar(sa.select(sa.exists().where(named))))


def briefs(db: Session, session_ids: Sequence[int]) -> Mapping[int, Brief]:
    """The present run of each session that has one."""
    newest = (
        sa.select(sa.func.max(StationRun.id))
        .where(StationRun.session_id.in_(session_ids))
        .group_by(StationRun.session_id)
    )
    columns = (StationRun.phase, StationRun.settled, StationRun.left_s, StationRun.received_at)
    rows = db.execute(sa.select(StationRun.session_id, *columns).where(StationRun.id.in_(newest)))
    return {row[0]: Brief(*row[1:]) for row in rows}


def mark(db: Session, session_id: int) -> Mark | None:
    """The state of the session's present run as a mark."""
    row = db.execute(
        sa.select(StationRun.id, StationRun.sequence)
        .where(StationRun.session_id == session_id)
        .order_by(StationRun.id.desc())
        .limit(1)
    ).one_or_none()
    if row is None:
        return None
    last, answered = db.execute(
        sa.select(sa.func.max(StationCommand.id), sa.func.count(StationCommand.answered_at)).where(
            StationCommand.run_id == row.id
        )
    ).one()
    return Mark(row.id, row.sequence, last or 0, answered)


def commands(db: Session, run_id: int, most: int) -> Sequence[StationCommand]:
    """What a run was asked, the newest first."""
    return db.scalars(
        sa.select(StationCommand)
        .where(StationCommand.run_id == run_id)
        .order_by(StationCommand.id.desc())
        .limit(most)
    ).all()


def open_commands(db: Session, run_id: int) -> Sequence[StationCommand]:
    """What a run has not answered, the oldest first."""
    return db.scalars(
        sa.select(StationCommand)
        .where(StationCommand.run_id == run_id, StationCommand.outcome.is_(None))
        .order_by(StationCommand.id)
    ).all()


def events(db: Session, run_id: int, most: int) -> Sequence[StationEvent]:
    """What a run met, the newest first."""
    return db.scalars(
        sa.select(StationEvent)
        .where(StationEvent.run_id == run_id)
        .order_by(StationEvent.number.desc())
        .limit(most)
    ).all()


def last_event(db: Session, run_id: int) -> int:
    """The highest number of an event stored for a run, 0 without any."""
    return db.scalar(sa.select(sa.func.max(StationEvent.number)).where(StationEvent.run_id == run_id)) or 0


def known_events(db: Session, run_id: int, numbers: Sequence[int]) -> frozenset[int]:
    """Which of these events of a run are stored."""
    return frozenset(
        db.scalars(
            sa.select(StationEvent.number).where(
                StationEvent.run_id == run_id, StationEvent.number.in_(numbers)
            )
        )
    )
