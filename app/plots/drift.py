"""A parameter of a gyro over time: value with its expanded uncertainty, limits, baselines, events, forecast.

The same chart serves the statistics of a control chart (moving range, EWMA, CUSUM): points without U.
"""

from collections.abc import Iterator, Mapping, Sequence
from datetime import datetime
from functools import cache
from typing import Any, Final

from app.plots import dates, theme
from app.plots.dates import stamp
from app.plots.drift_marks import ControlStretch, DriftChange, DriftEvent, DriftLimit, DriftPoint, Forecast
from app.plots.template import axis_range, filled, template_of
from app.plots.theme import Spec

HEIGHT_PX: Final = 104
_AXIS_PX: Final = 52
_NEAR: Final = 0.75
"""A limit farther from the points than this part of their range is told in words, not drawn."""

_STATES: Final = ("within", "conditional", "beyond")


def drift(
    points: Sequence[DriftPoint],
    events: Sequence[DriftEvent],
    limits: Sequence[DriftLimit],
    period: tuple[datetime, datetime],
    description: str,
    *,
    stretches: Sequence[ControlStretch] = (),
    changes: Sequence[DriftChange] = (),
    forecast: Forecast | None = None,
    today: DriftEvent | None = None,
    with_dates: bool = True,
    height: int | None = None,
) -> Spec:
    """One panel of a drift history; panels of one page share `period`, so their dates agree.

    Parameters
    ----------
    limits
        Each is drawn where it is near the points.
    stretches
        Control limits, each over what it judges.
    forecast
        Drawn as far as it leaves the points legible: it widens the range by half at most.
    today
        Where what was measured ends.
    with_dates
        Whether the dates stand below: under the last panel of several.
    height
        px, `HEIGHT_PX` unless told.
    """
    reach = [point.value + side * (point.expanded or 0.0) for point in points for side in (-1, 1)]
    reach += [limit for item in stretches for step in item.steps for limit in step[1:] if limit is not None]
    reach += _within_reach(forecast, reach)
    near = [limit for limit in limits if _is_near(limit.value, reach)]
    low, high = axis_range([*reach, *(limit.value for limit in near)])
    begin = stamp(period[0])
    data = {
        "line": [{"t": stamp(point.moment), "v": point.value, "part": point.part} for point in points],
        **{state: [_row(point) for point in points if point.state == state] for state in _STATES},
        "limits": [
            {"y": item.value, "edge": high if item.side == "above" else low, "t": begin, "text": item.label}
            for item in near
        ],
        "events": [
            {"t": stamp(event.moment), "text": event.label, "solid": event.solid} for event in events
        ],
        "control": [row for number, item in enumerate(stretches) for row in _steps(number, item)],
        "changes": [
            {"t": stamp(item.before), "t2": stamp(item.until), "text": item.label} for item in changes
        ],
        "forecast": list(_band(forecast)),
        "today": [{"t": stamp(item.moment), "text": item.label} for item in ([today] if today else [])],
    }  # fmt: skip
    spec = filled(
        template(with_dates, dates.step_of(period) if with_dates else 1),
        data=data,
        values={"low": low, "high": high, "first": begin, "last": stamp(period[1])},
        description=description,
        height=height,
    )
    # What has no rows is left out: a page holds eight of these.
    return {**spec, "layer": [layer for layer in spec["layer"] if _is_needed(layer, data)]}


def _is_needed(layer: Spec, data: Mapping[str, Sequence[Any]]) -> bool:
    name = layer["data"]["name"]
    return name == "line" or bool(data[name])


def _within_reach(forecast: Forecast | None, reach: Sequence[float]) -> list[float]:
    """As much of a forecast's band as widens the range by half of it on either side at most."""
    if forecast is None or not forecast.moments:
        return []
    if not reach:
        return [*forecast.low, *forecast.high]
    least, most = min(reach), max(reach)
    spare = 0.5 * (most - least)
    return [max(least - spare, min(forecast.low)), min(most + spare, max(forecast.high))]


def _is_near(limit: float, reach: Sequence[float]) -> bool:
    if not reach:
        return True
    span = (max(reach) - min(reach)) or abs(limit) * 0.01
    return min(reach) - _NEAR * span <= limit <= max(reach) + _NEAR * span


def _row(point: DriftPoint) -> dict[str, Any]:
    spread = point.expanded or 0.0
    return {
        "t": stamp(point.moment),
        "v": point.value,
        "low": point.value - spread,
        "high": point.value + spread,
        "name": point.name,
        "label": point.label,
        "href": point.href,
    }


def _steps(number: int, item: ControlStretch) -> Iterator[dict[str, Any]]:
    """Corners of the control limits: each step's beginning, and where the last one ends."""
    corners = [*item.steps, *((item.until, *step[1:]) for step in item.steps[-1:])]
    for moment, low, high in corners:
        yield {"t": stamp(moment), "low": low, "high": high, "centre": item.centre, "of": number}


