"""The trade between two uncertainties: sets of positions that no other betters in both, and some for comparison."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any, Final, Literal

from app.plots import theme
from app.plots.template import axis_range, filled, template_of
from app.plots.theme import Spec

HEIGHT_PX: Final = 320
LOOKS: Final = {
    "front": theme.X_POINT,
    "paper": {**theme.Y_POINT, "size": 80},
    "all": {**theme.THIRD_POINT, "size": 60},
    "plan": {**theme.FOURTH_POINT, "size": 75},
}
"""Mark of each kind of set; the page's legend repeats them."""


@dataclass(frozen=True, slots=True)
class TradeMark:
    """One set: the two uncertainties, its name in words, a label beside the point, and where it leads."""

    kind: Literal["front", "paper", "all", "plan"]
    x: float
    y: float
    name: str
    label: str
    href: str


def pareto(points: Sequence[TradeMark], x_title: str, y_title: str, description: str) -> Spec:
    """Both uncertainties of every set; a stair joins those that no other betters in both.

    Parameters
    ----------
    x_title, y_title
        Quantity and unit of each axis.
    """
    x_low, x_high = axis_range([point.x for point in points])
    y_low, y_high = axis_range([point.y for point in points])
    front = sorted((point for point in points if point.kind == "front"), key=lambda point: point.x)
    stair = [{"x": point.x, "y": point.y} for point in front]
    if front:  # what the ends of the front leave open
        stair = [{"x": front[0].x, "y": y_high}, *stair, {"x": x_high, "y": front[-1].y}]
    middle = (x_low + x_high) / 2
    rows = {
        kind: [_row(point, left=point.x > middle) for point in points if point.kind == kind] for kind in LOOKS
    }
    return filled(
        template(x_title, y_title),
        data={"stair": stair, **rows},
        values={"xLow": x_low, "xHigh": x_high, "yLow": y_low, "yHigh": y_high},
        description=description,
    )  # fmt: skip


def _row(point: TradeMark, *, left: bool) -> dict[str, Any]:
    label = {"toLeft": point.label if left else "", "toRight": "" if left else point.label}
    return {"x": point.x, "y": point.y, "name": point.name, "href": point.href, **label}


@cache
def template(x_title: str, y_title: str) -> Spec:
    """The chart without its data, made once for each wording of its axes."""
    import altair as alt

    def scale(name: str) -> Any:
        return alt.Scale(
            domain=[alt.ExprRef(f"{name}Low"), alt.ExprRef(f"{name}High")], nice=False, zero=False
        )

    x_axis = alt.Axis(
        title=x_title, titleAnchor="end", tickCount=6, labelFlush=True, ticks=True, tickSize=4,
        labelOverlap=True,
    )  # fmt: skip
    y_axis = alt.Axis(
        title=y_title, titleAngle=0, titleAlign="left", titleAnchor="end", titleX=0, titleY=-8,
        titleBaseline="bottom", minExtent=52, maxExtent=52, tickCount=6,
    )  # fmt: skip
    x, y = alt.X("x:Q", scale=scale("x"), axis=x_axis), alt.Y("y:Q", scale=scale("y"), axis=y_axis)

    def points(kind: str) -> list[Any]:
        base = alt.Chart(alt.NamedData(kind)).encode(x=x, y=y)
        return [
            base.mark_point(**LOOKS[kind], aria=False),
            base.mark_text(**theme.LABEL, align="left", dx=9, aria=False).encode(text="toRight:N"),
            base.mark_text(**theme.LABEL, align="right", dx=-9, aria=False).encode(text="toLeft:N"),
            base.mark_point(**theme.TARGET).encode(
                href=alt.Href("href:N"), description=alt.Description("name:N"), tooltip=alt.Tooltip("name:N")
            ),
        ]

    stair = alt.Chart(alt.NamedData("stair")).encode(x=x, y=y)
    layers = [
        stair.mark_line(**theme.JOIN, interpolate="step-after", aria=False),
        *(layer for kind in LOOKS for layer in points(kind)),
    ]
    ranges = dict.fromkeys(("xLow", "xHigh", "yLow", "yHigh"), 0.0)
    spec = template_of(layers, height=HEIGHT_PX, values=ranges)
    return {**spec, "padding": {"left": 0, "top": 4, "right": 4, "bottom": 8}}  # room for the axes' titles
