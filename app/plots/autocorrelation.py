"""Autocorrelation of both channels by lag, with the band that independent samples would keep to."""

from collections.abc import Sequence
from functools import cache
from typing import Any, Final

from app.plots import theme
from app.plots.template import filled, template_of
from app.plots.theme import Spec

HEIGHT_PX: Final = 200
_DASHES: Final = {"x": [1, 0], "y": [7, 3]}


def autocorrelation(
    x: Sequence[tuple[float, float]], y: Sequence[tuple[float, float]], chance: float, description: str
) -> Spec:
    """ρ by lag in s of both channels.

    Parameters
    ----------
    x, y
        Lag in s and ρ; empty for a channel that does not change.
    chance
        Half the height of the band around zero.
    """
    values = [value for _, value in (*x, *y)]
    last = max([lag for lag, _ in (*x, *y)], default=1.0)
    low = min([-1.5 * chance, *values])
    return filled(
        template(),
        data={
            "x": [{"t": lag, "v": value} for lag, value in x],
            "y": [{"t": lag, "v": value} for lag, value in y],
            "band": [{"l": -chance, "h": chance, "zero": 0.0}],
        },
        values={"low": low - 0.02, "last": last},
        description=description,
    )


@cache
def template() -> Spec:
    """The chart without its data, made once."""
    import altair as alt

    x = alt.X(
        "t:Q", scale=alt.Scale(domain=[0.0, alt.ExprRef("last")], nice=False),
        axis=alt.Axis(title=None, ticks=True, tickSize=4, labelPadding=4, tickCount=6, labelOverlap=True),
    )  # fmt: skip
    scale = alt.Scale(domain=[alt.ExprRef("low"), 1.0], nice=False)
    axis = alt.Axis(title=None, minExtent=44, maxExtent=44, tickCount=5)

    def y(name: str) -> Any:
        return alt.Y(f"{name}:Q", scale=scale, axis=axis)

    band = alt.Chart(alt.NamedData("band"))
    layers = [
        band.mark_rect(fill=theme.colour("edge"), opacity=0.25, aria=False).encode(y=y("l"), y2="h:Q"),
        band.mark_rule(**theme.ZERO_LINE, aria=False).encode(y=y("zero")),
        *(
            alt.Chart(alt.NamedData(name))
            .mark_line(
                color=theme.colour("series-1" if name == "x" else "series-2"), strokeWidth=1.5,
                strokeDash=dash, aria=False,
            )
            .encode(x=x, y=y("v"))
            for name, dash in _DASHES.items()
        ),
    ]  # fmt: skip
    return template_of(layers, height=HEIGHT_PX, values={"low": -0.1, "last": 1.0})
