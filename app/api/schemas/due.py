"""When gyros are due."""

from datetime import date, datetime
from typing import Literal

from pydantic import ConfigDict

from app.api.schemas.common import Outgoing

State = Literal["overdue", "never", "due-soon", "valid", "no-interval"]


class Due(Outgoing):
    """When a gyro has to be calibrated again: its last sound calibration plus its type's interval.

    `due` is the last day on which the calibration holds, `days` from today to it. A gyro is due soon when 30 days
    or fewer are left; `no-interval`: nobody has entered one for its type.
    """

    model_config = ConfigDict(
        json_schema_extra={
            "examples": [
                {
                    "gyro": "0417", "type": "GVK-6", "check": False, "state": "due-soon", "due": "2026-12-01",
                    "days": 9, "interval_days": 365, "session": 78, "calibration": 91,
                    "measured_at": "2025-12-01T09:30:00Z", "stand": "S1",
                }
            ]
        }
    )  # fmt: skip

    gyro: str
    type: str
    check: bool
    state: State
    due: date | None
    days: int | None
    interval_days: int | None
    session: int | None
    calibration: int | None
    measured_at: datetime | None
    stand: str | None
