"""Results: in one line, in full (the interface's own shape), and over time."""

from datetime import datetime
from typing import Any, Literal

from pydantic import ConfigDict, Field

from app.api.schemas.common import Outgoing

Verdict = Literal["conforms", "conditional", "fails", "no-limit", "undetermined"]
METHODS = Literal["least-squares", "generalised", "robust", "paper", "both"]


class Parameter(Outgoing):
    """One parameter: value, standard uncertainty u, expanded uncertainty U = k·u, limits, verdict."""

    value: float | None
    standard_uncertainty: float | None = Field(validation_alias="u")
    coverage_factor: float = Field(validation_alias="k")
    expanded_uncertainty: float | None = Field(validation_alias="expanded")
    unit: str
    low: float | None
    high: float | None
    verdict: Verdict


class Summary(Outgoing):
    """A result in one line."""

    id: int
    revision: int
    method: str
    solved_at: datetime
    verdict: Verdict
    offending: list[str]
    parameters: dict[str, Parameter]


class CalibrationLine(Summary):
    """A session's newest result in a list, and whose it is."""

    session: int
    gyro: str
    type: str
    stand: str
    certificate: str
    started_at: datetime


class Calibration(Outgoing):
    """A result as it was solved, and where it came from.

    With the method `both` the two results stand under `paper` and `least-squares`, each with the
    fields that a single method has here.
    """

    model_config = ConfigDict(extra="allow")

    id: int
    session: int
    gyro: str
    stand: str
    certificate: str
    certificate_digest: str
    latitude_deg: float
    revision: int
    replaces: int | None
    replaced_by: int | None
    result_digest: str
    created_at: datetime
    created_by: str
    verdict: Verdict
    method: str
    solver_version: str
    input_hash: str
    parameters: dict[str, Any] | None = None
    covariance: list[list[float | None]] | None = None
    residuals: list[dict[str, Any]] | None = None
    fit: dict[str, Any] | None = None
    iterations: list[dict[str, Any]] | None = None
    budget: list[dict[str, Any]] | None = None
    current_noise: dict[str, Any] | None = Field(
        default=None,
        description="Where u(J) was stated with finite degrees of freedom: as stated and as used, by channel.",
    )
    monte_carlo: dict[str, Any] | None = None
    model: dict[str, Any] | None = None
    diagnosis: list[dict[str, Any]] | None = None
    not_excluded: list[dict[str, Any]] | None = None
    stated: dict[str, Any] | None = None
    warnings: list[dict[str, Any]] | None = None


class HistoryPoint(Outgoing):
    """One session's value."""

    calibration: int
    session: int
    measured_at: datetime
    start: int
    stand: str
    certificate: str
    value: float | None
    standard_uncertainty: float | None = Field(validation_alias="u")
    coverage_factor: float = Field(validation_alias="k")
    expanded_uncertainty: float | None = Field(validation_alias="expanded")
    verdict: Verdict


class Series(Outgoing):
    """A parameter over time, oldest first, with the limits of the gyro's type."""

    parameter: str
    unit: str
    low: float | None
    high: float | None
    points: list[HistoryPoint]


class History(Outgoing):
    """A gyro's parameters over time, each value by the method named."""

    gyro: str
    method: str
    series: list[Series]
