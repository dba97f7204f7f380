"""A stand's drift: did it turn, or did a gyro change."""

from typing import Annotated

from fastapi import APIRouter, Query, Request, Response

from app.api.auth import Reader
from app.api.pagination import TABLE_TOO, tabular
from app.api.schemas.common import Name
from app.api.schemas.stand_drift import StandDrift, StandPeriod
from app.services.drift import stand_reading
from app.services.drift.stand_rows import COLUMNS, rows

router = APIRouter(tags=["drift"])


@router.get("/stands/{name}/drift", response_model=StandDrift, responses=TABLE_TOO | {404: {}})
def over_time(
    name: Name, period: Annotated[StandPeriod, Query()], caller: Reader, request: Request
) -> Response | StandDrift:
    """What all gyros of a stand say together: findings, attitude and common mode over time.

    As CSV or Parquet: a row for each session of its whole life.
    """
    with caller.read() as work:
        found = stand_reading.stand_drift(work, name, since=period.since, until=period.until, by=period.by)
        table = tabular(
            request, COLUMNS, lambda: [list(row.values()) for row in rows(stand_reading.table_of(work, name))]
        )
    return table or StandDrift.model_validate(found)
