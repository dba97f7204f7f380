"""A gyro's life and a stand's: what happened, what is judged against what, what was found."""

from datetime import datetime
from typing import Any

import sqlalchemy as sa
from sqlalchemy.orm import Mapped, mapped_column, relationship

from app.store.tables.base import Base
from app.store.tables.equipment import Gyro, Stand
from app.store.tables.results import Calibration

_ONE_SUBJECT = sa.text("(gyro_id IS NULL) <> (stand_id IS NULL)")


class StandAttitude(Base):
    """How the stand's base stands according to one session's residuals, against its certificate; arcsec.

    Turning the base about the vertical (`azimuth`) or about north (`level_north`) changes no parameter
    of a gyro but the residuals; turning it about east changes parameters: `level_east` holds that
    change, by parameter, in laboratory units per arcsec. NULL where the positions show nothing.
    Azimuth and level about north are each estimated as if the other were zero. The `u_` are those of the
    session's own noise, with `correlation` and `dof` (NULL: infinite); the `u_certificate_` come of the
    certificate's stated angles and are common to all sessions by it.
    """

    __tablename__ = "stand_attitude"

    calibration_id: Mapped[int] = mapped_column(sa.ForeignKey("calibration.id"), primary_key=True)
    azimuth_arcsec: Mapped[float | None]
    u_azimuth_arcsec: Mapped[float | None]
    level_north_arcsec: Mapped[float | None]
    u_level_north_arcsec: Mapped[float | None]
    correlation: Mapped[float | None]
    dof: Mapped[float | None]
    u_certificate_azimuth_arcsec: Mapped[float | None]
    u_certificate_level_north_arcsec: Mapped[float | None]
    level_east: Mapped[dict[str, Any] | None]


class Event(Base):
    """Something that happened to a gyro or to a stand: a repair, an adjustment, a move.

    `kind` is one of repair, adjustment, moved, method, other. An event entered in error is withdrawn,
    never deleted. Changes of certificate and of solver are not kept here: the sessions tell them.
    """

    __tablename__ = "event"
    __table_args__ = (sa.CheckConstraint(_ONE_SUBJECT, name="one_subject"),)

    id: Mapped[int] = mapped_column(primary_key=True)
    gyro_id: Mapped[int | None] = mapped_column(sa.ForeignKey("gyro.id"), index=True)
    stand_id: Mapped[int | None] = mapped_column(sa.ForeignKey("stand.id"), index=True)
    happened_at: Mapped[datetime]
    kind: Mapped[str]
    note: Mapped[str] = mapped_column(default="")
    created_at: Mapped[datetime]
    created_by: Mapped[str]
    withdrawn_at: Mapped[datetime | None]
    withdrawn_by: Mapped[str | None]


class Baseline(Base):
    """What a gyro's parameter is judged against: frozen by a person from sessions that the person chose.

    It judges sessions from `valid_from` up to the next baseline's. `calibrations` are the ids of the
    results it was computed from; `centre` and `scatter` (standard deviation from start to start beyond their
    own u) are in laboratory units, as `u_typical`, the u that those had, and `within`, the scatter of the
    sessions of one start, 0 where none has two; `count` says of how many starts. `limits` is
    prediction or three-sigma; `rules` maps ``individuals`` to a list of run rules, ``ewma`` and ``cusum`` to
    their settings. It never changes: a new one replaces it, and `retired_at` then says when.
    """

    __tablename__ = "baseline"

    id: Mapped[int] = mapped_column(primary_key=True)
    gyro_id: Mapped[int] = mapped_column(sa.ForeignKey("gyro.id"), index=True)
    parameter: Mapped[str]
    method: Mapped[str]
    valid_from: Mapped[datetime]
    calibrations: Mapped[list[Any]]
    estimator: Mapped[str]
    centre: Mapped[float]
    scatter: Mapped[float]
    dof: Mapped[float]
    u_typical: Mapped[float]
    within: Mapped[float]
    count: Mapped[int]
    limits: Mapped[str]
    rules: Mapped[dict[str, Any]]
    reason: Mapped[str] = mapped_column(default="")
    frozen_at: Mapped[datetime]
    frozen_by: Mapped[str]
    retired_at: Mapped[datetime | None]
    retired_by: Mapped[str | None]


