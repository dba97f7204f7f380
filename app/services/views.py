"""What services show: frozen, in laboratory units, with no tie to the database."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from datetime import date, datetime
from typing import Any, Generic, Literal, NamedTuple, TypeVar

from app.exchange.rows import CertificateRow
from app.services.live_views import RunBrief

T = TypeVar("T")

COVERAGE_FACTOR = 2.0
"""k of what has no budget of its own: a measured current, a result of solver 1.0.0; about 95 %."""

Verdict = Literal["conforms", "conditional", "fails", "no-limit", "undetermined"]
SessionState = Literal["measuring", "ready", "solving", "solved", "failed"]


@dataclass(frozen=True, slots=True)
class Page(Generic[T]):
    """Part of a list; `next` is the cursor of the following part, None at the end."""

    items: tuple[T, ...]
    next: str | None


class Nominal(NamedTuple):
    """What a parameter of a type is expected to be, in its laboratory unit.

    `u` is the standard deviation between gyros; `per_kelvin` its temperature coefficient, None when
    it is not known.
    """

    value: float
    u: float
    per_kelvin: float | None = None


@dataclass(frozen=True, slots=True)
class TypeView:
    """A type of gyro; `limits` maps a parameter to (low, high), `nominals` to what is expected of it.

    `interval_days` is how long a calibration holds, None when nobody has said; `repeatability` maps a
    parameter to the largest standard deviation that it may have from session to session.
    """

    name: str
    note: str
    gyros: int
    limits: Mapping[str, tuple[float, float]]
    nominals: Mapping[str, Nominal]
    interval_days: int | None = None
    repeatability: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class ParameterView:
    """One parameter of one result: value, u, k and U = k·u, limits of the type, verdict.

    `value` is None when the data do not determine it, `u` when no uncertainty can be given.
    """

    name: str
    value: float | None
    u: float | None
    k: float
    unit: str
    low: float | None
    high: float | None
    verdict: Verdict

    @property
    def expanded(self) -> float | None:
        """U = k·u."""
        return None if self.u is None else self.k * self.u


@dataclass(frozen=True, slots=True)
class ResultSummary:
    """A result in one line of a list. `offending` are the parameters that made the verdict."""

    id: int
    revision: int
    method: str
    solved_at: datetime
    verdict: Verdict
    offending: tuple[str, ...]
    parameters: Mapping[str, ParameterView]


@dataclass(frozen=True, slots=True)
class GyroView:
    """A gyro, and its latest result. `check` marks one that is kept to watch the stands."""

    serial: str
    type: str
    note: str
    created_at: datetime
    last_session: int | None
    last_measured_at: datetime | None
    last_stand: str | None
    last_result: ResultSummary | None
    check: bool = False


class CommonAngles(NamedTuple):
    """Standard uncertainties of what the certified angles of all positions share, arcsec; None: not stated."""

    u_alpha_common_arcsec: float | None = None
    u_beta_common_arcsec: float | None = None
    u_gamma_common_arcsec: float | None = None


NONE_IN_COMMON = CommonAngles()


@dataclass(frozen=True, slots=True)
class CertificateView:
    """One version of a stand's certificate. `valid` says whether it is valid today."""

    stand: str
    number: str
    version: int
    valid_from: date
    valid_until: date
    issued_by: str
    digest: str
    created_at: datetime
    created_by: str
    valid: bool
    common: CommonAngles
    positions: tuple[CertificateRow, ...]


@dataclass(frozen=True, slots=True)
class StandView:
    """A stand, the certificate that is valid today, and what is stated of its uncertainty."""

    name: str
    latitude_deg: float
    note: str
    created_at: datetime
    certificate: CertificateView | None
    uncertainty: Mapping[str, Any]


@dataclass(frozen=True, slots=True)
class ProblemView:
    """A problem as it was stored: code, translatable template with its values, place."""

    code: str
    template: str
    values: Mapping[str, Any]
    file: str | None
    row: int | None
    column: str | None


@dataclass(frozen=True, slots=True)
class JobView:
    """One call answers: queued, running with progress, succeeded, failed with a reason, cancelled."""

    id: str
    kind: str
    state: str
    progress: float
    phase: str
    session: int | None
    calibration: int | None
    problems: tuple[ProblemView, ...]
    created_at: datetime
    created_by: str
    started_at: datetime | None
    finished_at: datetime | None

    @property
    def ended(self) -> bool:
        """Whether nothing more will happen."""
        return self.state in ("succeeded", "failed", "cancelled")


@dataclass(frozen=True, slots=True)
class MeasurementView:
    """One revision of one position. `withdrawn` means that the person took it back."""

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
    measured_at: datetime | None
    temperature_c: float | None
    record: str | None
    origin: str
    note: str
    created_at: datetime
    created_by: str

    @property
    def withdrawn(self) -> bool:
        """Whether this revision takes the position back."""
        return self.jx_ma is None


@dataclass(frozen=True, slots=True)
class PositionView:
    """One position of a session: its number, certified angles and newest measurement."""

    number: int
    theta_deg: float
    psi_deg: float
    repeat: int
    certified: CertificateRow
    measurement: MeasurementView | None


@dataclass(frozen=True, slots=True)
class SessionView:
    """A session in one line of a list."""

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
    state: SessionState
    job: JobView | None
    result: ResultSummary | None
    station: RunBrief | None


@dataclass(frozen=True, slots=True)
class SessionDetail:
    """A session with every position and every result."""

    session: SessionView
    certificate: CertificateView
    positions: tuple[PositionView, ...]
    revisions: tuple[MeasurementView, ...]
    results: tuple[ResultSummary, ...]
    truth: Mapping[str, Any] | None


@dataclass(frozen=True, slots=True)
class CalibrationView:
    """A result with its provenance. `result` is the result document, in laboratory units."""

    id: int
    session: SessionView
    certificate: CertificateView
    revision: int
    replaces: int | None
    replaced_by: int | None
    method: str
    solver_version: str
    input_hash: str
    result_digest: str
    created_at: datetime
    created_by: str
    summary: ResultSummary
    result: Mapping[str, Any]
    inputs: tuple[MeasurementView, ...]


@dataclass(frozen=True, slots=True)
class HistoryPoint:
    """One session's value of one parameter."""

    calibration: int
    session: int
    measured_at: datetime
    start: int
    stand: str
    certificate: str
    value: float | None
    u: float | None
    k: float
    verdict: Verdict

    @property
    def expanded(self) -> float | None:
        """U = k·u."""
        return None if self.u is None else self.k * self.u


@dataclass(frozen=True, slots=True)
class HistorySeries:
    """A parameter of a gyro over time, oldest first, with its type's limits."""

    parameter: str
    unit: str
    low: float | None
    high: float | None
    points: tuple[HistoryPoint, ...]
