"""A record of currents: the range that each stretch of it covers, so that no spike is lost."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any, Final, Literal

from app.plots import theme
from app.plots.template import axis_range, filled, template_of
from app.plots.theme import Spec

HEIGHT_PX: Final = 168


@dataclass(frozen=True, slots=True)
class Stretch:
    """A part of the time axis that opens enlarged."""

    since_s: float
    until_s: float
    name: str
    href: str


def record(
    t_s: Sequence[float],
    low: Sequence[float],
    high: Sequence[float],
    channel: Literal["x", "y"],
    mean: float | None,
    stretches: Sequence[Stretch],
    description: str,
) -> Spec:
    """One channel's envelope over time; with as many samples as bins it is the samples themselves.

    Parameters
    ----------
    t_s
        Where each bin begins, s.
    low, high
        Extremes in each bin, in the unit of the axis.
    mean
        Of the whole record, drawn as a line.
    stretches
        Links that enlarge a part.
    """
    bottom, top = axis_range([*low, *high, *([] if mean is None else [mean])])
    return filled(
        template(channel),
        data={
            "trace": [{"t": t, "l": a, "h": b} for t, a, b in zip(t_s, low, high, strict=True)],
            "mean": [] if mean is None else [{"v": mean}],
            "stretches": [
                {"a": part.since_s, "b": part.until_s, "name": part.name, "href": part.href}
                for part in stretches
            ],
        },
        values={"low": bottom, "high": top, "first": t_s[0], "last": t_s[-1]},
        description=description,
    )


@cache
def template(channel: str) -> Spec:
    """The chart without its data, made once."""
    import altair as alt

    colour = theme.colour("series-1" if channel == "x" else "series-2")
    x_scale = alt.Scale(domain=[alt.ExprRef("first"), alt.ExprRef("last")], nice=False, zero=False)
    y_scale = alt.Scale(domain=[alt.ExprRef("low"), alt.ExprRef("high")], nice=False, zero=False)
    x_axis = alt.Axis(title=None, ticks=True, tickSize=4, labelPadding=4, labelFlush=True)
    y_axis = alt.Axis(title=None, minExtent=52, maxExtent=52, tickCount=5)

    def x(name: str) -> Any:
        return alt.X(f"{name}:Q", scale=x_scale, axis=x_axis)

    def y(name: str) -> Any:
        return alt.Y(f"{name}:Q", scale=y_scale, axis=y_axis)

    trace = alt.Chart(alt.NamedData("trace"))
    edge: Spec = {"color": colour, "strokeWidth": 1, "clip": True, "aria": False}
    layers = [
        trace.mark_area(fill=colour, fillOpacity=0.35, clip=True, aria=False).encode(
            x=x("t"), y=y("l"), y2="h:Q"
        ),
        *(trace.mark_line(**edge).encode(x=x("t"), y=y(name)) for name in ("l", "h")),
        alt.Chart(alt.NamedData("mean")).mark_rule(**theme.ZERO_LINE, aria=False).encode(y=y("v")),
        alt.Chart(alt.NamedData("stretches"))
        .mark_rect(fill="transparent", opacity=1)
        .encode(
            x=x("a"), x2="b:Q", href=alt.Href("href:N"), description=alt.Description("name:N"),
            tooltip=alt.Tooltip("name:N"),
        ),
    ]  # fmt: skip
    ranges = {"low": 0.0, "high": 1.0, "first": 0.0, "last": 1.0}
    return template_of(layers, height=HEIGHT_PX, values=ranges)
