"""Sessions and what is measured in them."""

from datetime import datetime
from typing import Annotated, Any, Literal

from pydantic import ConfigDict, Field

from app.api.schemas.common import Id, Incoming, Moment, Name, Number, Outgoing, Positive, Text
from app.api.schemas.equipment import CertificatePosition
from app.api.schemas.jobs import Job
from app.api.schemas.results import Summary
from app.api.schemas.warned import Warned

State = Literal["measuring", "ready", "solving", "solved", "failed"]
Repeat = Annotated[int, Field(ge=0, lt=10_000, description="0 first, 1 the first repeat.")]
Celsius = Annotated[Number, Field(ge=-273.15, le=1000)]


class NewSession(Incoming):
    """A session to open.

    Without `certificate` it is the one valid at the start. Without `start` (the number of a power-up),
    `new_start` true counts a further power-up and false means the newest one; without either the
    session belongs to the gyro's power-up or session nearest to it within 12 hours, else to a new power-up.
    """

    model_config = ConfigDict(
        json_schema_extra={
            "examples": [
                {"gyro": "0417", "stand": "S1"},
                {"gyro": "0417", "stand": "S1", "certificate": "C-17", "started_at": "2026-03-01T09:30:00Z"},
            ]
        }
    )

    gyro: Name
    stand: Name
    certificate: Name | None = None
    start: Id | None = None
    new_start: Annotated[bool, Field(strict=True)] | None = None
    started_at: Moment | None = None
    temperature_c: Celsius | None = None
    note: Text = ""


class Session(Outgoing):
    """A session in one line."""

    id: int
    gyro: str
    type: str
    stand: str
    certificate: str
    start: int
    origin: str
    started_at: datetime
    created_by: str
    temperature_c: float | None
    note: str
    latitude_deg: float
    positions_measured: int
    positions_total: int
    state: State
    job: Job | None
    result: Summary | None


class NewMeans(Incoming):
    """The mean currents of one position; what is left out is not known."""

    model_config = ConfigDict(
        json_schema_extra={
            "examples": [{"jx_ma": 0.004536, "jy_ma": -0.002117, "duration_s": 60, "rate_hz": 200}]
        }
    )

    jx_ma: Number
    jy_ma: Number
    u_jx_ma: Positive | None = None
    u_jy_ma: Positive | None = None
    dof_jx: Positive | None = None
    dof_jy: Positive | None = None
    duration_s: Positive | None = None
    rate_hz: Positive | None = None
    started_at: Moment | None = None
    temperature_c: Celsius | None = None
    repeat: Repeat | None = None
    note: Text = ""


class Measurement(Outgoing):
    """One revision of one position. Without currents it takes the position back."""

    id: int
    theta_deg: float
    psi_deg: float
    repeat: int
    revision: int
    jx_ma: float | None
    jy_ma: float | None
    u_jx_ma: float | None
    u_jy_ma: float | None
    duration_s: float | None
    rate_hz: float | None
    started_at: datetime | None = Field(validation_alias="measured_at")
    temperature_c: float | None
    record_sha256: str | None = Field(validation_alias="record")
    origin: str
    note: str
    created_at: datetime
    created_by: str


class MeasuredRecord(Measurement):
    """A measurement made of a record of currents, and what was noticed in the record."""

    warnings: list[Warned]


class Position(Outgoing):
    """A position of a session: its certified angles, and the newest measurement if there is one."""

    number: int
    theta_deg: float
    psi_deg: float
    repeat: int
    certified: CertificatePosition
    measurement: Measurement | None


class SessionDetail(Session):
    """A session with its positions, and its results, the newest first."""

    positions: list[Position]
    results: list[Summary]
    truth: dict[str, Any] | None


class Uploaded(Outgoing):
    """What came of a whole session that was uploaded; `job` reads a long one in the background."""

    session: Session
    measured: list[Measurement]
    job: Job | None
    warnings: list[Warned]
