"""The tables. `Base.metadata` knows all of them once this package is imported."""

from app.store.tables.base import Base
from app.store.tables.drift import Alarm, Baseline, DriftStudy, Event, StandAttitude
from app.store.tables.equipment import (
    CertificatePosition,
    Gyro,
    GyroType,
    Stand,
    StandCertificate,
    Start,
    TypeLimit,
    TypeNominal,
)
from app.store.tables.measurement import Measurement, MeasuringSession, Record
from app.store.tables.people import Account, Login, SignInLink, Token
from app.store.tables.results import Calibration, CalibrationParameter, IdempotentReply, Job
from app.store.tables.station import StationCommand, StationEvent, StationRun

__all__ = [
    "Account",
    "Alarm",
    "Base",
    "Baseline",
    "Calibration",
    "CalibrationParameter",
    "CertificatePosition",
    "DriftStudy",
    "Event",
    "Gyro",
    "GyroType",
    "IdempotentReply",
    "Job",
    "Login",
    "Measurement",
    "MeasuringSession",
    "Record",
    "SignInLink",
    "Stand",
    "StandAttitude",
    "StandCertificate",
    "Start",
    "StationCommand",
    "StationEvent",
    "StationRun",
    "Token",
    "TypeLimit",
    "TypeNominal",
]
