"""Queries for what a gyro's study is made of: every revision of every result, and its parameters."""

from collections.abc import Sequence
from datetime import datetime
from typing import NamedTuple

import sqlalchemy as sa
from sqlalchemy.orm import Session

from app.store.tables import (
    Calibration,
    CalibrationParameter,
    MeasuringSession,
    Stand,
    StandAttitude,
    StandCertificate,
    Start,
)


class ResultRow(NamedTuple):
    """One revision of one session's result, with what is known of the session."""

    calibration: int
    session: int
    revision: int
    input_hash: str
    solver_version: str
    chi2: float | None
    fit_dof: int | None
    measured_at: datetime
    temperature_c: float | None
    start: int
    start_at: datetime
    stand: str
    certificate: str
    azimuth_arcsec: float | None
    u_azimuth_arcsec: float | None
    level_north_arcsec: float | None
    u_level_north_arcsec: float | None
    attitude_correlation: float | None
    u_certificate_azimuth_arcsec: float | None
    u_certificate_level_north_arcsec: float | None
    level_east: dict[str, float] | None


class ValueRow(NamedTuple):
    """One parameter of one result by one method."""

    calibration: int
    method: str
    parameter: str
    value: float | None
    u: float | None
    k: float | None
    u_noise: float | None


def result_rows(db: Session, gyro_id: int) -> Sequence[ResultRow]:
    """Every revision of every result of a gyro, in the order of the sessions' times, then of revisions."""
    rows = db.execute(
        sa.select(
            Calibration.id, Calibration.session_id, Calibration.revision, Calibration.input_hash,
            Calibration.solver_version, Calibration.chi2, Calibration.fit_dof, MeasuringSession.started_at,
            MeasuringSession.temperature_c, Start.number, Start.powered_up_at, Stand.name,
            StandCertificate.number, StandAttitude.azimuth_arcsec, StandAttitude.u_azimuth_arcsec,
            StandAttitude.level_north_arcsec, StandAttitude.u_level_north_arcsec, StandAttitude.correlation,
            StandAttitude.u_certificate_azimuth_arcsec, StandAttitude.u_certificate_level_north_arcsec,
            StandAttitude.level_east,
        )
        .select_from(MeasuringSession)
        .join(Calibration, Calibration.session_id == MeasuringSession.id)
        .join(Start, Start.id == MeasuringSession.start_id)
        .join(Stand, Stand.id == MeasuringSession.stand_id)
        .join(StandCertificate, StandCertificate.id == Calibration.certificate_id)
        .outerjoin(StandAttitude, StandAttitude.calibration_id == Calibration.id)
        .where(MeasuringSession.gyro_id == gyro_id)
        .order_by(MeasuringSession.started_at, MeasuringSession.id, Calibration.revision)
    )  # fmt: skip
    return [ResultRow._make(row) for row in rows]


def value_rows(db: Session, gyro_id: int) -> Sequence[ValueRow]:
    """Every parameter of every result of a gyro, by every method."""
    value = CalibrationParameter
    rows = db.execute(
        sa.select(
            value.calibration_id, value.method, value.parameter, value.value, value.standard_uncertainty,
            value.coverage_factor, value.u_noise,
        )
        .select_from(MeasuringSession)
        .join(Calibration, Calibration.session_id == MeasuringSession.id)
        .join(value, value.calibration_id == Calibration.id)
        .where(MeasuringSession.gyro_id == gyro_id)
    )  # fmt: skip
    return [ValueRow._make(row) for row in rows]
