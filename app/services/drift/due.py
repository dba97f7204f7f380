"""When each gyro has to be calibrated again.

A calibration is sound when the session's newest result determines every parameter, whatever the verdict:
a gyro that lies beyond its limits is known to. The due day is that of the last sound session plus
the interval of the gyro's type.
"""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import date, datetime, timedelta
from typing import Final, Literal

from app.services.lab import Work
from app.store import fleet
from app.store.fleet import LastSound

DUE_SOON_DAYS: Final = 30
"""A gyro is due soon when so many days or fewer are left."""

State = Literal["overdue", "never", "due-soon", "valid", "no-interval"]
STATES: Final[tuple[State, ...]] = ("overdue", "never", "due-soon", "valid", "no-interval")
"""The most urgent first."""


@dataclass(frozen=True, slots=True)
class Due:
    """When a gyro is due.

    Attributes
    ----------
    session, calibration, measured_at, stand
        Of the last sound calibration; None: there is none.
    interval_days
        Of the type; None when nobody has said.
    due
        The last day on which the calibration holds; None without a calibration or an interval.
    days
        From today to that day, negative when it is past.
    state
        ``overdue``, ``never`` calibrated, ``due-soon``, ``valid``, or ``no-interval`` to judge by.
    """

    gyro: str
    type: str
    check: bool
    session: int | None
    calibration: int | None
    measured_at: datetime | None
    stand: str | None
    interval_days: int | None
    due: date | None
    days: int | None
    state: State


def due_list(work: Work, *, type_name: str | None = None) -> tuple[Due, ...]:
    """Every gyro, or a type's, the most urgent first."""
    found = [_due(row, work.now.date()) for row in fleet.last_sound(work.db, type_name=type_name)]
    return tuple(sorted(found, key=_urgency))


def urgent(work: Work) -> tuple[Due, ...]:
    """The gyros with which something is to be done: overdue, never calibrated, due soon."""
    return tuple(item for item in due_list(work) if item.state in STATES[:3])


def due_of(work: Work, serials: Sequence[str]) -> Mapping[str, Due]:
    """When these gyros are due, by serial number."""
    rows = fleet.last_sound(work.db, serials=serials)
    return {row.serial: _due(row, work.now.date()) for row in rows}


def counts(found: Sequence[Due]) -> Mapping[State, int]:
    """How many gyros there are in each state."""
    return Counter(item.state for item in found)


def _due(row: LastSound, today: date) -> Due:
    until = days = None
    if row.measured_at is not None and row.interval_days is not None:
        until = row.measured_at.date() + timedelta(days=row.interval_days)
        days = (until - today).days
    return Due(
        row.serial, row.type_name, row.check, row.session, row.calibration, row.measured_at, row.stand,
        row.interval_days, until, days, _state(row, days),
    )  # fmt: skip


def _state(row: LastSound, days: int | None) -> State:
    if row.session is None:
        return "never"
    if days is None:
        return "no-interval"
    if days < 0:
        return "overdue"
    return "due-soon" if days <= DUE_SOON_DAYS else "valid"


def _urgency(item: Due) -> tuple[int, int, str]:
    return STATES.index(item.state), item.days or 0, item.gyro
