"""What is shown of all gyros of a type: frozen, in laboratory units, with no tie to the database."""

from collections.abc import Mapping
from dataclasses import dataclass

from app.services.drift.due import Due, State
from app.services.views import ParameterView, Verdict


@dataclass(frozen=True, slots=True)
class Standing:
    """One parameter of one gyro: where it stands, where it goes, how well it repeats.

    Attributes
    ----------
    value
        Of the last sound calibration, with u, k, the limits of the type and the verdict.
    standing
        Distance from the middle of the limits as a part of their half width: 1 at a limit, more beyond;
        None without limits.
    slope, u_slope, p_slope
        Change per year of the last stretch of its course, its standard uncertainty, and the probability of
        such a slope when there is none; None before a study.
    scatter, scatter_dof
        Standard deviation from session to session about its course, and its degrees of freedom.
    repeatability
        Verdict against the type's largest standard deviation, as its study gives it; None before one.
    steps
        How many steps and bends were found in its life.
    """

    value: ParameterView
    standing: float | None
    slope: float | None
    u_slope: float | None
    p_slope: float | None
    scatter: float | None
    scatter_dof: float | None
    repeatability: str | None
    steps: int


@dataclass(frozen=True, slots=True)
class FleetGyro:
    """One gyro of a type. `sessions` and `recommended_days` are of its study; None before the first one."""

    due: Due
    verdict: Verdict | None
    parameters: Mapping[str, Standing]
    sessions: int | None
    recommended_days: int | None
    alarms: int
    up_to_date: bool

    @property
    def serial(self) -> str:
        """Its serial number."""
        return self.due.gyro


@dataclass(frozen=True, slots=True)
class Distribution:
    """How a parameter lies over the gyros.

    `mean` and `sd` of the gyros' values, `between` the part of `sd` beyond their uncertainties, quartiles with the
    median where there are enough, `p_normal` of a test of normality. `nearest` is the gyro that stands nearest to a
    limit or farthest beyond, `drifting` the one that changes fastest, `scattering` the one that repeats worst;
    `farthest`, `steadiest` and `repeating` are their opposites. None where nothing tells.
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


@dataclass(frozen=True, slots=True)
class Pooled:
    """A component of variance of all gyros together: standard deviation, its 95 % interval, degrees of freedom, gyros.

    `p_value` joins the gyros' F-tests of it; None where there is no test.
    """

    source: str
    sd: float
    low: float | None
    high: float | None
    dof: float
    gyros: int
    p_value: float | None


@dataclass(frozen=True, slots=True)
class Correlated:
    """Two parameters over the gyros: coefficient, its p-value alone and after Holm, and how many gyros.

    `sure` says that it is different from zero with all pairs looked at.
    """

    first: str
    second: str
    coefficient: float
    p_value: float
    p_holm: float
    gyros: int
    sure: bool


@dataclass(frozen=True, slots=True)
class TypeInterval:
    """The interval of a type: entered, and what its gyros' own histories recommend.

    `shortest` is the smallest recommendation with the gyro it comes from, `median` the middle one of
    those that hold at all, of two the shorter, `gyros` how many have one. 0 days: none keeps the gyro within limits.
    """

    stated_days: int | None
    shortest_days: int | None
    shortest_gyro: str | None
    median_days: int | None
    gyros: int


@dataclass(frozen=True, slots=True)
class Fleet:
    """All gyros of a type; by `method`, and those without results by it by the one that stands for them."""

    type: str
    method: str
    gyros: tuple[FleetGyro, ...]
    distributions: tuple[Distribution, ...]
    pooled: Mapping[str, tuple[Pooled, ...]]
    correlations: tuple[Correlated, ...]
    interval: TypeInterval
    counts: Mapping[State, int]

    @property
    def up_to_date(self) -> bool:
        """Whether every gyro's study has taken everything in."""
        return all(item.up_to_date for item in self.gyros)
