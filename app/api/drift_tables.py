"""What was found of a type, a gyro and a stand as tables: as CSV, as Parquet, and as a list."""

from typing import Annotated, Literal

from fastapi import APIRouter, Query, Request, Response
from fastapi.responses import JSONResponse

from app.api.auth import Reader
from app.api.pagination import TABLE_TOO, Cell, Listing, tabular
from app.api.schemas.common import Name
from app.api.schemas.drift import Method
from app.services.drift import fleet, reading, stand_reading, tables
from app.services.drift.tables import Table

router = APIRouter(tags=["drift"])
Rows = Listing[dict[str, Cell]]


@router.get("/types/{name}/fleet/{table}", response_model=Rows, responses=TABLE_TOO | {404: {}})
def of_type(
    name: Name,
    table: Literal["distributions", "components", "correlations"],
    caller: Reader,
    request: Request,
) -> Response:
    """What a type's gyros have in common: a row for each parameter, component of variance, or pair of parameters."""
    with caller.read() as work:
        found = fleet.fleet(work, name)
    return _answer(request, tables.OF_TYPE[table](found))


@router.get("/gyros/{serial}/drift/{table}", response_model=Rows, responses=TABLE_TOO | {404: {}})
def of_gyro(
    serial: Name, table: Literal["changes", "trends", "forecasts", "intervals"], caller: Reader, request: Request,
    method: Annotated[Method, Query()] = "least-squares",
) -> Response:  # fmt: skip
    """What was found of a gyro's whole life: changes, trends, bands of the next values, methods of recalibration."""
    with caller.read() as work:
        found = reading.gyro_drift(work, serial, method=method, parameters=(), most=1).document
    return _answer(request, tables.OF_GYRO[table](found or tables.NOTHING))


@router.get("/stands/{name}/drift/findings", response_model=Rows, responses=TABLE_TOO | {404: {}})
def of_stand(name: Name, caller: Reader, request: Request) -> Response:
    """What was found of a stand: whose change it was, when, how much, and by how much it shifted each parameter."""
    with caller.read() as work:
        found = stand_reading.stand_drift(work, name, by="year").document
    return _answer(request, tables.findings(found or tables.NOTHING))


def _answer(request: Request, table: Table) -> Response:
    answer = tabular(request, table.columns, lambda: [list(row.values()) for row in table.rows])
    listed = Rows(items=list(table.rows), next=None)
    return answer or JSONResponse(listed.model_dump(mode="json"), headers={"vary": "Accept"})