def _band(forecast: Forecast | None) -> Iterator[dict[str, Any]]:
    if forecast is not None:
        columns = zip(forecast.moments, forecast.values, forecast.low, forecast.high, strict=True)
        for moment, value, low, high in columns:
            yield {"t": stamp(moment), "v": value, "low": low, "high": high}


@cache
def template(with_dates: bool, step: int) -> Spec:
    """The chart without its data, made once; `step` months lie between two ticks."""
    import altair as alt

    x_scale = alt.Scale(type="time", domain=[alt.ExprRef("first"), alt.ExprRef("last")], nice=False)
    y_scale = alt.Scale(domain=[alt.ExprRef("low"), alt.ExprRef("high")], nice=False, zero=False)
    y_axis = alt.Axis(title=None, minExtent=_AXIS_PX, maxExtent=_AXIS_PX, tickCount=4)

    def rows(name: str) -> Any:
        return alt.Chart(alt.NamedData(name))

    def x(axis: Any = alt.Undefined if with_dates else None) -> Any:
        return alt.X("t:T", scale=x_scale, axis=axis)

    def y(name: str = "v") -> Any:
        return alt.Y(f"{name}:Q", scale=y_scale, axis=y_axis)

    def points(name: str, look: Spec, line: str) -> list[Any]:
        base = rows(name).encode(x=x())
        bar: Spec = {"color": theme.colour(line), "strokeWidth": 1, "aria": False}
        cap: Spec = {**bar, "thickness": 1, "size": 6, "orient": "horizontal"}
        del cap["strokeWidth"]
        return [
            base.mark_rule(**bar).encode(y=y("low"), y2="high:Q"),
            *(base.mark_tick(**cap).encode(y=y(end)) for end in ("low", "high")),
            base.mark_point(**look, aria=False).encode(y=y()),
            base.mark_point(**theme.TARGET).encode(
                y=y(), href=alt.Href("href:N"), description=alt.Description("name:N"),
                tooltip=alt.Tooltip("name:N"),
            ),
        ]  # fmt: skip

    def control(name: str, look: Spec) -> Any:
        return (
            rows("control")
            .transform_filter(f"isValid(datum.{name})")
            .mark_line(**look, interpolate="step-after", clip=True, aria=False)
            .encode(x=x(), y=y(name), detail="of:N")
        )

    def named(name: str, look: Spec, height: Any, **place: Any) -> Any:
        written = rows(name).transform_filter("datum.text")
        text = written.mark_text(**look, align="left", dx=4, aria=False, **place)
        return text.encode(x=x(), y=height, text="text:N")

    limits, events, ahead = rows("limits"), rows("events"), rows("forecast")
    layers = [
        limits.mark_rect(**theme.WASH, clip=True, aria=False).encode(y=y("y"), y2="edge:Q"),
        # Not a field: two fields on an axis of stated ends make Vega-Lite warn of a conflict.
        rows("changes")
        .mark_rect(**theme.WASH, clip=True, aria=False)
        .encode(x=x(), x2=alt.value(alt.ExprRef("scale('x', datum.t2)"))),
        ahead.mark_area(**theme.FORECAST_BAND, clip=True, aria=False).encode(x=x(), y=y("low"), y2="high:Q"),
        ahead.mark_line(**theme.FORECAST_LINE, clip=True, aria=False).encode(x=x(), y=y()),
        control("centre", theme.CENTRE_LINE),
        control("low", theme.CONTROL_LINE),
        control("high", theme.CONTROL_LINE),
        limits.mark_rule(**theme.LIMIT_LINE, aria=False).encode(y=y("y")),
        rows("today").mark_rule(**theme.TODAY_LINE, aria=False).encode(x=x()),
        events.transform_filter("!datum.solid").mark_rule(**theme.EVENT_LINE, aria=False).encode(x=x()),
        events.transform_filter("datum.solid").mark_rule(**theme.CHANGE_LINE, aria=False).encode(x=x()),
        # This layer is always there, so it is the one that holds the axis of dates.
        rows("line")
        .mark_line(**theme.JOIN, aria=False)
        .encode(x=x(dates.axis(step) if with_dates else None), y=y(), detail="part:N"),
        *points("within", theme.X_POINT, "series-1"),
        *points("conditional", theme.CONDITIONAL_POINT, "attention"),
        *points("beyond", theme.BEYOND_POINT, "vermillion"),
        named("limits", theme.BEYOND_LABEL, y("y"), dy=-8),
        named("events", theme.LABEL, alt.value(-3), baseline="bottom"),
        named("today", theme.LABEL, alt.value(-3), baseline="bottom"),
        *(
            named("changes", look, alt.value(alt.ExprRef("height")), baseline="bottom", dy=-3)
            for look in (theme.LABEL_GROUND, theme.BEYOND_LABEL)
        ),
    ]
    return template_of(layers, height=HEIGHT_PX, values={"low": -1.0, "high": 1.0, "first": 0, "last": 1})
