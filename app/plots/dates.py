"""An axis of dates: months in the language of the moment, their steps by the length of the period."""

from datetime import datetime, timedelta
from typing import Any, Final

_STEPS: Final = ((timedelta(days=550), 1), (timedelta(days=1500), 3), (timedelta(days=2600), 6))
_YEAR: Final = 12
STEPS: Final = (*(step for _, step in _STEPS), _YEAR)
"""Months between two ticks, for whoever makes templates beforehand."""


def stamp(moment: datetime) -> int:
    """Milliseconds since 1970, as Vega counts time."""
    return round(moment.timestamp() * 1000)


def step_of(period: tuple[datetime, datetime]) -> int:
    """Months between two ticks: 1, 3, 6 or 12, so that their names have room."""
    length = period[1] - period[0]
    return next((step for longest, step in _STEPS if length <= longest), _YEAR)


def axis(step: int) -> Any:
    """The axis below a chart: short months, the year under January and under the first."""
    import altair as alt

    year, month = "timeFormat(datum.value, '%Y')", "timeFormat(datum.value, '%b')"
    named = f"month(datum.value) == 0 || datum.index == 0 ? [{month}, {year}] : {month}"
    return alt.Axis(
        title=None,
        labelExpr=year if step == _YEAR else named,
        tickCount=alt.TimeIntervalStep(
            interval="year" if step == _YEAR else "month", step=1 if step == _YEAR else step
        ),
        labelOverlap="parity",
        labelAlign="left",
        labelFlush=False,
        labelBound=True,
        labelPadding=4,
        ticks=True,
        tickSize=4,
    )
