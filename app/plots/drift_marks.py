"""What a drift history shows: sessions, limits, baselines, events, changes, a forecast."""

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime
from typing import Literal


@dataclass(frozen=True, slots=True)
class DriftPoint:
    """One session's value ± U, in the parameter's unit; U None where it is unknown or has no meaning.

    A line joins the points of one `part`: a repair begins another.
    """

    moment: datetime
    value: float
    expanded: float | None
    state: Literal["within", "conditional", "beyond"]
    name: str
    label: str
    href: str
    part: int = 0


@dataclass(frozen=True, slots=True)
class DriftLimit:
    """A limit of the type; `side` is where the values beyond it lie."""

    value: float
    side: Literal["below", "above"]
    label: str


@dataclass(frozen=True, slots=True)
class DriftEvent:
    """Something that changed at the stand, or with the gyro, at a moment.

    What changed the gyro itself (a repair, an adjustment) is drawn `solid`.
    """

    moment: datetime
    label: str
    solid: bool = False


@dataclass(frozen=True, slots=True)
class ControlStretch:
    """Control limits of one baseline over the stretch that it judges.

    `steps` are (from when, lower, upper limit): each holds until the next, the last one until `until`.
    A chart without a limit on one side has None there.
    """

    centre: float
    steps: Sequence[tuple[datetime, float | None, float | None]]
    until: datetime


@dataclass(frozen=True, slots=True)
class DriftChange:
    """A step that was found: it happened after `before` and not later than `until`."""

    before: datetime
    until: datetime
    label: str


@dataclass(frozen=True, slots=True)
class Forecast:
    """The course to come with its prediction band."""

    moments: Sequence[datetime]
    values: Sequence[float]
    low: Sequence[float]
    high: Sequence[float]
