"""What the drift history shows: frozen, in laboratory units, with no tie to the database.

Sentences are English templates with their values, to be translated where they are shown. Among the values
``unit`` is a unit's code (``deg/h``), ``day``, ``since`` and their like are days in ISO 8601, and what was
measured is a `Quantity` with its uncertainty.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from datetime import datetime
from typing import Any, TypedDict

from app import figures
from app.services.views import COVERAGE_FACTOR, JobView, Verdict


class Quantity(TypedDict):
    """A measured number among a sentence's values, for `figures.measured`; a change is shown with its sign."""

    value: float | None
    expanded: float | None
    sign: bool


def quantity(
    value: float | None, u: float | None, k: float = COVERAGE_FACTOR, *, change: bool = False
) -> Quantity:
    """A `Quantity` with U = k·u; of a u that is not known (None, NaN) there is none."""
    return Quantity(value=value, expanded=k * u if u is not None and math.isfinite(u) else None, sign=change)


@dataclass(frozen=True, slots=True)
class EventView:
    """Something on the axis of time.

    Attributes
    ----------
    id
        None for what the sessions themselves tell (`derived`).
    kind
        Entered: repair, adjustment, moved, method, other. Derived: certificate, stand, solver.
    at
        When; of a derived one the first session that it was found in.
    gyro, stand
        Whose it is, the one or the other. A derived one is its gyro's, and `note` says what is new: the
        certificate's number, the stand's name, the solver's version.
    session
        Of a derived one the first session after it.
    """

    id: int | None
    kind: str
    at: datetime
    gyro: str | None
    stand: str | None
    note: str
    created_at: datetime | None = None
    created_by: str = ""
    session: int | None = None
    withdrawn_at: datetime | None = None
    withdrawn_by: str | None = None

    @property
    def derived(self) -> bool:
        """Whether the sessions tell it, and nobody entered it."""
        return self.id is None


@dataclass(frozen=True, slots=True)
class BaselineView:
    """What a parameter is judged against, with everything that was chosen for it.

    `sessions` are those of `calibrations`, the results that it was computed from: a result that is corrected
    later stays the baseline's. `count` is the number of starts among them that determined the parameter,
    `within` the scatter of the sessions of one start.
    """

    id: int
    gyro: str
    parameter: str
    unit: str
    method: str
    valid_from: datetime
    calibrations: tuple[int, ...]
    sessions: tuple[int, ...]
    estimator: str
    centre: float
    scatter: float
    dof: float
    u_typical: float
    within: float
    count: int
    limits: str
    rules: Mapping[str, Any]
    reason: str
    frozen_at: datetime
    frozen_by: str
    retired_at: datetime | None
    retired_by: str | None


@dataclass(frozen=True, slots=True)
class ProposedBaseline:
    """A stretch that would do for a baseline: its sessions, and what they would give for each parameter."""

    gyro: str
    method: str
    since: datetime
    until: datetime
    calibrations: tuple[int, ...]
    parameters: Mapping[str, Mapping[str, float]]


@dataclass(frozen=True, slots=True)
class AlarmView:
    """A finding that a person acknowledges with a cause.

    `calibration` raised it, `last_calibration` is the last one that shows it. `state` is open,
    acknowledged, replaced (the value that raised it was replaced by a correction) or lapsed (nothing
    shows it any more). `severity` is serious, warning or notice.
    """

    id: int
    gyro: str | None
    stand: str | None
    parameter: str | None
    unit: str | None
    method: str
    kind: str
    severity: str
    baseline: int | None
    calibration: int
    session: int
    at: datetime
    last_calibration: int
    last_session: int
    last_at: datetime
    template: str
    values: Mapping[str, Any]
    raised_at: datetime
    state: str
    ended_at: datetime | None
    acknowledged_at: datetime | None
    acknowledged_by: str | None
    cause: str | None
    note: str

    @property
    def detail(self) -> str:
        """Its sentence in English."""
        values = {
            name: str(figures.measured(**value)) if isinstance(value, dict) else value
            for name, value in self.values.items()
        }
        return self.template % values if values else self.template


@dataclass(frozen=True, slots=True)
class DriftPoint:
    """A value on a chart: one session's, or the weighted mean of several.

    Attributes
    ----------
    calibration, session, start, stand, certificate, revisions
        Of the session; of the last one of several.
    at, until
        When it was measured; of several the first and the last.
    sessions
        How many it stands for.
    value, u, k
        The value, its standard uncertainty and coverage factor; `scatter` is the standard deviation of several.
    verdict
        Against the limits of the type.
    charts
        By the name of a chart's column (`app.services.drift.charting.CHARTS`): its statistic and limits.
    signals
        Rules that it breaks, as codes: ``nelson-1``, ``ewma`` …
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
    value: float | None
    u: float | None
    k: float
    scatter: float | None
    verdict: Verdict
    charts: Mapping[str, float | None]
    signals: tuple[str, ...]

    @property
    def expanded(self) -> float | None:
        """U = k·u."""
        return None if self.u is None else self.k * self.u


@dataclass(frozen=True, slots=True)
class ParameterDrift:
    """A parameter over a period.

    Attributes
    ----------
    low, high, repeatability
        Limits of the type: for the value, and for its standard deviation from session to session.
    sessions
        How many sessions of the period determined it; `points` may be fewer, `reduced` says so.
    statistics
        By the name of a chart's column, of those that were asked for, the points that show it in as few.
    newest, broken
        Of the newest sessions of the period, and of the newest that broke a rule, one point each, as many as were
        asked for, whatever `points` are; `breaking` is how many broke one.
    study
        What was found of it over its whole life (the document's entry); None before the first study.
    """

    parameter: str
    unit: str
    low: float | None
    high: float | None
    repeatability: float | None
    sessions: int
    reduced: bool
    points: tuple[DriftPoint, ...]
    statistics: Mapping[str, tuple[DriftPoint, ...]]
    newest: tuple[DriftPoint, ...]
    broken: tuple[DriftPoint, ...]
    breaking: int
    study: Mapping[str, Any] | None


@dataclass(frozen=True, slots=True)
class GyroDrift:
    """A gyro's drift by one method, for a period.

    Attributes
    ----------
    up_to_date
        Whether the study has taken everything in; `job` is the one that makes the next.
    studied_at, solver_version, document
        Of the study; None before the first one.
    methods
        Those that the gyro has results of.
    sessions
        How many its whole life has, and `from_`, `until` when the first and the last were.
    """

    gyro: str
    type: str
    method: str
    methods: tuple[str, ...]
    by: str
    up_to_date: bool
    studied_at: datetime | None
    solver_version: str | None
    job: JobView | None
    sessions: int
    since: datetime | None
    until: datetime | None
    document: Mapping[str, Any] | None
    parameters: tuple[ParameterDrift, ...]
    events: tuple[EventView, ...]
    baselines: tuple[BaselineView, ...]
    alarms: tuple[AlarmView, ...]


@dataclass(frozen=True, slots=True)
class ReplacedValue:
    """A result that counts no more: a later revision from other input, or by the same method, replaced it.

    `replaced_by` is the one that counts in its place; None when the session has none by the method.
    """

    session: int
    measured_at: datetime
    calibration: int
    revision: int
    replaced_by: int | None
    parameter: str
    value: float | None
    u: float | None
    k: float
