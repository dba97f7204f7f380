"""Allan deviation by averaging time, both axes logarithmic, with the record's own averaging time marked."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any, Final, Literal

from app.plots import theme
from app.plots.template import filled, template_of
from app.plots.theme import Spec

HEIGHT_PX: Final = 280
_LOOKS: Final = {"x": (theme.X_POINT, [1, 0]), "y": (theme.Y_POINT, [7, 3])}
_DECADES_ONLY: Final = (
    "abs(log(datum.value) / LN10 - round(log(datum.value) / LN10)) < 1e-6 ? format(datum.value, '~g') : ''"
)
_ONE_TWO_FIVE: Final = (
    "indexof([1, 2, 5], round(1e6 * datum.value / pow(10, floor(log(datum.value) / LN10 + 1e-9))) / 1e6) >= 0"
    " ? format(datum.value, '~g') : ''"
)


@dataclass(frozen=True, slots=True)
class AllanPoint:
    """σ(τ) with its interval, in the unit of the axis, and what it says in words."""

    channel: Literal["x", "y"]
    tau_s: float
    value: float
    low: float
    high: float
    name: str


@dataclass(frozen=True, slots=True)
class MeanPoint:
    """u of the record's mean, drawn at the record's duration."""

    channel: Literal["x", "y"]
    value: float
    name: str


def allan(
    points: Sequence[AllanPoint],
    means: Sequence[MeanPoint],
    models: Sequence[tuple[Literal["x", "y"], Sequence[tuple[float, float]]]],
    duration_s: float,
    duration_label: str,
    description: str,
) -> Spec:
    """Both channels' Allan deviations with intervals, the fitted model as lines, u of the means.

    Parameters
    ----------
    points
        Only with values above zero: the axes are logarithmic.
    means
        Of the channels whose u is known.
    models
        Per channel τ in s and σ of the fitted noise model.
    duration_s, duration_label
        Where the averaging time is marked, and with which words.
    """
    shown = [point for point in points if point.value > 0.0]
    values = [part for point in shown for part in (point.low, point.high)] + [mean.value for mean in means]
    first = min([point.tau_s for point in shown], default=duration_s / 10.0)
    return filled(
        template(),
        data={
            **{
                f"points_{channel}": [
                    {"t": p.tau_s, "v": p.value, "l": p.low, "h": p.high, "name": p.name}
                    for p in shown
                    if p.channel == channel
                ]
                for channel in _LOOKS
            },
            **{
                f"mean_{channel}": [
                    {"t": duration_s, "v": mean.value, "name": mean.name}
                    for mean in means
                    if mean.channel == channel
                ]
                for channel in _LOOKS
            },
            **{
                f"model_{channel}": [
                    {"t": tau, "v": value}
                    for owner, curve in models
                    if owner == channel
                    for tau, value in curve
                    if value > 0.0
                ]
                for channel in _LOOKS
            },
            "duration": [{"t": duration_s, "text": duration_label}],
        },
        values={
            "first": first / 1.4,
            "last": duration_s * 1.6,
            "low": min(values, default=0.1) / 1.3,
            "high": max(values, default=1.0) * 1.3,
        },
        description=description,
    )


@cache
def template() -> Spec:
    """The chart without its data, made once."""
    import altair as alt

    x_scale = alt.Scale(type="log", domain=[alt.ExprRef("first"), alt.ExprRef("last")], nice=False)
    y_scale = alt.Scale(type="log", domain=[alt.ExprRef("low"), alt.ExprRef("high")], nice=False)
    x = alt.X(
        "t:Q", scale=x_scale,
        axis=alt.Axis(title=None, labelExpr=_DECADES_ONLY, labelPadding=4, labelOverlap=True, tickCount=8),
    )  # fmt: skip
    y_axis = alt.Axis(title=None, minExtent=44, maxExtent=44, tickCount=8, labelExpr=_ONE_TWO_FIVE)

    def y(name: str) -> Any:
        return alt.Y(f"{name}:Q", scale=y_scale, axis=y_axis)

    def series(channel: str) -> list[Any]:
        look, dash = _LOOKS[channel]
        colour = theme.colour("series-1" if channel == "x" else "series-2")
        points = alt.Chart(alt.NamedData(f"points_{channel}"))
        named = {"description": alt.Description("name:N"), "tooltip": alt.Tooltip("name:N")}
        line: Spec = {"color": colour, "strokeWidth": 1.25, "strokeDash": dash, "clip": True, "aria": False}
        return [
            alt.Chart(alt.NamedData(f"model_{channel}")).mark_line(**line).encode(x=x, y=y("v")),
            points.mark_rule(color=colour, strokeWidth=1, aria=False).encode(x=x, y=y("l"), y2="h:Q"),
            points.mark_point(**look).encode(x=x, y=y("v"), **named),
            alt.Chart(alt.NamedData(f"mean_{channel}")).mark_point(**look).encode(x=x, y=y("v"), **named),
        ]

    marked = alt.Chart(alt.NamedData("duration"))
    layers = [
        marked.mark_rule(**theme.EVENT_LINE, aria=False).encode(x=x),
        marked.mark_text(**theme.LABEL, align="right", baseline="top", dx=-6, aria=False).encode(
            x=x, y=alt.value(2), text="text:N"
        ),
        *(layer for channel in _LOOKS for layer in series(channel)),
    ]
    return template_of(layers, height=HEIGHT_PX, values=dict.fromkeys(("first", "last", "low", "high"), 1.0))
