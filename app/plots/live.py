"""Currents as a station reports them: the settling at the present position.

A live page is sent the chart once and then only its news: rows and values for the drawing that stands.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any, Final, Literal

from app.plots import theme
from app.plots.template import axis_range, filled, template_of
from app.plots.theme import Spec

HEIGHT_PX: Final = 72
SHORTEST_S: Final = 60.0
_SCALED_TO: Final = 10
_GAP_S: Final = 5.0
"""Readings further apart than this are not joined: nobody knows what was between them."""


@dataclass(frozen=True, slots=True)
class LivePoint:
    """A reported current: seconds since the first at this position, value in the unit of the axis."""

    t_s: float
    value: float
    settled: bool


def news(points: Sequence[LivePoint]) -> dict[str, Any]:
    """What the chart shows of these points, the oldest first: its ``datasets`` and its ``params``.

    The axis shows the settled points, of which there may be none yet, and the last ones: a transient comes
    in from outside and does not flatten what follows it.
    """
    shown = [*(item.value for item in points if item.settled), *(item.value for item in points[-_SCALED_TO:])]
    low, high = axis_range(shown, margin=0.25)
    first, last = (points[0].t_s, points[-1].t_s) if points else (0.0, 0.0)
    settled = next((item.t_s for item in points if item.settled), None)
    return {
        "datasets": {
            "trace": _rows(points),
            "now": [{"t": points[-1].t_s, "v": points[-1].value}] if points else [],
            "settled": [] if settled is None else [{"t": settled}],
        },
        "params": {
            "low": low, "high": high, "first": first, "last": max(last, first + SHORTEST_S),
            "blank": not points,
        },
    }  # fmt: skip


def _rows(points: Sequence[LivePoint]) -> list[dict[str, float]]:
    rows: list[dict[str, float]] = []
    piece = 0
    for number, item in enumerate(points):
        if number and item.t_s - points[number - 1].t_s > _GAP_S:
            piece += 1
        rows.append({"t": item.t_s, "v": item.value, "piece": piece})
    return rows


def live(points: Sequence[LivePoint], channel: Literal["x", "y"], description: str) -> Spec:
    """One channel's currents since the stand came to the present position.

    Parameters
    ----------
    points
        The oldest first.
    channel
        Channel y bears the time axis of both.
    description
        What the chart shows, for whoever does not see it.
    """
    found = news(points)
    return filled(template(channel), data=found["datasets"], values=found["params"], description=description)


@cache
def template(channel: str) -> Spec:
    """The chart without its data, made once."""
    import altair as alt

    colour = theme.colour("series-1" if channel == "x" else "series-2")
    x_scale = alt.Scale(domain=[alt.ExprRef("first"), alt.ExprRef("last")], nice=False, zero=False)
    y_scale = alt.Scale(domain=[alt.ExprRef("low"), alt.ExprRef("high")], nice=False, zero=False)
    timed = channel == "y"
    x_axis = alt.Axis(
        title=None, ticks=timed, labels=timed, tickSize=4, labelPadding=4, labelFlush=True, tickCount=6
    )
    y_axis = alt.Axis(
        title=None, minExtent=52, maxExtent=52, tickCount=3, labelExpr="blank ? '' : datum.label"
    )

    x = alt.X("t:Q", scale=x_scale, axis=x_axis)
    y = alt.Y("v:Q", scale=y_scale, axis=y_axis)
    line: Spec = {"color": colour, "strokeWidth": 1.5, "clip": True, "aria": False}
    point = theme.X_POINT if channel == "x" else theme.Y_POINT
    layers = [
        alt.Chart(alt.NamedData("settled")).mark_rule(**theme.EVENT_LINE, aria=False).encode(x=x),
        alt.Chart(alt.NamedData("trace")).mark_line(**line).encode(x=x, y=y, detail="piece:N"),
        alt.Chart(alt.NamedData("now")).mark_point(**point, aria=False).encode(x=x, y=y),
    ]
    return template_of(layers, height=HEIGHT_PX, values=_DEFAULTS)


_DEFAULTS: Final = {"low": 0.0, "high": 1.0, "first": 0.0, "last": SHORTEST_S, "blank": True}
