"""A parameter of a gyro over time: value with its expanded uncertainty, limits, events."""

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime
from functools import cache
from typing import Any, Final, Literal

from app.plots import theme
from app.plots.template import axis_range, filled, template_of
from app.plots.theme import Spec

HEIGHT_PX: Final = 104
_AXIS_PX: Final = 52
_NEAR: Final = 0.75
"""A limit farther from the points than this part of their range is told in words, not drawn."""


@dataclass(frozen=True, slots=True)
class DriftPoint:
    """One session's value ± U, in the parameter's unit; U None where it is unknown."""

    moment: datetime
    value: float
    expanded: float | None
    state: Literal["within", "conditional", "beyond"]
    name: str
    label: str
    href: str


@dataclass(frozen=True, slots=True)
class DriftLimit:
    """A limit of the type; `side` is where the values beyond it lie."""

    value: float
    side: Literal["below", "above"]
    label: str


@dataclass(frozen=True, slots=True)
class DriftEvent:
    """Something that changed at the stand, or with the gyro, at a moment."""

    moment: datetime
    label: str


def drift(
    points: Sequence[DriftPoint],
    events: Sequence[DriftEvent],
    limits: Sequence[DriftLimit],
    period: tuple[datetime, datetime],
    description: str,
    *,
    with_dates: bool = True,
) -> Spec:
    """One panel of a drift history; panels of one page share `period`, so their dates agree.

    Parameters
    ----------
    limits
        Each is drawn where it is near the points.
    with_dates
        Whether the dates stand below: under the last panel of several.
    """
    reach = [
        point.value + side * (point.expanded or 0.0) for point in points for side in (-1, 1)
    ]  # fmt: skip
    near = [limit for limit in limits if _is_near(limit.value, reach)]
    low, high = axis_range([*reach, *(limit.value for limit in near)])
    return filled(
        template(with_dates),
        data={
            "line": [_row(point) for point in points],
            "within": [_row(point) for point in points if point.state == "within"],
            "conditional": [_row(point) for point in points if point.state == "conditional"],
            "beyond": [_row(point) for point in points if point.state == "beyond"],
            "limits": [
                {
                    "y": limit.value,
                    "edge": high if limit.side == "above" else low,
                    "t": _stamp(period[0]),
                    "text": limit.label,
                }
                for limit in near
            ],
            "events": [{"t": _stamp(event.moment), "text": event.label} for event in events],
        },
        values={"low": low, "high": high, "first": _stamp(period[0]), "last": _stamp(period[1])},
        description=description,
    )  # fmt: skip


def _is_near(limit: float, reach: Sequence[float]) -> bool:
    if not reach:
        return True
    span = (max(reach) - min(reach)) or abs(limit) * 0.01
    return min(reach) - _NEAR * span <= limit <= max(reach) + _NEAR * span


def _stamp(moment: datetime) -> int:
    return round(moment.timestamp() * 1000)


def _row(point: DriftPoint) -> dict[str, Any]:
    spread = point.expanded or 0.0
    return {
        "t": _stamp(point.moment),
        "v": point.value,
        "low": point.value - spread,
        "high": point.value + spread,
        "name": point.name,
        "label": point.label,
        "href": point.href,
    }


@cache
def template(with_dates: bool) -> Spec:
    """The chart without its data, made once."""
    import altair as alt

    dates = alt.Axis(
        title=None,
        labelExpr=(
            "month(datum.value) == 0 || datum.index == 0 "
            "? [timeFormat(datum.value, '%b'), timeFormat(datum.value, '%Y')] : timeFormat(datum.value, '%b')"
        ),
        tickCount=alt.TimeIntervalStep(interval="month", step=1),
        labelOverlap="parity",
        labelAlign="left",
        labelFlush=False,
        labelPadding=4,
        ticks=True,
        tickSize=4,
    )
    x_scale = alt.Scale(type="time", domain=[alt.ExprRef("first"), alt.ExprRef("last")], nice=False)
    y_scale = alt.Scale(domain=[alt.ExprRef("low"), alt.ExprRef("high")], nice=False, zero=False)
    y_axis = alt.Axis(title=None, minExtent=_AXIS_PX, maxExtent=_AXIS_PX, tickCount=4)

    def rows(name: str) -> Any:
        return alt.Chart(alt.NamedData(name))

    def x(name: str = "t") -> Any:
        return alt.X(f"{name}:T", scale=x_scale, axis=dates if with_dates else None)

    def y(name: str = "v") -> Any:
        return alt.Y(f"{name}:Q", scale=y_scale, axis=y_axis)

    def points(name: str, look: Spec, line: str) -> list[Any]:
        base = rows(name).encode(x=x())
        bar: Spec = {"color": theme.colour(line), "strokeWidth": 1, "aria": False}
        cap: Spec = {
            "color": theme.colour(line),
            "thickness": 1,
            "size": 6,
            "orient": "horizontal",
            "aria": False,
        }
        return [
            base.mark_rule(**bar).encode(y=y("low"), y2="high:Q"),
            *(base.mark_tick(**cap).encode(y=y(end)) for end in ("low", "high")),
            base.mark_point(**look, aria=False).encode(y=y()),
            base.mark_point(**theme.TARGET).encode(
                y=y(), href=alt.Href("href:N"), description=alt.Description("name:N"),
                tooltip=alt.Tooltip("name:N"),
            ),
        ]  # fmt: skip

    limits, events = rows("limits"), rows("events")
    layers = [
        limits.mark_rect(**theme.WASH, clip=True, aria=False).encode(y=y("y"), y2="edge:Q"),
        limits.mark_rule(**theme.LIMIT_LINE, aria=False).encode(y=y("y")),
        events.mark_rule(**theme.EVENT_LINE, aria=False).encode(x=x()),
        rows("line").mark_line(**theme.JOIN, aria=False).encode(x=x(), y=y()),
        *points("within", theme.X_POINT, "series-1"),
        *points("conditional", theme.CONDITIONAL_POINT, "attention"),
        *points("beyond", theme.BEYOND_POINT, "vermillion"),
        limits.mark_text(**theme.BEYOND_LABEL, align="left", dx=5, dy=-8, aria=False).encode(
            x=x(), y=y("y"), text="text:N"
        ),
        events.mark_text(**theme.LABEL, align="left", baseline="top", dx=4, dy=0, aria=False).encode(
            x=x(), y=alt.value(0), text="text:N"
        ),
    ]  # fmt: skip
    chart = alt.layer(*layers).properties(height=HEIGHT_PX)
    return template_of(
        chart.add_params(
            alt.param(name="low", value=-1.0),
            alt.param(name="high", value=1.0),
            alt.param(name="first", value=0),
            alt.param(name="last", value=1),
        )
    )
