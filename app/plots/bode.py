"""A frequency response over a logarithmic axis, ω > 0 and ω < 0 side by side, with margins marked."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any, Final, Literal

from app.plots import theme
from app.plots.template import filled, template_of
from app.plots.theme import Spec

_DASHES: Final = {"positive": [1, 0], "negative": [7, 3]}
_LOOKS: Final = {"positive": theme.X_POINT, "negative": theme.Y_POINT}
Sign = Literal["positive", "negative"]
Curve = Sequence[tuple[float, float]]


@dataclass(frozen=True, slots=True)
class MarginMark:
    """A margin: a line from `begin` to `end` at |ω|, a point at its end on the curve, and it in words."""

    sign: Sign
    omega: float
    begin: float
    end: float
    name: str


def bode(
    curves: Sequence[tuple[Sign, Curve]],
    marks: Sequence[MarginMark],
    levels: Sequence[float],
    ends: tuple[float, float],
    step: float,
    description: str,
    height: int = 200,
) -> Spec:
    """One quantity by |ω|.

    Parameters
    ----------
    curves
        |ω| in rad/s and value, as many pieces of each sign as the curve has.
    marks
        Margins, each a line to the level that it is counted from.
    levels
        What is counted from, drawn as horizontal lines.
    ends, step
        Of the vertical axis, and the distance of its labels.
    """
    omegas = [omega for _, curve in curves for omega, _ in curve]
    first, last = min(omegas, default=1.0), max(omegas, default=10.0)
    low, high = ends
    return filled(
        template(),
        data={
            **{
                sign: [
                    {"w": omega, "v": value, "piece": number}
                    for number, (owner, curve) in enumerate(curves)
                    if owner == sign
                    for omega, value in curve
                ]
                for sign in _DASHES
            },
            **{f"mark_{sign}": [_row(mark) for mark in marks if mark.sign == sign] for sign in _LOOKS},
            "levels": [{"v": level} for level in levels],
        },
        values={
            "first": first, "last": last, "low": low, "high": high,
            "ticks": [step * number for number in range(math.ceil(low / step), math.floor(high / step) + 1)],
        },
        description=description,
        height=height,
    )  # fmt: skip


def _row(mark: MarginMark) -> dict[str, Any]:
    return {"w": mark.omega, "v": mark.begin, "e": mark.end, "name": mark.name}


@cache
def template() -> Spec:
    """The chart without its data, made once."""
    import altair as alt

    x = alt.X(
        "w:Q", scale=alt.Scale(type="log", domain=[alt.ExprRef("first"), alt.ExprRef("last")], nice=False),
        axis=alt.Axis(title=None, ticks=True, tickSize=4, labelPadding=4, tickCount=6, labelFlush=True,
                      labelExpr=_DECADES, labelOverlap=True),
    )  # fmt: skip
    y = alt.Y(
        "v:Q", scale=alt.Scale(domain=[alt.ExprRef("low"), alt.ExprRef("high")], nice=False, zero=False),
        axis=alt.Axis(title=None, minExtent=44, maxExtent=44, values=alt.ExprRef("ticks")),
    )  # fmt: skip

    def layers_of(sign: str) -> list[Any]:
        colour = theme.colour("series-1" if sign == "positive" else "series-2")
        look: Spec = {"color": colour, "strokeWidth": 1.5, "strokeDash": _DASHES[sign], "clip": True}
        marks = alt.Chart(alt.NamedData(f"mark_{sign}")).encode(x=x)
        return [
            alt.Chart(alt.NamedData(sign)).mark_line(**look, aria=False).encode(x=x, y=y, detail="piece:N"),
            marks.mark_rule(color=colour, strokeWidth=1.5, aria=False).encode(y=y, y2="e:Q"),
            marks.mark_point(**_LOOKS[sign]).encode(
                y=y, description=alt.Description("name:N"), tooltip=alt.Tooltip("name:N")
            ),
        ]

    levels = alt.Chart(alt.NamedData("levels"))
    layers = [
        levels.mark_rule(**theme.ZERO_LINE, aria=False).encode(y=y),
        *(layer for sign in _DASHES for layer in layers_of(sign)),
    ]
    ranges = dict.fromkeys(("first", "last", "low", "high"), 1.0)
    return template_of(layers, height=200, values=ranges | {"ticks": [0.0]})


_DECADES: Final = (
    "abs(log(datum.value) / LN10 - round(log(datum.value) / LN10)) < 1e-6 ? format(datum.value, '~r') : ''"
)
