"""A gyro's drift: values over time, what was found of them, events, baselines, alarms."""

from datetime import date, datetime
from typing import Annotated, Any, Literal

from pydantic import ConfigDict, Field

from app.api.schemas.common import Id, Incoming, Moment, Name, Outgoing, Text
from app.api.schemas.results import Verdict
from app.services.drift.alarms import CAUSES
from app.services.drift.baselines import ESTIMATORS, LIMITS
from app.services.drift.events import KINDS

Method = Literal["least-squares", "generalised", "robust", "paper"]
By = Literal["session", "start", "day", "month", "year"]


class Event(Outgoing):
    """Something on the axis of time.

    `id` is null for what the sessions themselves tell (kind certificate, stand or solver); its `note`
    says what is new, and `session` is the first one after it.
    """

    id: int | None
    kind: str
    at: datetime
    gyro: str | None
    stand: str | None
    note: str
    session: int | None
    created_at: datetime | None
    created_by: str
    withdrawn_at: datetime | None
    withdrawn_by: str | None


class NewEvent(Incoming):
    """What happened, and when; a method is the way that a gyro is measured."""

    model_config = ConfigDict(
        json_schema_extra={
            "examples": [
                {"kind": "repair", "happened_at": "2026-03-01T09:30:00Z", "note": "bearing replaced"}
            ]
        }
    )

    kind: Annotated[str, Field(json_schema_extra={"enum": list(KINDS)})]
    happened_at: Moment
    note: Text = ""


class Baseline(Outgoing):
    """What a parameter is judged against, with everything that was chosen for it."""

    id: int
    gyro: str
    parameter: str
    unit: str
    method: str
    valid_from: datetime
    calibrations: list[int]
    sessions: list[int]
    estimator: str
    centre: float
    scatter: float
    dof: float
    u_typical: float
    within: Annotated[float, Field(description="Scatter of the sessions of one start; 0 where none has two.")]
    count: Annotated[int, Field(description="Starts among these sessions that determined the parameter.")]
    limits: str
    rules: dict[str, Any]
    reason: str
    frozen_at: datetime
    frozen_by: str
    retired_at: datetime | None
    retired_by: str | None


class NewBaseline(Incoming):
    """What to freeze: for these parameters the results of these sessions.

    `rules` names the run rules of the individual values, and the settings of EWMA and CUSUM; without it
    the product's own choice is taken. Sessions are judged from `valid_from` on, or from the first one chosen.
    """

    model_config = ConfigDict(
        json_schema_extra={
            "examples": [
                {"parameters": ["w0x", "w0y"], "calibrations": [1, 2, 3, 4, 5], "reason": "after acceptance"}
            ]
        }
    )

    parameters: Annotated[list[Name], Field(min_length=1, max_length=8)]
    calibrations: Annotated[list[Id], Field(min_length=1, max_length=10_000)]
    method: Method = "least-squares"
    estimator: Annotated[str, Field(json_schema_extra={"enum": list(ESTIMATORS)})] = "paule-mandel"
    limits: Annotated[str, Field(json_schema_extra={"enum": list(LIMITS)})] = "prediction"
    rules: dict[str, Any] | None = None
    valid_from: Moment | None = None
    reason: Text = ""


class ProposedBaseline(Outgoing):
    """The first stretch of sessions without an event, and what it would give for each parameter."""

    gyro: str
    method: str
    since: datetime
    until: datetime
    calibrations: list[int]
    parameters: dict[str, dict[str, float]]


class Alarm(Outgoing):
    """A finding that a person acknowledges with a cause.

    `detail` says it in a sentence. `calibration` raised it, `last_calibration` is the last result that
    shows it.
    """

    id: int
    gyro: str | None
    stand: str | None
    parameter: str | None
    unit: str | None
    method: str
    kind: str
    severity: Literal["serious", "warning", "notice"]
    detail: str
    baseline: int | None
    calibration: int
    session: int
    at: datetime
    last_calibration: int
    last_session: int
    last_at: datetime
    raised_at: datetime
    state: Literal["open", "acknowledged", "replaced", "lapsed"]
    ended_at: datetime | None
    acknowledged_at: datetime | None
    acknowledged_by: str | None
    cause: str | None
    note: str


class Acknowledgement(Incoming):
    """What caused an alarm, in a person's judgement."""

    model_config = ConfigDict(json_schema_extra={"examples": [{"cause": "repair", "note": "see report 12"}]})

    cause: Annotated[str, Field(json_schema_extra={"enum": list(CAUSES)})]
    note: Text = ""


class DriftPoint(Outgoing):
    """A session's value, or the weighted mean of several sessions.

    `charts` holds the control charts' statistics and limits at this value, `signals` the rules it breaks.
    """

    calibration: int
    session: int
    at: datetime
    until: datetime
    sessions: int
    start: int
    stand: str
    certificate: str
    revisions: int
    value: float
    standard_uncertainty: float | None = Field(validation_alias="u")
    coverage_factor: float = Field(validation_alias="k")
    expanded_uncertainty: float | None = Field(validation_alias="expanded")
    scatter: float | None
    verdict: Verdict
    charts: dict[str, float | None]
    signals: list[str]


class ParameterDrift(Outgoing):
    """A parameter over a period, and what was found of it over the gyro's whole life (`study`).

    `sessions` of the period determined it; with `reduced` the points are the lowest and the highest of
    equal spans of time, of all and of those that broke a rule.
    """

    parameter: str
    unit: str
    low: float | None
    high: float | None
    repeatability: float | None
    sessions: int
    reduced: bool
    points: list[DriftPoint]
    study: dict[str, Any] | None


class GyroDrift(Outgoing):
    """A gyro's drift by one method; `up_to_date` tells whether everything that came in is taken in.

    `due`: the last day on which its last sound calibration holds, as in the list of what is due.
    """

    gyro: str
    type: str
    method: str
    methods: list[str]
    by: str
    up_to_date: bool
    studied_at: datetime | None
    solver_version: str | None
    sessions: int
    since: datetime | None
    until: datetime | None
    interval: dict[str, Any] | None
    due: date | None
    parameters: list[ParameterDrift]
    events: list[Event]
    baselines: list[Baseline]
    alarms: list[Alarm]


class Replaced(Outgoing):
    """A result that counts no more, and the one that counts in its place."""

    session: int
    measured_at: datetime
    calibration: int
    revision: int
    replaced_by: int | None
    parameter: str
    value: float | None
    standard_uncertainty: float | None = Field(validation_alias="u")
    coverage_factor: float = Field(validation_alias="k")


class ComponentLine(Outgoing):
    """One source of scatter of one parameter: standard deviation with its 95 % interval, F-test."""

    parameter: str
    unit: str
    source: str
    sd: float | None
    low: float | None
    high: float | None
    dof: float | None
    f: float | None
    p_value: float | None
    confounded_with: list[str]
