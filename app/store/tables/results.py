"""Jobs and what they gave: calibrations are append-only."""

from datetime import datetime
from typing import Any

import sqlalchemy as sa
from sqlalchemy import event
from sqlalchemy.orm import Mapped, Mapper, mapped_column, relationship

from app.store.tables.base import Base
from app.store.tables.measurement import MeasuringSession


class Job(Base):
    """One piece of background work, from the request to its end.

    `state` is one of queued, running, succeeded, failed, cancelled.
    """

    __tablename__ = "job"

    id: Mapped[str] = mapped_column(primary_key=True)
    kind: Mapped[str]
    state: Mapped[str] = mapped_column(index=True)
    session_id: Mapped[int | None] = mapped_column(sa.ForeignKey("session.id"), index=True)
    request: Mapped[dict[str, Any]]
    progress: Mapped[float] = mapped_column(default=0.0)
    phase: Mapped[str] = mapped_column(default="")
    attempts: Mapped[int] = mapped_column(default=0)
    calibration_id: Mapped[int | None] = mapped_column(sa.ForeignKey("calibration.id"))
    problems: Mapped[list[Any] | None]
    created_at: Mapped[datetime] = mapped_column(index=True)
    created_by: Mapped[str]
    started_at: Mapped[datetime | None]
    finished_at: Mapped[datetime | None]


class Calibration(Base):
    """One result, frozen: `result` is the JSON text that the solver's answer was written as.

    `revision` counts the results of a session; `replaces_id` is the one before. `inputs` holds the
    ids of the measurements that went in, in the solver's order. `chi2` with `fit_dof` degrees of freedom
    tells how the least-squares fit's residuals compare with the stated noise; None where none is stated.
    """

    __tablename__ = "calibration"
    __table_args__ = (sa.UniqueConstraint("session_id", "revision"),)

    id: Mapped[int] = mapped_column(primary_key=True)
    session_id: Mapped[int] = mapped_column(sa.ForeignKey("session.id"))
    revision: Mapped[int]
    replaces_id: Mapped[int | None] = mapped_column(sa.ForeignKey("calibration.id"))
    method: Mapped[str]
    solver_version: Mapped[str]
    input_hash: Mapped[str] = mapped_column(index=True)
    certificate_id: Mapped[int] = mapped_column(sa.ForeignKey("stand_certificate.id"))
    inputs: Mapped[list[Any]]
    result: Mapped[str]
    result_digest: Mapped[str]
    chi2: Mapped[float | None]
    fit_dof: Mapped[int | None]
    created_at: Mapped[datetime]
    created_by: Mapped[str]

    session: Mapped[MeasuringSession] = relationship(lazy="joined", innerjoin=True)
    parameters: Mapped[list["CalibrationParameter"]] = relationship(
        lazy="selectin", order_by="CalibrationParameter.id"
    )


@event.listens_for(Calibration, "after_insert")
def _solve(_mapper: Mapper[Calibration], connection: sa.Connection, row: Calibration) -> None:
    """Its session has a result from now on."""
    connection.execute(
        sa.update(MeasuringSession).where(MeasuringSession.id == row.session_id).values(solved=True)
    )


class CalibrationParameter(Base):
    """A parameter of a result, laid out for the drift history; laboratory units.

    `coverage_factor` is k of its expanded uncertainty; results of solver 1.0.0 had none of their own
    and are shown with k = 2. `u_noise` is the part of the standard uncertainty that comes from the noise of the
    session's own currents: what differs from session to session when the gyro does not.
    """

    __tablename__ = "calibration_parameter"
    __table_args__ = (sa.UniqueConstraint("calibration_id", "method", "parameter"),)

    id: Mapped[int] = mapped_column(primary_key=True)
    calibration_id: Mapped[int] = mapped_column(sa.ForeignKey("calibration.id"))
    method: Mapped[str]
    parameter: Mapped[str]
    value: Mapped[float | None]
    standard_uncertainty: Mapped[float | None]
    coverage_factor: Mapped[float | None]
    u_noise: Mapped[float | None]


class IdempotentReply(Base):
    """What was answered to a request with an ``Idempotency-Key``, so that a repeat gets the same."""

    __tablename__ = "idempotent_reply"

    account: Mapped[str] = mapped_column(primary_key=True)
    key: Mapped[str] = mapped_column(primary_key=True)
    fingerprint: Mapped[str]
    subject: Mapped[str]
    created_at: Mapped[datetime]
