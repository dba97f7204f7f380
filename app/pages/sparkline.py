"""A parameter's last year in a table's cell: a line, its limits, a mark at the end."""

from dataclasses import dataclass
from datetime import timedelta
from typing import Final

from app.services.views import HistorySeries

WIDTH: Final = 84
HEIGHT: Final = 20
_LEFT, _RIGHT, _TOP, _BOTTOM = 3.0, 77.0, 2.0, 18.0
_YEAR: Final = timedelta(days=366)


@dataclass(frozen=True, slots=True)
class Sparkline:
    """Path of the line, px; heights of the limits that are in sight; the last point and its verdict."""

    path: str
    limits: tuple[float, ...]
    end: tuple[float, float]
    fails: bool
    points: int


def sparkline(series: HistorySeries) -> Sparkline | None:
    """The last year of a series; None without a value."""
    points = [
        (item.measured_at, item.value, item.verdict) for item in series.points if item.value is not None
    ]
    if not points:
        return None
    last = points[-1][0]
    points = [item for item in points if last - item[0] <= _YEAR]
    values = [value for _, value, _ in points]
    low, high = min(values), max(values)
    margin = 0.25 * (high - low) or abs(high) * 0.01 or 1.0
    # A limit comes in sight when the values are near it.
    near = [
        limit
        for limit in (series.low, series.high)
        if limit is not None and low - 2 * margin <= limit <= high + 2 * margin
    ]
    low, high = min([low, *near]) - margin / 4, max([high, *near]) + margin / 4

    def y(value: float) -> float:
        return round(_BOTTOM - (value - low) / (high - low) * (_BOTTOM - _TOP), 1)

    first, span = points[0][0], (last - points[0][0]).total_seconds() or 1.0

    def x(moment_s: float) -> float:
        return round(_RIGHT - (1 - moment_s / span) * (_RIGHT - _LEFT), 1) if len(points) > 1 else _RIGHT

    places = [(x((moment - first).total_seconds()), y(value)) for moment, value, _ in points]
    path = "M" + "L".join(f"{px} {py}" for px, py in places)
    return Sparkline(
        path, tuple(y(limit) for limit in near), places[-1], points[-1][2] == "fails", len(points)
    )
