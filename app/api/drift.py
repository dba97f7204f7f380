"""A gyro's drift: values over time with control charts, and what was found of them."""

from datetime import date
from typing import Annotated, Any, Final

from fastapi import APIRouter, Query, Request, Response
from fastapi.responses import JSONResponse
from pydantic import Field

from app.api.auth import Reader
from app.api.pagination import TABLE_TOO, Columns, Listing, listed, tabular, wants_table
from app.api.schemas.common import Incoming, Name, OptionalText, Since, Until
from app.api.schemas.drift import By, ComponentLine, GyroDrift, Method, Replaced
from app.services.drift import due, reading
from app.services.drift.charting import CHARTS
from app.services.drift.views import GyroDrift as Found
from solver.records import PARAMETERS

router = APIRouter(tags=["drift"])

_HEAD: Final = ("at", "until", "sessions", "value", "u", "k", "scatter", "verdict", "session", "calibration", "start",
                "stand", "certificate", "revisions")  # fmt: skip
_COMPONENTS: Final[Columns[ComponentLine]] = {
    "parameter": lambda item: item.parameter,
    "unit": lambda item: item.unit,
    "source": lambda item: item.source,
    "sd": lambda item: item.sd,
    "low": lambda item: item.low,
    "high": lambda item: item.high,
    "dof": lambda item: item.dof,
    "f": lambda item: item.f,
    "p_value": lambda item: item.p_value,
    "confounded_with": lambda item: " ".join(item.confounded_with),
}
_REPLACED: Final[Columns[Replaced]] = {
    "session": lambda item: item.session,
    "measured_at": lambda item: item.measured_at,
    "calibration": lambda item: item.calibration,
    "revision": lambda item: item.revision,
    "replaced_by": lambda item: item.replaced_by,
    "parameter": lambda item: item.parameter,
    "value": lambda item: item.value,
    "u": lambda item: item.standard_uncertainty,
    "k": lambda item: item.coverage_factor,
}


MAIN: Final = (
    "Without it the first one that the gyro has results of: least-squares, generalised, robust, paper."
)


class Wanted(Incoming):
    """Which part of a drift; a day as the end counts to its end, UTC."""

    parameter: Annotated[OptionalText, Field(description="One of kx ky kxy kyx w0x w0y wg wk.")] = None
    since: Annotated[Since, Field(alias="from", description="Not before this time or day.")] = None
    until: Annotated[Until, Field(alias="to", description="Not after this time or day.")] = None
    method: Annotated[Method | None, Field(description=MAIN)] = None
    by: Annotated[By, Field(description="What a point stands for.")] = "session"
    points: Annotated[
        int | None,
        Field(
            ge=4,
            le=100_000,
            description="Most points of a parameter, and of those that broke a rule as many again; "
            f"without it {reading.MOST_POINTS} in JSON, and all in CSV and Parquet.",
        ),
    ] = None


@router.get("/gyros/{serial}/drift", response_model=GyroDrift, responses=TABLE_TOO | {404: {}})
def over_time(serial: Name, wanted: Annotated[Wanted, Query()], caller: Reader, request: Request) -> Response:
    """A gyro's parameters over time: points with control charts, changes, trend, forecast, repeatability."""
    most = wanted.points or (None if wants_table(request) else reading.MOST_POINTS)
    with caller.read() as work:
        found = reading.gyro_drift(
            work, serial, method=wanted.method, since=wanted.since, until=wanted.until, by=wanted.by,
            parameters=PARAMETERS if wanted.parameter is None else [wanted.parameter], most=most,
        )  # fmt: skip
        holds = due.due_of(work, [serial])[serial]
    names = ["parameter", "unit", *_HEAD, *CHARTS, "signals"]
    answer = tabular(request, names, lambda: _rows(found))
    return answer or JSONResponse(
        _shown(found, holds.due).model_dump(mode="json"), headers={"vary": "Accept"}
    )


@router.get("/gyros/{serial}/drift/components", response_model=Listing[ComponentLine],
            responses=TABLE_TOO | {404: {}})  # fmt: skip
def components(
    serial: Name,
    caller: Reader,
    request: Request,
    method: Annotated[Method | None, Query(description=MAIN)] = None,
) -> Response:
    """How much a gyro's parameters scatter, by source: within a position, between positions, sessions, starts, days."""
    with caller.read() as work:
        found = reading.components(work, serial, method=method)
    return listed(request, [ComponentLine.model_validate(row) for row in found], None, _COMPONENTS)


@router.get(
    "/gyros/{serial}/drift/replaced", response_model=Listing[Replaced], responses=TABLE_TOO | {404: {}}
)
def replaced(
    serial: Name,
    caller: Reader,
    request: Request,
    method: Annotated[Method | None, Query(description=MAIN)] = None,
) -> Response:
    """Results that count no more because a later revision replaced them."""
    with caller.read() as work:
        found = reading.replaced(work, serial, method=method)
    return listed(request, [Replaced.model_validate(item) for item in found], None, _REPLACED)


def _shown(found: Found, until: date | None) -> GyroDrift:
    further = {"interval": (found.document or {}).get("interval"), "due": until}
    fields: dict[str, Any] = {name: getattr(found, name) for name in Found.__slots__}
    return GyroDrift.model_validate(fields | further)


def _rows(found: Found) -> list[list[Any]]:
    return [
        [
            item.parameter, item.unit, *(getattr(point, name) for name in _HEAD),
            *(point.charts.get(name) for name in CHARTS), " ".join(point.signals),
        ]
        for item in found.parameters
        for point in item.points
    ]  # fmt: skip
