"""Whose change it is: a stand and its gyros together."""

from datetime import datetime
from typing import Annotated, Any, Literal

from pydantic import Field

from app.api.schemas.common import Incoming, Outgoing, Since, Until
from app.api.schemas.drift import Alarm, Event

By = Literal["session", "day", "week", "month", "year"]


class StandPeriod(Incoming):
    """Which part of a stand's drift; a day as the end counts to its end, UTC."""

    since: Annotated[Since, Field(alias="from", description="Not before this time or day.")] = None
    until: Annotated[Until, Field(alias="to", description="Not after this time or day.")] = None
    by: Annotated[
        By | None,
        Field(
            description="What a point stands for; without it the finest that gives 200 points at the most."
        ),
    ] = None


class StandPoint(Outgoing):
    """Sessions taken together; `session`, `calibration`, `gyro` and `certificate` are of the last one.

    `values` and `u`: azimuth, level_north and level_east of the base in arcsec against the certificate (level_east
    against its gyros' means). `common`: by parameter the mean of its gyros' deviations from their own courses in
    standard deviations of one; between ± `limits` while they do nothing together.
    """

    at: datetime
    until: datetime
    sessions: int
    gyros: int
    session: int
    calibration: int
    gyro: str
    certificate: str
    values: dict[str, float | None]
    u: dict[str, float | None]
    common: dict[str, float | None]
    limits: dict[str, float | None]


class StandSession(Outgoing):
    """A session on the stand."""

    session: int
    calibration: int
    gyro: str
    at: datetime


class StandDrift(Outgoing):
    """A stand's drift.

    `document` holds what was found: `findings`, each with its `verdict` (stand, certificate, gyro, unclear, none), its
    `direction` (azimuth, level-north, level-east, certificate, own), the days between which it happened, its size
    in arcsec and its probability; and `detectable`, the smallest turns that these sessions reveal. Null before the
    first study. With `reduced` the points are the newest 200 of the period only: a coarser `by` or a shorter period
    shows the others, and CSV and Parquet hold every session. `affected` are the sessions since the last change of the
    stand that no event explains, the newest first.
    """

    stand: str
    method: str
    up_to_date: bool
    studied_at: datetime | None
    sessions: int
    document: dict[str, Any] | None
    by: By
    reduced: bool
    points: list[StandPoint]
    events: list[Event]
    alarms: list[Alarm]
    affected_since: datetime | None
    affected: list[StandSession]