class Alarm(Base):
    """A finding that a person has to acknowledge with a cause; of a gyro's parameter, or of a stand.

    `kind` names the rule or the finding; `calibration_id` is the result that raised it, `last_calibration_id` the
    last one that keeps it up. `template` and `values` are its sentence. `state` is open, acknowledged, replaced
    (the result that raised it counts no more: a correction replaced it) or lapsed (nothing shows it any
    more: another baseline, more results); `ended_at` says since when it is not open.
    """

    __tablename__ = "alarm"
    __table_args__ = (
        sa.CheckConstraint(_ONE_SUBJECT, name="one_subject"),
        sa.UniqueConstraint("gyro_id", "stand_id", "parameter", "method", "kind", "calibration_id"),
    )

    id: Mapped[int] = mapped_column(primary_key=True)
    gyro_id: Mapped[int | None] = mapped_column(sa.ForeignKey("gyro.id"), index=True)
    stand_id: Mapped[int | None] = mapped_column(sa.ForeignKey("stand.id"), index=True)
    parameter: Mapped[str | None]
    method: Mapped[str]
    kind: Mapped[str]
    severity: Mapped[str]
    baseline_id: Mapped[int | None] = mapped_column(sa.ForeignKey("baseline.id"))
    calibration_id: Mapped[int] = mapped_column(sa.ForeignKey("calibration.id"))
    last_calibration_id: Mapped[int] = mapped_column(sa.ForeignKey("calibration.id"))
    template: Mapped[str]
    values: Mapped[dict[str, Any]]
    raised_at: Mapped[datetime]
    state: Mapped[str] = mapped_column(index=True)
    ended_at: Mapped[datetime | None]
    acknowledged_at: Mapped[datetime | None]
    acknowledged_by: Mapped[str | None]
    cause: Mapped[str | None]
    note: Mapped[str] = mapped_column(default="")

    gyro: Mapped[Gyro | None] = relationship(lazy="joined")
    stand: Mapped[Stand | None] = relationship(lazy="joined")
    calibration: Mapped[Calibration] = relationship(foreign_keys=[calibration_id], lazy="select")


class DriftStudy(Base):
    """What is known of the drift of one gyro, or of one stand, by one method: made by a job, replaced by the next.

    `changed` counts what came in, `studied` is its count when the study was made: it is up to date when
    they are equal. `document` is the study as JSON text, `series` its values as columns (Arrow),
    `recalibrations` what a gyro's calibrations found at the end of intervals, by which limits, `job_id` the job
    that makes the next one.
    """

    __tablename__ = "drift_study"
    __table_args__ = (
        sa.CheckConstraint(_ONE_SUBJECT, name="one_subject"),
        sa.UniqueConstraint("gyro_id", "method"),
        sa.UniqueConstraint("stand_id", "method"),
    )

    id: Mapped[int] = mapped_column(primary_key=True)
    gyro_id: Mapped[int | None] = mapped_column(sa.ForeignKey("gyro.id"))
    stand_id: Mapped[int | None] = mapped_column(sa.ForeignKey("stand.id"))
    method: Mapped[str]
    changed: Mapped[int] = mapped_column(default=1)
    studied: Mapped[int] = mapped_column(default=0)
    studied_at: Mapped[datetime | None]
    solver_version: Mapped[str | None]
    document: Mapped[str | None] = mapped_column(deferred=True)
    series: Mapped[bytes | None] = mapped_column(deferred=True)
    recalibrations: Mapped[dict[str, Any] | None] = mapped_column(deferred=True)
    job_id: Mapped[str | None]
