"""Which parameters go together over the gyros of a type: a disc for each pair, as large as the correlation."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any, Final

from app.plots import theme
from app.plots.template import filled, template_of
from app.plots.theme import Spec

_CELL_PX: Final = 34
_MARGIN_PX: Final = 24
_LARGEST_PX2: Final = 620


@dataclass(frozen=True, slots=True)
class CorrelationMark:
    """One pair: symbols of its two quantities, r, whether it is sure, its words and where it leads."""

    row: str
    column: str
    coefficient: float
    sure: bool
    name: str
    href: str


def correlation_map(marks: Sequence[CorrelationMark], order: Sequence[str], description: str) -> Spec:
    """The lower half of the matrix: discs for positive, open diamonds for negative; the sure ones ringed.

    Parameters
    ----------
    order
        Symbols of the quantities, as they stand along both axes.
    """
    rows = [
        {"row": item.row, "column": item.column, "size": abs(item.coefficient), "negative": item.coefficient < 0,
         "sure": item.sure, "name": item.name, "href": item.href}
        for item in marks
    ]  # fmt: skip
    return filled(
        template(tuple(order)),
        data={"pairs": rows},
        values={},
        description=description,
        height=_CELL_PX * max(1, len(order) - 1) + _MARGIN_PX,
    )


@cache
def template(order: tuple[str, ...]) -> Spec:
    """The chart without its data, made once for the symbols of a language."""
    import altair as alt

    def axis(grid: bool) -> Any:
        return alt.Axis(title=None, labelAngle=0, grid=grid, labelFontSize=theme.TEXT_PX + 1)

    base = alt.Chart(alt.NamedData("pairs")).encode(
        x=alt.X("column:N", scale=alt.Scale(domain=list(order[:-1])), axis=axis(True)),
        y=alt.Y("row:N", scale=alt.Scale(domain=list(order[1:])), axis=axis(True)),
    )
    size = alt.Size("size:Q", scale=alt.Scale(domain=[0, 1], range=[0, _LARGEST_PX2]), legend=None)
    disc: Spec = {"shape": "circle", "filled": True, "fill": theme.colour("series-1"), "opacity": 1}
    diamond: Spec = {"shape": "diamond", "filled": True, "fill": theme.colour("paper"), "opacity": 1,
                     "stroke": theme.colour("series-2"), "strokeWidth": 2}  # fmt: skip
    ring: Spec = {"shape": "square", "size": 26 * 26, "filled": False, "stroke": theme.colour("ink"),
                  "strokeWidth": 1.5, "opacity": 1}  # fmt: skip
    layers = [
        base.transform_filter("!datum.negative").mark_point(**disc, aria=False).encode(size=size),
        base.transform_filter("datum.negative").mark_point(**diamond, aria=False).encode(size=size),
        base.transform_filter("datum.sure").mark_point(**ring, aria=False),
        base.mark_point(**theme.TARGET).encode(
            href=alt.Href("href:N"), description=alt.Description("name:N"), tooltip=alt.Tooltip("name:N")
        ),
    ]
    spec = template_of(layers, height=_CELL_PX)
    return {**spec, "padding": {"left": 0, "top": 0, "right": 4, "bottom": 8}}  # room for the symbols' tails
