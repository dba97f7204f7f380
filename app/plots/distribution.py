"""How a parameter lies over the gyros of a type: one dot for each gyro, with the type's limits."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any, Final, Literal

from app.plots import theme
from app.plots.drift_marks import DriftLimit
from app.plots.template import axis_range, filled, template_of
from app.plots.theme import Spec

_NEAR: Final = 0.75
"""A limit farther from the dots than this part of their range is told in words, not drawn."""
_DOT: Final = 0.022
"""Width of a dot as part of the axis: dots nearer to each other than that are put one above the other."""
_LABEL: Final = 0.09
"""Width of a label as part of the axis."""
_LANE_PX: Final = 11
_AXIS_PX: Final = 30
_LEAST_PX: Final = 44
_BELOW: Final = -0.6
"""Lane of the median, below the dots."""
_STATES: Final = ("within", "conditional", "beyond")
_QUARTILES: Final[Spec] = {"color": theme.colour("edge"), "strokeWidth": 3}
_MEDIAN: Final[Spec] = {"color": theme.colour("ink"), "thickness": 2, "size": 12, "orient": "vertical"}


@dataclass(frozen=True, slots=True)
class DistributionPoint:
    """One gyro's value; `label` is written beside the dot, `name` said of it."""

    value: float
    state: Literal["within", "conditional", "beyond"]
    name: str
    label: str
    href: str


def distribution(
    points: Sequence[DistributionPoint],
    limits: Sequence[DriftLimit],
    middle: tuple[float, float, float] | None,
    description: str,
) -> Spec:
    """Dots along one axis, those that would lie on each other stacked.

    Parameters
    ----------
    limits
        Each is drawn where it is near the dots.
    middle
        Lower quartile, median and upper quartile, drawn as a bar with a stroke; None for too few.
    """
    values = [point.value for point in points]
    span = (max(values) - min(values)) if values else 0.0
    near = [
        limit
        for limit in limits
        if values and min(values) - _NEAR * span <= limit.value <= max(values) + _NEAR * span
    ]
    low, high = axis_range([*values, *(limit.value for limit in near)])
    lanes = _lanes(values, _DOT * (high - low))
    sides = _sides(points, lanes, (low, high))
    rows = [
        {"v": point.value, "lane": lane, "name": point.name, "label": point.label if side else "",
         "href": point.href, "left": side == "left"}
        for point, lane, side in zip(points, lanes, sides, strict=True)
    ]  # fmt: skip
    tallest = max(lanes, default=0)
    return filled(
        template(),
        data={
            **{
                state: [row for row, point in zip(rows, points, strict=True) if point.state == state]
                for state in _STATES
            },
            "limits": [
                {"v": item.value, "edge": high if item.side == "above" else low, "text": item.label}
                for item in near
            ],
            "middle": [dict(zip(("low", "v", "high"), middle, strict=True), lane=_BELOW)] if middle else [],
        },
        values={"low": low, "high": high, "top": tallest + 1.0},
        description=description,
        height=max(_LEAST_PX, _LANE_PX * (tallest + 2)) + _AXIS_PX,
    )  # fmt: skip


def _lanes(values: Sequence[float], width: float) -> list[int]:
    """For each value the lowest lane in which nothing lies nearer than a dot's width."""
    last: list[float] = []
    lanes = [0] * len(values)
    for place in sorted(range(len(values)), key=lambda place: values[place]):
        free = next((lane for lane, end in enumerate(last) if values[place] - end >= width), len(last))
        if free == len(last):
            last.append(values[place])
        last[free] = values[place]
        lanes[place] = free
    return lanes


def _sides(
    points: Sequence[DistributionPoint], lanes: Sequence[int], ends: tuple[float, float]
) -> list[Literal["left", "right"] | None]:
    """On which side of each dot its label has room in its lane; None on neither."""
    room = _LABEL * (ends[1] - ends[0])
    found: list[Literal["left", "right"] | None] = []
    for point, lane in zip(points, lanes, strict=True):
        beside = [
            other.value - point.value
            for other, row in zip(points, lanes, strict=True)
            if other is not point and row == lane
        ]
        right = point.value + room < ends[1] and not any(0 <= gap < 2 * room for gap in beside)
        left = point.value - room > ends[0] and not any(-2 * room < gap <= 0 for gap in beside)
        found.append("right" if right else "left" if left else None)
    return found


@cache
def template() -> Spec:
    """The chart without its data, made once."""
    import altair as alt

    scale = alt.Scale(domain=[alt.ExprRef("low"), alt.ExprRef("high")], nice=False, zero=False)
    heights = alt.Scale(domain=[-1, alt.ExprRef("top")], nice=False, zero=False)
    axis = alt.Axis(title=None, tickCount=6, labelFlush=True, ticks=True, tickSize=4, labelOverlap=True)
    x, y = alt.X("v:Q", scale=scale, axis=axis), alt.Y("lane:Q", scale=heights, axis=None)

    def rows(name: str) -> Any:
        return alt.Chart(alt.NamedData(name))

    def dots(name: str, look: Spec) -> list[Any]:
        base = rows(name).encode(x=x, y=y)
        texts: Spec = {**(theme.BEYOND_LABEL if name == "beyond" else theme.LABEL), "aria": False}
        return [
            base.mark_point(**look, aria=False),
            base.transform_filter("!datum.left").mark_text(**texts, align="left", dx=8).encode(text="label:N"),
            base.transform_filter("datum.left").mark_text(**texts, align="right", dx=-8).encode(text="label:N"),
            base.mark_point(**theme.TARGET).encode(
                href=alt.Href("href:N"), description=alt.Description("name:N"), tooltip=alt.Tooltip("name:N")
            ),
        ]  # fmt: skip

    limits, middle = rows("limits"), rows("middle")
    layers = [
        limits.mark_rect(**theme.WASH, clip=True, aria=False).encode(x=x, x2="edge:Q"),
        limits.mark_rule(**theme.LIMIT_LINE, aria=False).encode(x=x),
        middle.mark_rule(**_QUARTILES, aria=False).encode(
            x=alt.X("low:Q", scale=scale, axis=axis), x2="high:Q", y=y
        ),
        middle.mark_tick(**_MEDIAN, aria=False).encode(x=x, y=y),
        *dots("within", theme.X_POINT),
        *dots("conditional", theme.CONDITIONAL_POINT),
        *dots("beyond", theme.BEYOND_POINT),
    ]
    return template_of(layers, height=_LEAST_PX, values=dict.fromkeys(("low", "high", "top"), 1.0))
