"""All gyros of a type, and two results compared."""

from datetime import datetime
from typing import Annotated, Literal

from pydantic import Field

from app.api.schemas.common import Incoming, Outgoing
from app.api.schemas.due import Due, State
from app.api.schemas.results import Parameter, Verdict


class Standing(Outgoing):
    """One parameter of one gyro, in its laboratory unit.

    `standing`: distance from the middle of the limits as a part of their half width, 1 at a limit. `slope` per
    year, of the last stretch of its course; `scatter`: standard deviation from session to session. Null before
    the gyro's drift was studied.
    """

    value: Parameter
    standing: float | None
    slope: float | None
    u_slope: float | None
    p_slope: float | None
    scatter: float | None
    scatter_dof: float | None
    repeatability: str | None
    steps: int


class FleetGyro(Outgoing):
    """One gyro of a type."""

    due: Due
    verdict: Verdict | None
    parameters: dict[str, Standing]
    sessions: int | None
    recommended_days: int | None
    alarms: int
    up_to_date: bool


class Distribution(Outgoing):
    """How a parameter lies over the gyros, and the serial numbers of those that stand out.

    `sd` is the standard deviation of their values, `between` its part beyond their uncertainties; `quartiles` are the
    lower one, the median, the upper one.
    """

    parameter: str
    unit: str
    low: float | None
    high: float | None
    gyros: int
    mean: float | None
    sd: float | None
    between: float | None
    p_normal: float | None
    quartiles: tuple[float, float, float] | None
    nearest: str | None
    farthest: str | None
    drifting: str | None
    steadiest: str | None
    scattering: str | None
    repeating: str | None


class Pooled(Outgoing):
    """A component of variance of all gyros together; `together` is what one session differs from another by."""

    source: str
    sd: float
    low: float | None
    high: float | None
    dof: float
    gyros: int
    p_value: float | None


class Correlated(Outgoing):
    """Two parameters over the gyros; `p_holm` counts that all pairs were looked at, `sure`: it is below 5 %."""

    first: str
    second: str
    coefficient: float
    p_value: float
    p_holm: float
    gyros: int
    sure: bool


class TypeInterval(Outgoing):
    """Calibration interval of a type: entered, and as the histories of its gyros recommend it.

    0 days: none keeps the gyro within its limits; `median_days` is of the others.
    """

    stated_days: int | None
    shortest_days: int | None
    shortest_gyro: str | None
    median_days: int | None
    gyros: int


class Fleet(Outgoing):
    """All gyros of a type by serial number, what they have in common, and how many are due.

    Drift, repeatability and alarms are by `method`, of a gyro without results by it by the first of generalised,
    robust, paper that it has any of.
    """

    type: str
    method: str
    up_to_date: bool
    counts: dict[State, int]
    interval: TypeInterval
    gyros: list[FleetGyro]
    distributions: list[Distribution]
    pooled: dict[str, list[Pooled]]
    correlations: list[Correlated]


_Subject = Annotated[
    str,
    Field(
        max_length=120, description="`session:78`, `result:91`, or `gyro:0417`: its last sound calibration."
    ),
]


class CompareQuery(Incoming):
    """Which two."""

    a: _Subject
    b: _Subject


class Side(Outgoing):
    """One of the two results."""

    asked: str
    gyro: str
    type: str
    session: int
    calibration: int
    measured_at: datetime
    start: int
    stand: str
    certificate: str
    method: str
    verdict: Verdict


class Compared(Outgoing):
    """One parameter of both: a − b with its expanded uncertainty (95 %), and the difference in units of it.

    `e_n` as ISO 13528 has it, from both stated U. `shared` is the standard uncertainty that both have in common
    and that was taken off. `scatter` is the gyro's own standard deviation from session to session, `in_scatter` the
    difference in units of √2 of it.
    """

    parameter: str
    unit: str
    a: Parameter
    b: Parameter
    difference: float | None
    expanded_uncertainty: float | None = Field(validation_alias="expanded")
    coverage_factor: float | None
    dof: float | None
    in_expanded: float | None
    e_n: float | None
    p_value: float | None
    p_holm: float | None
    shared: float
    scatter: float | None
    in_scatter: float | None
    verdict: Literal["agree", "differ", "undetermined"]


class Comparison(Outgoing):
    """Two results compared; `common` are the lines of both budgets that come from the same thing."""

    a: Side
    b: Side
    verdict: Literal["agree", "differ", "undetermined"]
    chi2: float | None
    dof: int | None
    p_value: float | None
    common: list[str]
    taken_off: bool
    parameters: list[Compared]
