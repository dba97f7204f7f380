"""How the paper's successive approximations settle: the change of each unknown, round by round."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any, Final

from app.plots import theme
from app.plots.template import filled, template_of
from app.plots.theme import Spec

HEIGHT_PX: Final = 248
LOOKS: Final = {
    "kx": (theme.X_POINT, [1, 0]),
    "ky": (theme.Y_POINT, [7, 3]),
    "kxy": (theme.THIRD_POINT, [2, 3]),
    "kyx": (theme.FOURTH_POINT, [8, 3, 2, 3]),
    "wg": ({**theme.X_POINT, "fill": theme.colour("paper"), "stroke": theme.colour("series-1"),
            "strokeWidth": 1.5}, [1, 0]),
    "wk": ({**theme.Y_POINT, "fill": theme.colour("series-2"), "stroke": theme.colour("paper"),
            "strokeWidth": 1}, [7, 3]),
}  # fmt: skip
"""Mark and dash of each unknown of the iteration; the stylesheet's legend repeats them."""


_SUPERSCRIPT: Final = (
    "replace(replace(replace(replace(replace(replace(replace(replace(replace(replace(replace("
    "'' + round(log(datum.value) / LN10), "
    "'-', '⁻'), /0/g, '⁰'), /1/g, '¹'), /2/g, '²'), /3/g, '³'), /4/g, '⁴'), /5/g, '⁵'), "
    "/6/g, '⁶'), /7/g, '⁷'), /8/g, '⁸'), /9/g, '⁹')"
)


@dataclass(frozen=True, slots=True)
class Change:
    """Change of an unknown in a round, as a part of its size; zero is not drawn on the log scale."""

    parameter: str
    round: int
    relative: float
    name: str


def convergence(changes: Sequence[Change], tolerance: float, tolerance_label: str, description: str) -> Spec:
    """Relative change by round, on a logarithmic scale, with the tolerance where the rounds end."""
    shown = [change for change in changes if change.relative > 0.0]
    rounds = sorted({change.round for change in changes}) or [1]
    smallest = min([tolerance, *(change.relative for change in shown)])
    largest = max([tolerance, *(change.relative for change in shown)])
    return filled(
        template(),
        data={
            **{
                name: [
                    {"r": change.round, "v": change.relative, "name": change.name}
                    for change in shown
                    if change.parameter == name
                ]
                for name in LOOKS
            },
            "tolerance": [{"v": tolerance, "r": rounds[0], "text": tolerance_label}],
        },
        values={"low": smallest / 5, "high": largest * 5, "rounds": rounds},
        description=description,
    )


@cache
def template() -> Spec:
    """The chart without its data, made once."""
    import altair as alt

    x = alt.X(
        "r:O",
        axis=alt.Axis(title=None, labelAngle=0, labelOverlap="parity"),
        scale=alt.Scale(type="point", domain=alt.ExprRef("rounds"), padding=0.5),
    )
    y = alt.Y(
        "v:Q",
        scale=alt.Scale(type="log", domain=[alt.ExprRef("low"), alt.ExprRef("high")], nice=False),
        axis=alt.Axis(
            title=None, minExtent=36, maxExtent=36, tickCount=6,
            labelExpr="'10' + " + _SUPERSCRIPT,
        ),
    )  # fmt: skip

    def series(name: str) -> list[Any]:
        look, dash = LOOKS[name]
        colour = look["stroke"] if look["fill"] == theme.colour("paper") else look["fill"]
        base = alt.Chart(alt.NamedData(name)).encode(x=x, y=y)
        return [
            base.mark_line(color=colour, strokeWidth=1.25, strokeDash=dash, aria=False),
            base.mark_point(**look).encode(
                description=alt.Description("name:N"), tooltip=alt.Tooltip("name:N")
            ),
        ]

    ended = alt.Chart(alt.NamedData("tolerance"))
    layers = [
        ended.mark_rule(**{**theme.ZERO_LINE, "strokeDash": [4, 3]}, aria=False).encode(y=y),
        ended.mark_text(**theme.LABEL, align="left", dy=10, dx=-12, aria=False).encode(
            x=x, y=y, text="text:N"
        ),
        *(layer for name in LOOKS for layer in series(name)),
    ]
    return template_of(layers, height=HEIGHT_PX, values={"low": 1e-13, "high": 1.0, "rounds": [1]})
