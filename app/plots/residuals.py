"""Residuals by position: where the model and the currents disagree, and whether by more than noise."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from itertools import pairwise
from typing import Any, Final, Literal

from app.plots import theme
from app.plots.template import axis_range, filled, template_of
from app.plots.theme import Spec

LIMIT_SD: Final = 3.0
"""Where the dashed limits stand, in standard deviations of the residual."""
HEIGHT_PX: Final = 248


@dataclass(frozen=True, slots=True)
class Place:
    """One measured position, in the order of the axis.

    `sd` is the standard deviation of its residuals in °/h, None where it is unknown.
    """

    number: int
    theta: str
    psi: str
    sd: float | None


@dataclass(frozen=True, slots=True)
class Residual:
    """One equation's residual, °/h. `label` stands beside the point when it is beyond its limit."""

    number: int
    axis: Literal["x", "y"]
    value: float
    beyond: bool
    name: str
    label: str
    href: str


def decade(values: Sequence[float]) -> int:
    """Power of ten, a multiple of three, in which the largest value has one to three whole digits."""
    largest = max((abs(value) for value in values), default=0.0)
    if largest == 0.0:
        return 0
    exponent = 0
    while largest * 10.0**-exponent < 1.0 and exponent > -30:
        exponent -= 3
    while largest * 10.0**-exponent >= 1000.0:
        exponent += 3
    return exponent


def residuals(
    points: Sequence[Residual], places: Sequence[Place], exponent: int, description: str, beyond: str
) -> Spec:
    """Residuals of both equations at every position, with limits at `LIMIT_SD` standard deviations.

    Parameters
    ----------
    exponent
        The axis is in 10^exponent °/h.
    beyond
        Words for the region outside the limits.
    """
    scale = 10.0**-exponent
    turns = [later.number for earlier, later in pairwise(places) if earlier.theta != later.theta]
    limits = [LIMIT_SD * place.sd * scale for place in places if place.sd is not None]
    low, high = axis_range(
        [point.value * scale for point in points] + [side * limit for limit in limits for side in (-1, 1)]
    )
    numbers = [place.number for place in places]
    rows = [
        {"n": place.number, "high": LIMIT_SD * place.sd * scale, "low": -LIMIT_SD * place.sd * scale}
        for place in places
        if place.sd is not None
    ]
    return filled(
        template(),
        data={
            "x": [_row(point, scale) for point in points if point.axis == "x" and not point.beyond],
            "y": [_row(point, scale) for point in points if point.axis == "y" and not point.beyond],
            "beyond": [_row(point, scale) for point in points if point.beyond],
            "limits": rows,
            "zero": [{"v": 0.0}],
            "turns": [{"n": number} for number in turns],
            "words": [{"n": numbers[-1], "y": rows[-1]["low"], "text": beyond}] if rows else [],
        },
        values={"low": low, "high": high, "numbers": numbers, "labels": _labels(places)},
        description=description,
    )  # fmt: skip


def _row(point: Residual, scale: float) -> dict[str, Any]:
    return {
        "n": point.number,
        "v": point.value * scale,
        "name": point.name,
        "label": point.label,
        "href": point.href,
        "right": "yes" if point.axis == "y" else "no",
    }


def _labels(places: Sequence[Place]) -> list[list[str]]:
    """Two lines under a position: its ψ, and its θ where that begins."""
    texts, before = [], None
    for place in places:
        texts.append([place.psi, f"θ {place.theta}" if place.theta != before else ""])
        before = place.theta
    return texts


@cache
def template() -> Spec:
    """The chart without its data, made once."""
    import altair as alt

    axis = alt.Axis(
        title=None,
        labelExpr="labels[indexof(numbers, datum.value)]",
        labelAngle=0,
        labelOverlap="parity",
        labelPadding=10,
    )
    band = alt.Scale(type="band", domain=alt.ExprRef("numbers"), padding=0)
    x = alt.X("n:O", axis=axis, scale=band)
    scale = alt.Scale(domain=[alt.ExprRef("low"), alt.ExprRef("high")], nice=False, zero=False)
    y_axis = alt.Axis(
        title=None,
        minExtent=36,
        maxExtent=36,
        tickCount=8,
        labelExpr="(datum.value > 0 ? '+' : '') + datum.label",
    )

    def y(name: str) -> Any:
        return alt.Y(f"{name}:Q", scale=scale, axis=y_axis)

    def across(data: str) -> Any:
        return alt.Chart(alt.NamedData(data))

    ends = {"x": alt.X("n:O", axis=axis, scale=band, bandPosition=0), "x2": alt.X2("n", bandPosition=1)}
    links = {
        "href": alt.Href("href:N"),
        "description": alt.Description("name:N"),
        "tooltip": alt.Tooltip("name:N"),
    }

    def points(data: str, offset: int, look: Spec) -> list[Any]:
        base = across(data).encode(x=x, y=y("v"))
        return [
            base.mark_point(xOffset=offset, **look, aria=False),
            base.mark_point(xOffset=offset, **theme.TARGET).encode(**links),
        ]

    beyond, region = across("beyond"), across("limits").mark_rect(**theme.REGION, aria=False)
    layers = [
        *(
            region.encode(**ends, y=y(name), y2=alt.value(end))
            for name, end in (("high", 0), ("low", "height"))
        ),
        across("turns").mark_rule(color=theme.colour("hair"), aria=False).encode(
            x=alt.X("n:O", axis=axis, scale=band, bandPosition=0)
        ),
        across("zero").mark_rule(**theme.ZERO_LINE, aria=False).encode(y=y("v")),
        *(
            across("limits")
            .mark_rule(**{**theme.LIMIT_LINE, "strokeWidth": 1, "strokeDash": [5, 3]}, aria=False)
            .encode(**ends, y=y(name))
            for name in ("low", "high")
        ),
        across("words").mark_text(**theme.LABEL, align="right", dx=12, dy=10, aria=False).encode(
            x=x, y=y("y"), text="text:N"
        ),
        *points("x", -5, theme.X_POINT),
        *points("y", 5, theme.Y_POINT),
        *points("beyond", 0, theme.BEYOND_POINT),
        *(
            beyond.transform_filter(f"indexof(numbers, datum.n) {half} length(numbers) / 2")
            .mark_text(**theme.BEYOND_LABEL, align=align, dx=dx, aria=False)
            .encode(x=x, y=y("v"), text="label:N")
            for half, align, dx in (("<", "left", 10), (">=", "right", -10))
        ),
    ]  # fmt: skip
    values = {"low": -1.0, "high": 1.0, "numbers": [1], "labels": [["", ""]]}
    return template_of(layers, height=HEIGHT_PX, values=values)
