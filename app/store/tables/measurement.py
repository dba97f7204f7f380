"""Sessions at the stand and what was measured in them."""

from datetime import datetime
from typing import Any

import sqlalchemy as sa
from sqlalchemy.orm import Mapped, mapped_column, relationship

from app.store.tables.base import Base
from app.store.tables.equipment import Gyro, Stand, StandCertificate, Start


class MeasuringSession(Base):
    """One gyro, one stand, one start, one version of the stand's certificate.

    `latitude_deg` is the stand's at the time: a stand that moves later does not change the past.
    `truth` holds a simulated gyro's true parameters in laboratory units; None for a real one. `solved` says
    whether it has a result: the few that have none are found without walking through all.
    """

    __tablename__ = "session"
    __table_args__ = (
        sa.Index(None, "gyro_id", "started_at"),
        sa.Index(None, "stand_id", "started_at"),
        sa.Index(
            "ix_session_unsolved",
            "id",
            sqlite_where=sa.text("NOT solved"),
            postgresql_where=sa.text("NOT solved"),
        ),
    )

    id: Mapped[int] = mapped_column(primary_key=True)
    gyro_id: Mapped[int] = mapped_column(sa.ForeignKey("gyro.id"))
    stand_id: Mapped[int] = mapped_column(sa.ForeignKey("stand.id"))
    certificate_id: Mapped[int] = mapped_column(sa.ForeignKey("stand_certificate.id"))
    start_id: Mapped[int] = mapped_column(sa.ForeignKey("start.id"))
    latitude_deg: Mapped[float]
    origin: Mapped[str]
    started_at: Mapped[datetime] = mapped_column(index=True)
    temperature_c: Mapped[float | None]
    note: Mapped[str] = mapped_column(default="")
    created_at: Mapped[datetime]
    created_by: Mapped[str]
    truth: Mapped[dict[str, Any] | None]
    solved: Mapped[bool] = mapped_column(default=False, server_default=sa.false())

    gyro: Mapped[Gyro] = relationship(lazy="joined", innerjoin=True)
    stand: Mapped[Stand] = relationship(lazy="joined", innerjoin=True)
    certificate: Mapped[StandCertificate] = relationship(lazy="joined", innerjoin=True)
    start: Mapped[Start] = relationship(lazy="joined", innerjoin=True)


class Record(Base):
    """A record of currents: a content-addressed Parquet file, and the bytes it came from."""

    __tablename__ = "record"

    digest: Mapped[str] = mapped_column(primary_key=True)
    samples: Mapped[int]
    duration_s: Mapped[float]
    rate_hz: Mapped[float]
    source_digest: Mapped[str]
    source_name: Mapped[str]
    created_at: Mapped[datetime]


class Measurement(Base):
    """The mean currents of one position, as one revision. The highest revision counts.

    A withdrawn measurement is a revision of its own, without currents.
    """

    __tablename__ = "measurement"
    __table_args__ = (
        sa.UniqueConstraint("session_id", "theta_deg", "psi_deg", "repeat", "revision"),
        sa.CheckConstraint("(jx_ma IS NULL) = (jy_ma IS NULL)", name="both_currents"),
    )

    id: Mapped[int] = mapped_column(primary_key=True)
    session_id: Mapped[int] = mapped_column(sa.ForeignKey("session.id"))
    theta_deg: Mapped[float]
    psi_deg: Mapped[float]
    repeat: Mapped[int]
    revision: Mapped[int]
    jx_ma: Mapped[float | None]
    jy_ma: Mapped[float | None]
    u_jx_ma: Mapped[float | None]
    u_jy_ma: Mapped[float | None]
    dof_jx: Mapped[float | None]
    dof_jy: Mapped[float | None]
    duration_s: Mapped[float | None]
    rate_hz: Mapped[float | None]
    measured_at: Mapped[datetime | None]
    temperature_c: Mapped[float | None]
    record_digest: Mapped[str | None] = mapped_column(sa.ForeignKey("record.digest"))
    source_digest: Mapped[str | None]
    origin: Mapped[str]
    note: Mapped[str] = mapped_column(default="")
    created_at: Mapped[datetime]
    created_by: Mapped[str]

    record: Mapped[Record | None] = relationship(lazy="joined")
