"""Gyros, types, stands and certificates."""

from datetime import date, datetime
from typing import Annotated, Any

from pydantic import AliasPath, ConfigDict, Field
from pydantic.config import JsonDict

from app.api.schemas.common import (
    Angle,
    Day,
    Incoming,
    Name,
    NotNegative,
    Number,
    Outgoing,
    Positive,
    Text,
)
from app.api.schemas.results import Summary
from app.api.schemas.uncertainty import Uncertainty
from app.api.schemas.warned import Warned

_SOME_LIMITS: JsonDict = {"limits": {"wg": {"low": -3.0, "high": 3.0}}}
_SOME_NOMINALS: JsonDict = {
    "nominals": {"kx": {"value": 2063.0, "standard_uncertainty": 21.0, "per_kelvin": -0.4}}
}


class NewGyro(Incoming):
    """A gyro to register; an unknown type is created empty."""

    model_config = ConfigDict(json_schema_extra={"examples": [{"serial": "0417", "type": "GVK-6"}]})

    serial: Name
    type: Name
    note: Text = ""
    check: bool = False


class GyroChange(Incoming):
    """What to correct; what is left out stays."""

    model_config = ConfigDict(json_schema_extra={"examples": [{"note": "bearing replaced"}]})

    type: Name | None = None
    note: Text | None = None
    check: bool | None = None


class Gyro(Outgoing):
    """A gyro and its latest result; a `check` gyro is kept to watch the stands."""

    serial: str
    type: str
    note: str
    check: bool
    created_at: datetime
    last_session: int | None
    last_measured_at: datetime | None
    last_stand: str | None
    last_result: Summary | None


class NewStand(Incoming):
    """A stand to register; south of the equator the latitude is negative."""

    model_config = ConfigDict(json_schema_extra={"examples": [{"name": "S1", "latitude_deg": 55.7558}]})

    name: Name
    latitude_deg: Annotated[Number, Field(ge=-90, le=90)]
    note: Text = ""


class CertificatePosition(Incoming, Outgoing):
    """Certified misalignment of one position, with standard uncertainties where they are known."""

    theta_deg: Angle
    psi_deg: Angle
    alpha_arcsec: Number
    beta_arcsec: Number
    gamma_arcsec: Number
    u_alpha_arcsec: NotNegative | None = None
    u_beta_arcsec: NotNegative | None = None
    u_gamma_arcsec: NotNegative | None = None


_POSITION: JsonDict = {
    "theta_deg": 0,
    "psi_deg": 0,
    "alpha_arcsec": 6.9,
    "beta_arcsec": 16.4,
    "gamma_arcsec": 6.6,
}


class NewCertificate(Incoming):
    """A certificate of a stand. It never changes; a later one has a number of its own."""

    model_config = ConfigDict(
        json_schema_extra={
            "examples": [
                {
                    "number": "C-17",
                    "valid_from": "2026-01-01",
                    "valid_until": "2027-01-01",
                    "positions": [_POSITION],
                }
            ]
        }
    )

    number: Name
    valid_from: Day
    valid_until: Day
    issued_by: Text = ""
    u_alpha_common_arcsec: NotNegative | None = None
    u_beta_common_arcsec: NotNegative | None = None
    u_gamma_common_arcsec: NotNegative | None = None
    positions: Annotated[list[CertificatePosition], Field(min_length=1, max_length=10_000)]


def _in_common(name: str) -> Any:
    return Field(validation_alias=AliasPath("common", name))


class CertificateHead(Outgoing):
    """A version of a stand's certificate; `valid` says whether it is valid today.

    `u_alpha_common_arcsec` and its like: standard uncertainty of what the angles of all positions share.
    """

    stand: str
    number: str
    version: int
    valid_from: date
    valid_until: date
    valid: bool
    issued_by: str
    u_alpha_common_arcsec: Annotated[float | None, _in_common("u_alpha_common_arcsec")]
    u_beta_common_arcsec: Annotated[float | None, _in_common("u_beta_common_arcsec")]
    u_gamma_common_arcsec: Annotated[float | None, _in_common("u_gamma_common_arcsec")]
    digest: str
    created_at: datetime
    created_by: str


class Certificate(CertificateHead):
    """The same with its positions, θ outer, ψ inner."""

    positions: list[CertificatePosition]


class CertificateRead(Certificate):
    """A certificate just entered, and what was noticed in its file."""

    warnings: list[Warned]


class Stand(Outgoing):
    """A stand, the certificate that is valid today, and what is stated of its uncertainty."""

    name: str
    latitude_deg: float
    note: str
    created_at: datetime
    certificate: CertificateHead | None
    uncertainty: Uncertainty


class Limit(Incoming):
    """Between what a parameter has to lie, in its laboratory unit.

    `repeatability` is the largest standard deviation that it may have from session to session; null:
    no limit.
    """

    low: Number
    high: Number
    repeatability: Positive | None = None


class NewLimits(Incoming):
    """A type's limits; they replace the ones before."""

    model_config = ConfigDict(json_schema_extra={"examples": [_SOME_LIMITS]})

    limits: dict[Name, Limit]


class Nominal(Incoming):
    """What a parameter is expected to be, in its laboratory unit.

    The standard uncertainty is the standard deviation between gyros of the type; `per_kelvin` is the
    temperature coefficient, null where it is not known.
    """

    value: Number
    standard_uncertainty: Positive
    per_kelvin: Number | None = None


class NewNominals(Incoming):
    """A type's nominal values; they replace the ones before."""

    model_config = ConfigDict(json_schema_extra={"examples": [_SOME_NOMINALS]})

    nominals: dict[Name, Nominal]


class Interval(Incoming):
    """How many days a calibration of the type's gyros holds; null: nobody says."""

    model_config = ConfigDict(json_schema_extra={"examples": [{"days": 365}]})

    days: Annotated[int, Field(strict=True, ge=1, le=3660)] | None


class GyroType(Outgoing):
    """A type of gyro, its limits, its nominal values, its calibration interval and how many gyros it has."""

    name: str
    note: str
    gyros: int
    interval_days: int | None
    limits: dict[str, Limit]
    nominals: dict[str, Nominal]
