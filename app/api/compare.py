"""Two results side by side."""

from typing import Annotated

from fastapi import APIRouter, Query, Request, Response

from app.api.auth import Reader
from app.api.pagination import TABLE_TOO, tabular
from app.api.schemas.fleet import CompareQuery, Comparison
from app.services.drift import comparing
from app.services.drift.comparing_rows import COLUMNS, rows

router = APIRouter(tags=["drift"])


@router.get("/compare", response_model=Comparison, responses=TABLE_TOO | {404: {}})
def of_two(
    query: Annotated[CompareQuery, Query()], caller: Reader, request: Request
) -> Response | Comparison:
    """What two sessions, results or gyros differ by, in units of the uncertainty of the difference.

    As CSV or Parquet: a row for each parameter.
    """
    with caller.read() as work:
        found = comparing.compare(work, query.a, query.b)
    table = tabular(request, COLUMNS, lambda: [[row[name] for name in COLUMNS] for row in rows(found)])
    return table or Comparison.model_validate(found)
