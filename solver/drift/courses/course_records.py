"""A history described: what `solver.drift.courses.course.describe` gives."""

from dataclasses import dataclass
from typing import Literal

from solver.drift.courses.paths import Path
from solver.drift.courses.trend import Model, TrendTest
from solver.records import Array


@dataclass(frozen=True, slots=True)
class Change:
    """A change of level or of slope.

    Attributes
    ----------
    kind
        ``step``: the level changed between two values; ``bend``: the slope changed from the value before on.
    index : int
        First value after it.
    time, before : float
        Of that value and of the one before it, s: it happened between them.
    size, u : float
        New less old level, in the quantity's unit, or slope, per second; standard uncertainty, given the date.
    p_value : float
        Probability that chance alone makes a change so clear at any date; for a step at a given break, at this one.
    dates : tuple of (int, float)
        Probabilities of the dates, as indices of the first value after it, that have 0.001 or more.
    at_break : bool
        Whether it lies at one of the given breaks.
    """

    kind: Literal["step", "bend"]
    index: int
    time: float
    before: float
    size: float
    u: float
    p_value: float
    dates: tuple[tuple[int, float], ...]
    at_break: bool


@dataclass(frozen=True, slots=True)
class Outlier:
    """A wild value, which does not count for the course; of a wild start each of its values.

    Attributes
    ----------
    index : int
    time, size, u, p_value : float
        When, s; value, or mean of its start, less course; standard uncertainty of that; probability that chance alone
        makes any value so wild.
    """

    index: int
    time: float
    size: float
    u: float
    p_value: float


@dataclass(frozen=True, slots=True)
class Course:
    """A history described.

    Attributes
    ----------
    level : float
        Of the tests.
    changes, outliers
        In the order of time. A break given is always among the changes, whatever its p.
    model
        Of the last stretch: ``constant``, ``linear`` or ``exponential``.
    since, since_time, count : int, float, int
        First value of the last stretch, its time, s, and how many of its values count.
    origin : float
        Time, s, to which the coefficients refer: of the last value; for the exponential, of the first.
    coefficients, covariance : (p,) and (p, p) array
        Level; or level and slope, per second; or level A, amplitude B and time constant T, s, of
        ``A + B·exp(−(t − origin)/T)``.
    slope, u_slope, slope_p : float
        Of the course at the last value, per second, whether significant or not; its standard uncertainty; and the
        probability of a slope so large where there is none.
    scatter : float
        τ; of starts, where some have several values.
    within : float
        τ_w of values within one start; 0 where no start has two.
    agreement : float
        Factor of the variances u² + τ², less than 1 where the values agree better than their uncertainties.
    dof : int
        Degrees of freedom of the course.
    tests : tuple of TrendTest
        By which the model was chosen.
    fitted, u_fitted : (n,) array
        The course at each value, and its standard uncertainty.
    paths : tuple of Path
        For forecasts.
    last : float
        Time of the last value, s.
    """

    level: float
    changes: tuple[Change, ...]
    outliers: tuple[Outlier, ...]
    model: Model
    since: int
    since_time: float
    count: int
    origin: float
    coefficients: Array
    covariance: Array
    slope: float
    u_slope: float
    slope_p: float
    scatter: float
    agreement: float
    dof: int
    tests: tuple[TrendTest, ...]
    fitted: Array
    u_fitted: Array
    paths: tuple[Path, ...]
    last: float
    within: float

    @property
    def time_constant(self) -> float | None:
        """T, s, of exponential ageing."""
        return float(self.coefficients[2]) if self.model == "exponential" else None
