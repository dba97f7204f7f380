"""A type's gyros as a table: one row for each, the same for pages and programs."""

from datetime import datetime
from typing import Final

from app.exchange.si import PARAMETER_UNITS
from app.services.drift.fleet_views import Fleet, FleetGyro
from solver.records import PARAMETERS

Cell = float | int | str | datetime | None

_SUFFIXES: Final = {"deg/h/mA": "deg_per_h_per_ma", "deg/h": "deg_per_h", "deg/h/g": "deg_per_h_per_g"}


def field(name: str) -> str:
    """The name of a parameter's column, with its unit."""
    return f"{name}_{_SUFFIXES[PARAMETER_UNITS[name][0]]}"


_PARTS: Final = ("", "_u", "_slope_per_year", "_u_slope_per_year", "_scatter")
COLUMNS: Final = (
    "gyro", "type", "check", "verdict", "due", "due_state", "sessions", "session", "calibration", "measured_at",
    "alarms", "recommended_days", *(f"{field(name)}{part}" for name in PARAMETERS for part in _PARTS),
)  # fmt: skip


def rows(fleet: Fleet) -> list[dict[str, Cell]]:
    """A row for each gyro, in the order of `COLUMNS`."""
    return [_row(gyro) for gyro in fleet.gyros]


def _row(gyro: FleetGyro) -> dict[str, Cell]:
    due = gyro.due
    row: dict[str, Cell] = {
        "gyro": due.gyro, "type": due.type, "check": int(due.check), "verdict": gyro.verdict,
        "due": due.due.isoformat() if due.due else None, "due_state": due.state, "sessions": gyro.sessions,
        "session": due.session, "calibration": due.calibration, "measured_at": due.measured_at,
        "alarms": gyro.alarms, "recommended_days": gyro.recommended_days,
    }  # fmt: skip
    for name in PARAMETERS:
        item = gyro.parameters.get(name)
        cells = (
            (item.value.value, item.value.u, item.slope, item.u_slope, item.scatter) if item else (None,) * 5
        )
        row |= {f"{field(name)}{part}": cell for part, cell in zip(_PARTS, cells, strict=True)}
    return row
