"""One grammar for every chart: surfaces, lines, marks, text.

No frame, horizontal hairlines only, axis text of 12 px, lines of 1 to 1.5 px, points of 7 to 8 px
with a paper edge. The x channel is a disc in the first series' colour, the y channel an open diamond
in the second, so that shape repeats colour; vermillion belongs to a point beyond a limit alone.
"""

import copy
import re
from typing import Any, Final

from app.i18n import LOCALE

Spec = dict[str, Any]

COLOURS: Final = {
    "paper": ("#fcfcfb", "#131517"),
    "hair": ("#dfdfda", "#2b3035"),
    "edge": ("#82868a", "#737a81"),
    "ink": ("#1b1d1f", "#e7e8e9"),
    "ink-2": ("#4b5056", "#b3b8bd"),
    "ink-3": ("#666b71", "#8f969c"),
    "accent": ("#1d43a6", "#9fb6ff"),
    "attention": ("#8a5a00", "#e69f00"),
    "deviation": ("#b03c00", "#ff8a4c"),
    "deviation-wash": ("#fcece4", "#2f1b12"),
    "series-1": ("#0072b2", "#56b4e9"),
    "series-2": ("#009e73", "#009e73"),
    "series-3": ("#cc79a7", "#cc79a7"),
    "series-4": ("#1b1d1f", "#f0e442"),
    "vermillion": ("#d55e00", "#d55e00"),
}
"""The stylesheet's variables that charts use: light and dark value."""

FACES: Final = (
    '"Segoe UI", -apple-system, "SF Pro Text", Roboto, "Adwaita Sans", Inter, "Noto Sans", Cantarell, '
    '"Liberation Sans", "DejaVu Sans Condensed", system-ui, sans-serif'
)
TEXT_PX: Final = 12
_VARIABLE = re.compile(r"var\(--([a-z0-9-]+)\)")


def colour(name: str) -> str:
    """A colour of the stylesheet, by its name."""
    if name not in COLOURS:
        raise ValueError(f"charts know no colour {name}")
    return f"var(--{name})"


def _mark(shape: str, size_px2: int, fill: str, stroke: str, width_px: float = 1.0) -> Spec:
    return {
        "shape": shape,
        "size": size_px2,
        "filled": True,
        "fill": colour(fill),
        "stroke": colour(stroke),
        "strokeWidth": width_px,
        "opacity": 1,
    }


X_POINT: Final[Spec] = _mark("circle", 50, "series-1", "paper")
Y_POINT: Final[Spec] = _mark("diamond", 55, "paper", "series-2", 1.5)
THIRD_POINT: Final[Spec] = _mark("square", 50, "series-3", "ink")
FOURTH_POINT: Final[Spec] = _mark("triangle-up", 55, "series-4", "paper")
CONDITIONAL_POINT: Final[Spec] = _mark("triangle-up", 75, "attention", "paper")
BEYOND_POINT: Final[Spec] = _mark("diamond", 75, "vermillion", "paper")
TARGET: Final[Spec] = {"shape": "square", "size": 576, "filled": True, "fill": "transparent", "opacity": 1}
"""Around every point that is a link: 24 × 24 px, as large as a finger or a shaky mouse needs."""

LIMIT_LINE: Final[Spec] = {"color": colour("deviation"), "strokeWidth": 1.5}
WASH: Final[Spec] = {"color": colour("deviation-wash"), "opacity": 1}
REGION: Final[Spec] = {**WASH, "stroke": WASH["color"]}
"""Washed stretches that touch: the stroke closes the seam between them."""

JOIN: Final[Spec] = {"color": colour("series-1"), "strokeWidth": 1}
EVENT_LINE: Final[Spec] = {"color": colour("ink"), "strokeWidth": 1, "strokeDash": [1, 2]}
CHANGE_LINE: Final[Spec] = {"color": colour("ink"), "strokeWidth": 1}
CONTROL_LINE: Final[Spec] = {"color": colour("ink-3"), "strokeWidth": 1, "strokeDash": [4, 3]}
CENTRE_LINE: Final[Spec] = {"color": colour("ink-3"), "strokeWidth": 1}
TODAY_LINE: Final[Spec] = {"color": colour("ink-3"), "strokeWidth": 1, "strokeDash": [1, 2]}
FORECAST_BAND: Final[Spec] = {"color": colour("series-1"), "opacity": 0.14}
FORECAST_LINE: Final[Spec] = {"color": colour("series-1"), "strokeWidth": 1.25, "strokeDash": [2, 3]}
ZERO_LINE: Final[Spec] = {"color": colour("ink-3"), "strokeWidth": 1}
LABEL: Final[Spec] = {"color": colour("ink-2"), "fontSize": TEXT_PX}
BEYOND_LABEL: Final[Spec] = {"color": colour("deviation"), "fontSize": TEXT_PX, "fontWeight": 600}
LABEL_GROUND: Final[Spec] = {
    **BEYOND_LABEL,
    "stroke": colour("paper"),
    "strokeWidth": 4,
    "strokeJoin": "round",
}
"""Under a label that comes to lie on lines: they do not run through its figures."""


_MONTHS: Final = {
    "en": ["Jan", "Feb", "Mar", "Apr", "May", "Jun", "Jul", "Aug", "Sep", "Oct", "Nov", "Dec"],
    "ru": ["янв", "фев", "мар", "апр", "май", "июн", "июл", "авг", "сен", "окт", "ноя", "дек"],
}


def config() -> Spec:
    """The look of every chart, in the current language."""
    return {
        "background": "transparent",
        "font": FACES,
        "view": {"stroke": None, "fill": None},
        "axis": {
            "labelFont": FACES, "labelFontSize": TEXT_PX, "labelColor": colour("ink-2"), "labelPadding": 8,
            "titleFont": FACES, "titleFontSize": TEXT_PX, "titleFontWeight": "normal",
            "titleColor": colour("ink-2"), "domain": False, "ticks": False, "grid": False,
            "gridColor": colour("hair"), "gridWidth": 1, "tickColor": colour("edge"),
        },
        "axisY": {"grid": True, "labelOverlap": True},
        "text": {"font": FACES, "fontSize": TEXT_PX, "fill": colour("ink-2")},
        "locale": _locale(),
    }  # fmt: skip


def _locale() -> Spec:
    language = LOCALE.get()
    comma = language == "ru"
    months = _MONTHS[language]
    return {
        "number": {"decimal": "," if comma else ".", "thousands": "", "grouping": [3], "minus": "−",
                   "currency": ["", ""]},
        "time": {
            "dateTime": "%x, %X", "date": "%d.%m.%Y" if comma else "%-d %b %Y", "time": "%H:%M:%S",
            "periods": ["AM", "PM"], "months": months, "shortMonths": months,
            "days": list("1234567"), "shortDays": list("1234567"),
        },
    }  # fmt: skip


def printed(spec: Spec, *, dark: bool = False) -> Spec:
    """The specification with colours instead of the stylesheet's variables, for paper and PDF."""

    def resolved(value: Any) -> Any:
        if isinstance(value, dict):
            return {key: resolved(item) for key, item in value.items()}
        if isinstance(value, list):
            return [resolved(item) for item in value]
        if isinstance(value, str):
            return _VARIABLE.sub(lambda match: COLOURS[match[1]][dark], value)
        return copy.copy(value)

    return {key: resolved(value) for key, value in spec.items()}
