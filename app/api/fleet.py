"""All gyros of a type."""

from fastapi import APIRouter, Request, Response

from app.api.auth import Reader
from app.api.pagination import TABLE_TOO, tabular
from app.api.schemas.common import Name
from app.api.schemas.fleet import Fleet
from app.services.drift import fleet
from app.services.drift.fleet_rows import COLUMNS, rows

router = APIRouter(tags=["drift"])


@router.get("/types/{name}/fleet", response_model=Fleet, responses=TABLE_TOO | {404: {}})
def of_type(name: Name, caller: Reader, request: Request) -> Response | Fleet:
    """Each gyro of a type, how its parameters are distributed and correlated, what is due.

    As CSV or Parquet: a row for each gyro.
    """
    with caller.read() as work:
        found = fleet.fleet(work, name)
    table = tabular(request, COLUMNS, lambda: [[row[column] for column in COLUMNS] for row in rows(found)])
    return table or Fleet.model_validate(found)
