"""A gyro's parameters over time."""

from typing import Annotated, Any, Final

from fastapi import APIRouter, Query, Request, Response
from pydantic import Field

from app.api.auth import Reader
from app.api.pagination import TABLE_TOO, tabular
from app.api.schemas.common import Incoming, Name, OptionalText, Since, Until
from app.api.schemas.results import History
from app.services import history
from app.services.views import HistorySeries

router = APIRouter(tags=["gyros"])

_COLUMNS: Final = ("measured_at", "value", "u", "verdict", "session", "calibration", "start", "stand",
                   "certificate")  # fmt: skip


class Period(Incoming):
    """Which part of a history; a day as the end counts to its end, UTC."""

    parameter: Annotated[OptionalText, Field(description="One of kx ky kxy kyx w0x w0y wg wk.")] = None
    since: Annotated[Since, Field(alias="from", description="Not before this time or day.")] = None
    until: Annotated[Until, Field(alias="to", description="Not after this time or day.")] = None
    method: Annotated[str, Field(pattern="^(least-squares|generalised|robust|paper)$")] = "least-squares"


@router.get("/gyros/{serial}/history", response_model=History, responses=TABLE_TOO | {404: {}})
def over_time(
    serial: Name, period: Annotated[Period, Query()], caller: Reader, request: Request
) -> Response | History:
    """One parameter, or each of them, over time with the type's limits; also as a table."""
    with caller.read() as work:
        series = history.history(
            work, serial, parameter=period.parameter, since=period.since, until=period.until,
            method=period.method,
        )  # fmt: skip
    answer = tabular(request, ["parameter", "unit", *_COLUMNS], lambda: _rows(series))
    return answer or History.model_validate({"gyro": serial, "method": period.method, "series": series})


def _rows(series: tuple[HistorySeries, ...]) -> list[list[Any]]:
    return [
        [item.parameter, item.unit, *(getattr(point, name) for name in _COLUMNS)]
        for item in series
        for point in item.points
    ]
