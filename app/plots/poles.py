"""Poles in the complex plane; what grows lies in the washed half."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any, Final

from app.plots import theme
from app.plots.template import filled, template_of
from app.plots.theme import Spec

HEIGHT_PX: Final = 320
LOOKS: Final = {"decays": theme.X_POINT, "grows": theme.BEYOND_POINT}


@dataclass(frozen=True, slots=True)
class Pole:
    """Real and imaginary part, and what the pole says in words."""

    re: float
    im: float
    name: str


def poles(found: Sequence[Pole], description: str) -> Spec:
    """Poles of a loop, stretched so that slow ones and the nutation are seen together.

    Both axes are linear up to a power of ten below the smallest real part, and logarithmic beyond.
    """
    smallest = min((abs(pole.re) for pole in found if pole.re), default=1.0)
    linear = 10.0 ** math.floor(math.log10(smallest))
    x_low, x_high = _ends([pole.re for pole in found], linear)
    y_low, y_high = _ends([pole.im for pole in found], linear)
    return filled(
        template(),
        data={
            "decays": [_row(pole) for pole in found if pole.re < 0],
            "grows": [_row(pole) for pole in found if not pole.re < 0],
            "half": [{"l": 0.0, "h": x_high, "b": y_low, "t": y_high}],
            "axes": [{"zero": 0.0}],
        },
        values={
            "linear": linear, "xLow": x_low, "xHigh": x_high, "yLow": y_low, "yHigh": y_high,
            "xTicks": _ticks(x_low, x_high, linear), "yTicks": _ticks(y_low, y_high, linear),
        },
        description=description,
    )  # fmt: skip


def _row(pole: Pole) -> dict[str, Any]:
    return {"x": pole.re, "y": pole.im, "name": pole.name}


def _ends(values: Sequence[float], linear: float) -> tuple[float, float]:
    """Beyond every value and on both sides of zero."""
    return min(-2 * linear, 2 * min(values, default=0.0)), max(2 * linear, 2 * max(values, default=0.0))


def _ticks(low: float, high: float, linear: float) -> list[float]:
    """Zero and powers of ten on both sides, every second one where there are many."""
    largest = max(-low, high) / linear
    decades = range(0, math.floor(math.log10(largest)) + 1, 1 if largest < 3e4 else 2)
    sizes = [linear * 10.0**power for power in decades]
    return [tick for tick in (*(-size for size in reversed(sizes)), 0.0, *sizes) if low <= tick <= high]


@cache
def template() -> Spec:
    """The chart without its data, made once."""
    import altair as alt

    def scale(name: str) -> Any:
        return alt.Scale(
            type="symlog", constant=alt.ExprRef("linear"), nice=False, zero=False,
            domain=[alt.ExprRef(f"{name}Low"), alt.ExprRef(f"{name}High")],
        )  # fmt: skip

    form: Spec = {"title": None, "format": "~r", "labelOverlap": True}
    x_axis = alt.Axis(
        values=alt.ExprRef("xTicks"),
        ticks=True,
        tickSize=4,
        labelPadding=4,
        grid=True,
        labelFlush=True,
        **form,
    )
    y_axis = alt.Axis(values=alt.ExprRef("yTicks"), minExtent=52, maxExtent=52, **form)

    def x(name: str) -> Any:
        return alt.X(f"{name}:Q", scale=scale("x"), axis=x_axis)

    def y(name: str) -> Any:
        return alt.Y(f"{name}:Q", scale=scale("y"), axis=y_axis)

    axes = alt.Chart(alt.NamedData("axes"))
    layers = [
        alt.Chart(alt.NamedData("half")).mark_rect(**theme.WASH, aria=False).encode(
            x=x("l"), x2="h:Q", y=y("b"), y2="t:Q"
        ),
        axes.mark_rule(**theme.ZERO_LINE, aria=False).encode(x=x("zero")),
        axes.mark_rule(**theme.ZERO_LINE, aria=False).encode(y=y("zero")),
        *(
            alt.Chart(alt.NamedData(kind)).mark_point(**look).encode(
                x=x("x"), y=y("y"), description=alt.Description("name:N"), tooltip=alt.Tooltip("name:N")
            )
            for kind, look in LOOKS.items()
        ),
    ]  # fmt: skip
    numbers = dict.fromkeys(("linear", "xLow", "xHigh", "yLow", "yHigh"), 1.0)
    ticks = {"xTicks": [0.0], "yTicks": [0.0]}
    return template_of(layers, height=HEIGHT_PX, values=numbers | ticks)
