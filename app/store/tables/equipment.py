"""Gyros and their types, stands and their certificates."""

from datetime import date, datetime
from typing import Any

import sqlalchemy as sa
from sqlalchemy.orm import Mapped, mapped_column, relationship

from app.store.tables.base import Base


class GyroType(Base):
    """A type of gyro; its limits are entered by the laboratory.

    `interval_days` is how long a calibration of a gyro of the type holds; None when nobody has said.
    """

    __tablename__ = "gyro_type"

    id: Mapped[int] = mapped_column(primary_key=True)
    name: Mapped[str] = mapped_column(unique=True)
    note: Mapped[str] = mapped_column(default="")
    interval_days: Mapped[int | None]

    limits: Mapped[list["TypeLimit"]] = relationship(lazy="selectin", cascade="all, delete-orphan")
    nominals: Mapped[list["TypeNominal"]] = relationship(lazy="selectin", cascade="all, delete-orphan")


class TypeLimit(Base):
    """Between what a parameter of the type has to lie, in laboratory units.

    `repeatability` is the largest standard deviation it may have from session to session; None: no limit.
    """

    __tablename__ = "type_limit"

    type_id: Mapped[int] = mapped_column(sa.ForeignKey("gyro_type.id"), primary_key=True)
    parameter: Mapped[str] = mapped_column(primary_key=True)
    low: Mapped[float]
    high: Mapped[float]
    repeatability: Mapped[float | None]


class TypeNominal(Base):
    """What a parameter of the type is expected to be, with its scatter between gyros; laboratory units.

    `per_kelvin` is its temperature coefficient, None where it is not known.
    """

    __tablename__ = "type_nominal"

    type_id: Mapped[int] = mapped_column(sa.ForeignKey("gyro_type.id"), primary_key=True)
    parameter: Mapped[str] = mapped_column(primary_key=True)
    value: Mapped[float]
    standard_uncertainty: Mapped[float]
    per_kelvin: Mapped[float | None]


class Gyro(Base):
    """One gyro, known by its serial number.

    `check` marks a check gyro: kept at the laboratory and measured regularly to watch the stands.
    """

    __tablename__ = "gyro"

    id: Mapped[int] = mapped_column(primary_key=True)
    serial: Mapped[str] = mapped_column(unique=True)
    type_id: Mapped[int] = mapped_column(sa.ForeignKey("gyro_type.id"), index=True)
    note: Mapped[str] = mapped_column(default="")
    check: Mapped[bool] = mapped_column(default=False, server_default=sa.false())
    created_at: Mapped[datetime]

    type: Mapped[GyroType] = relationship(lazy="joined", innerjoin=True)


class Start(Base):
    """A power-up of a gyro: its bias differs from start to start, so each is kept."""

    __tablename__ = "start"
    __table_args__ = (sa.UniqueConstraint("gyro_id", "number"),)

    id: Mapped[int] = mapped_column(primary_key=True)
    gyro_id: Mapped[int] = mapped_column(sa.ForeignKey("gyro.id"))
    number: Mapped[int]
    powered_up_at: Mapped[datetime]
    note: Mapped[str] = mapped_column(default="")


class Stand(Base):
    """A two-axis stand in its place.

    `uncertainty` states what all positions measured here have in common (`app.exchange.uncertainties`).
    """

    __tablename__ = "stand"

    id: Mapped[int] = mapped_column(primary_key=True)
    name: Mapped[str] = mapped_column(unique=True)
    latitude_deg: Mapped[float]
    note: Mapped[str] = mapped_column(default="")
    created_at: Mapped[datetime]
    uncertainty: Mapped[dict[str, Any] | None]


class StandCertificate(Base):
    """One version of a stand's certificate. It never changes; a new one has the next version.

    `u_alpha_common_arcsec` and its like are standard uncertainties of what every position's angle
    shares; those of the positions are independent.
    """

    __tablename__ = "stand_certificate"
    __table_args__ = (sa.UniqueConstraint("stand_id", "number"), sa.UniqueConstraint("stand_id", "version"))

    id: Mapped[int] = mapped_column(primary_key=True)
    stand_id: Mapped[int] = mapped_column(sa.ForeignKey("stand.id"))
    number: Mapped[str]
    version: Mapped[int]
    valid_from: Mapped[date]
    valid_until: Mapped[date]
    issued_by: Mapped[str] = mapped_column(default="")
    u_alpha_common_arcsec: Mapped[float | None]
    u_beta_common_arcsec: Mapped[float | None]
    u_gamma_common_arcsec: Mapped[float | None]
    digest: Mapped[str]
    created_at: Mapped[datetime]
    created_by: Mapped[str]

    stand: Mapped[Stand] = relationship(lazy="joined", innerjoin=True)
    positions: Mapped[list["CertificatePosition"]] = relationship(
        lazy="selectin", order_by="(CertificatePosition.theta_deg, CertificatePosition.psi_deg)"
    )


class CertificatePosition(Base):
    """Certified misalignment at one position; standard uncertainties where the certificate gives them."""

    __tablename__ = "certificate_position"

    certificate_id: Mapped[int] = mapped_column(sa.ForeignKey("stand_certificate.id"), primary_key=True)
    theta_deg: Mapped[float] = mapped_column(primary_key=True)
    psi_deg: Mapped[float] = mapped_column(primary_key=True)
    alpha_arcsec: Mapped[float]
    beta_arcsec: Mapped[float]
    gamma_arcsec: Mapped[float]
    u_alpha_arcsec: Mapped[float | None]
    u_beta_arcsec: Mapped[float | None]
    u_gamma_arcsec: Mapped[float | None]
