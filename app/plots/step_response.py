"""A step response of both axes: deflections or measured rates by time (paper, figures 4 and 5)."""

from collections.abc import Sequence
from functools import cache
from typing import Any, Final

from app.plots import theme
from app.plots.template import axis_range, filled, template_of
from app.plots.theme import Spec

HEIGHT_PX: Final = 264
_DASHES: Final = {"x": [1, 0], "y": [7, 3]}
Curve = Sequence[tuple[float, float]]


def step_response(
    x: Curve, y: Curve, final: Sequence[float], cut: tuple[float, str] | None, description: str
) -> Spec:
    """Two curves over time, in the units of the axes.

    Parameters
    ----------
    x, y
        Time and value of the quantity about each axis.
    final
        Values that the curves tend to; empty where there are none.
    cut
        Where an unstable response is cut off, and the words that say so.
    """
    low, high = axis_range([0.0, *final, *(value for _, value in (*x, *y))], margin=0.05)
    last = max((time for time, _ in (*x, *y)), default=1.0)
    return filled(
        template(),
        data={
            "x": [{"t": time, "v": value} for time, value in x],
            "y": [{"t": time, "v": value} for time, value in y],
            "final": [{"v": value} for value in final],
            "zero": [{"v": 0.0}],
            "cut": [] if cut is None else [{"t": cut[0], "text": cut[1]}],
        },
        values={"last": last, "low": low, "high": high},
        description=description,
    )


@cache
def template() -> Spec:
    """The chart without its data, made once."""
    import altair as alt

    x = alt.X(
        "t:Q", scale=alt.Scale(domain=[0.0, alt.ExprRef("last")], nice=False),
        axis=alt.Axis(title=None, ticks=True, tickSize=4, labelPadding=4, tickCount=6, labelOverlap=True,
                      labelFlush=True),
    )  # fmt: skip
    y = alt.Y(
        "v:Q", scale=alt.Scale(domain=[alt.ExprRef("low"), alt.ExprRef("high")], nice=False),
        axis=alt.Axis(title=None, minExtent=44, maxExtent=44, tickCount=5),
    )  # fmt: skip

    def line(name: str) -> Any:
        colour = theme.colour("series-1" if name == "x" else "series-2")
        return (
            alt.Chart(alt.NamedData(name))
            .mark_line(color=colour, strokeWidth=1.5, strokeDash=_DASHES[name], aria=False)
            .encode(x=x, y=y)
        )

    cut = alt.Chart(alt.NamedData("cut")).encode(x=x)
    layers = [
        alt.Chart(alt.NamedData("zero")).mark_rule(**theme.ZERO_LINE, aria=False).encode(y=y),
        alt.Chart(alt.NamedData("final")).mark_rule(**theme.EVENT_LINE, aria=False).encode(y=y),
        line("x"),
        line("y"),
        cut.mark_rule(**theme.LIMIT_LINE, aria=False),
        cut.mark_text(**theme.LABEL, align="right", baseline="top", dx=-6, aria=False).encode(
            y=alt.value(2), text="text:N"
        ),
    ]
    return template_of(layers, height=HEIGHT_PX, values=dict.fromkeys(("last", "low", "high"), 1.0))
