"""What a stand's program tells of itself while it runs, and what it is asked to do."""

from datetime import datetime
from typing import Any

import sqlalchemy as sa
from sqlalchemy.orm import Mapped, mapped_column

from app.store.tables.base import Base


class StationRun(Base):
    """One run of a stand's program in a session, and its newest report, which replaces the one before.

    `run` is the name that the run gave itself. `theta_deg` to `take` say where it is, all None when it is
    at no position; `cells` holds the state of each position, `readings` the last reported currents at the
    present one. `sent_at` is by the stand's clock, the other times are by ours.
    """

    __tablename__ = "station_run"
    __table_args__ = (sa.UniqueConstraint("session_id", "run"),)

    id: Mapped[int] = mapped_column(primary_key=True)
    session_id: Mapped[int] = mapped_column(sa.ForeignKey("session.id"))
    run: Mapped[str]
    station: Mapped[str]
    started_at: Mapped[datetime]
    reported_by: Mapped[str]
    sequence: Mapped[int] = mapped_column(sa.BigInteger)
    sent_at: Mapped[datetime]
    received_at: Mapped[datetime]
    phase: Mapped[str]
    theta_deg: Mapped[float | None]
    psi_deg: Mapped[float | None]
    repeat: Mapped[int | None]
    take: Mapped[int | None]
    jx_ma: Mapped[float | None]
    jy_ma: Mapped[float | None]
    settled: Mapped[bool | None]
    fraction: Mapped[float | None]
    left_s: Mapped[float | None]
    waiting: Mapped[int]
    cells: Mapped[list[Any]]
    readings: Mapped[list[Any]]


class StationEvent(Base):
    """Something that a run met; `level` is one of info, warning, error. Kept once, by its number in the run.

    `message` is the sentence in English; `template` and `values` are the same for translation, where given.
    """

    __tablename__ = "station_event"

    run_id: Mapped[int] = mapped_column(sa.ForeignKey("station_run.id"), primary_key=True)
    number: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)
    at: Mapped[datetime]
    level: Mapped[str]
    code: Mapped[str]
    message: Mapped[str]
    template: Mapped[str | None]
    values: Mapped[dict[str, Any] | None]
    theta_deg: Mapped[float | None]
    psi_deg: Mapped[float | None]


class StationCommand(Base):
    """What a person asked a run to do; `outcome` is None until the run has answered, then done or refused."""

    __tablename__ = "station_command"

    id: Mapped[int] = mapped_column(primary_key=True)
    run_id: Mapped[int] = mapped_column(sa.ForeignKey("station_run.id"), index=True)
    kind: Mapped[str]
    theta_deg: Mapped[float | None]
    psi_deg: Mapped[float | None]
    asked_at: Mapped[datetime]
    asked_by: Mapped[str]
    answered_at: Mapped[datetime | None]
    outcome: Mapped[str | None]
    message: Mapped[str] = mapped_column(default="")
    template: Mapped[str | None]
    values: Mapped[dict[str, Any] | None]
