"""What all gyros of a stand do together: each deviates from its own course, their average shows the stand."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from functools import cache
from typing import Any, Final

from app.plots import dates, theme
from app.plots.dates import stamp
from app.plots.drift_marks import DriftChange, DriftEvent
from app.plots.template import axis_range, filled, template_of
from app.plots.theme import Spec

HEIGHT_PX: Final = 160
_AXIS_PX: Final = 52


@dataclass(frozen=True, slots=True)
class CommonPoint:
    """A mean of several sessions' deviations, in standard deviations of one; `limit` on either side of zero.

    `beyond` says that the mean lies outside: the gyros do not scatter about their own courses alone.
    """

    moment: datetime
    value: float
    limit: float
    beyond: bool
    name: str
    href: str


def common_mode(
    means: Sequence[CommonPoint],
    singles: Sequence[tuple[datetime, float]],
    events: Sequence[DriftEvent],
    period: tuple[datetime, datetime],
    description: str,
    *,
    changes: Sequence[DriftChange] = (),
    with_dates: bool = True,
) -> Spec:
    """Means as linked points between their limits, the single sessions as small rings behind them.

    Parameters
    ----------
    singles
        Moment and deviation of single sessions; empty where there are too many to be drawn.
    """
    reach = [side * point.limit for point in means for side in (-1, 1)]
    low, high = axis_range([*(point.value for point in means), *reach, *(value for _, value in singles), 0.0])
    data: Mapping[str, Sequence[Mapping[str, Any]]] = {
        "singles": [{"t": stamp(moment), "v": value} for moment, value in singles],
        "means": [
            {"t": stamp(item.moment), "v": item.value, "low": -item.limit, "high": item.limit,
             "name": item.name, "href": item.href, "beyond": item.beyond}
            for item in means
        ],
        "zero": [{"v": 0.0}],
        "events": [{"t": stamp(item.moment), "text": item.label, "solid": item.solid} for item in events],
        "changes": [{"t": stamp(item.before), "t2": stamp(item.until), "text": item.label} for item in changes],
    }  # fmt: skip
    return filled(
        template(with_dates, dates.step_of(period) if with_dates else 1),
        data=data,
        values={"low": low, "high": high, "first": stamp(period[0]), "last": stamp(period[1])},
        description=description,
    )


@cache
def template(with_dates: bool, step: int) -> Spec:
    """The chart without its data, made once; `step` months lie between two ticks."""
    import altair as alt

    x_scale = alt.Scale(type="time", domain=[alt.ExprRef("first"), alt.ExprRef("last")], nice=False)
    y_scale = alt.Scale(domain=[alt.ExprRef("low"), alt.ExprRef("high")], nice=False, zero=False)
    y_axis = alt.Axis(title=None, minExtent=_AXIS_PX, maxExtent=_AXIS_PX, tickCount=5)
    x = alt.X("t:T", scale=x_scale, axis=dates.axis(step) if with_dates else None)

    def rows(name: str) -> Any:
        return alt.Chart(alt.NamedData(name))

    def y(name: str = "v") -> Any:
        return alt.Y(f"{name}:Q", scale=y_scale, axis=y_axis)

    means, events, changes = rows("means").encode(x=x), rows("events"), rows("changes")
    single: Spec = {"shape": "circle", "size": 14, "filled": False, "stroke": theme.colour("edge"),
                    "strokeWidth": 1, "opacity": 1}  # fmt: skip
    layers = [
        # Not a field: two fields on an axis of stated ends make Vega-Lite warn of a conflict.
        changes.mark_rect(**theme.WASH, clip=True, aria=False).encode(
            x=x, x2=alt.value(alt.ExprRef("scale('x', datum.t2)"))
        ),
        rows("zero").mark_rule(**theme.ZERO_LINE, aria=False).encode(y=y()),
        *(
            means.mark_line(**theme.CONTROL_LINE, interpolate="step", aria=False).encode(y=y(side))
            for side in ("low", "high")
        ),
        rows("singles").mark_point(**single, aria=False).encode(x=x, y=y()),
        events.transform_filter("!datum.solid").mark_rule(**theme.EVENT_LINE, aria=False).encode(x=x),
        events.transform_filter("datum.solid").mark_rule(**theme.CHANGE_LINE, aria=False).encode(x=x),
        means.mark_line(**theme.JOIN, aria=False).encode(y=y()),
        means.transform_filter("!datum.beyond").mark_point(**theme.X_POINT, aria=False).encode(y=y()),
        means.transform_filter("datum.beyond").mark_point(**theme.BEYOND_POINT, aria=False).encode(y=y()),
        means.mark_point(**theme.TARGET).encode(
            y=y(), href=alt.Href("href:N"), description=alt.Description("name:N"), tooltip=alt.Tooltip("name:N")
        ),
        events.mark_text(**theme.LABEL, align="left", baseline="bottom", dx=4, aria=False).encode(
            x=x, y=alt.value(-3), text="text:N"
        ),
        changes.mark_text(**theme.BEYOND_LABEL, align="left", baseline="bottom", dx=4, aria=False).encode(
            x=x, y=alt.value(alt.ExprRef("height")), text="text:N"
        ),
    ]  # fmt: skip
    ranges = dict.fromkeys(("low", "high", "first", "last"), 0.0)
    return template_of(layers, height=HEIGHT_PX, values=ranges)
