"""Lists: a part at a time, the way to the next one, and the same rows as CSV."""

import base64
import binascii
from collections.abc import Callable, Mapping, Sequence
from datetime import datetime
from typing import Annotated, Any, Final, Generic, TypeVar

from fastapi import Request, Response
from fastapi.responses import JSONResponse
from pydantic import BaseModel, Field

from app.api.schemas.common import Incoming
from app.errors import Invalid, problem
from app.exchange.written import csv_bytes, parquet_bytes

T = TypeVar("T")
M = TypeVar("M", bound=BaseModel)
Cell = float | int | str | datetime | None
Responses = dict[int | str, dict[str, Any]]
Columns = Mapping[str, Callable[[T], Cell]]

CSV_TOO: Final[Responses] = {200: {"content": {"text/csv": {"schema": {"type": "string"}}}}}
"""For a route's `responses`: the list comes as CSV too."""
PARQUET: Final = "application/vnd.apache.parquet"
TABLE_TOO: Final[Responses] = {
    200: {
        "content": CSV_TOO[200]["content"]
        | {PARQUET: {"schema": {"type": "string", "contentMediaType": PARQUET}}}
    }
}
"""For a route's `responses`: it comes as a table too, CSV or Parquet."""


class Part(Incoming):
    """Which part of a list."""

    limit: Annotated[int, Field(ge=1, le=500, description="Most items to give.")] = 50
    cursor: Annotated[
        str | None, Field(max_length=400, description="Where to go on: from the `next` of the part before.")
    ] = None

    def after(self) -> str | None:
        """The key of the last item before this part."""
        if not self.cursor:
            return None
        try:
            return base64.urlsafe_b64decode(self.cursor.encode("ascii")).decode()
        except (UnicodeError, binascii.Error, ValueError):
            raise _unusable() from None

    def before(self) -> int | None:
        """The same where the key is a number."""
        key = self.after()
        if key is not None and not (key.isdecimal() and len(key) < 10):
            raise _unusable()
        return None if key is None else int(key)


class Listing(BaseModel, Generic[T]):
    """Part of a list; `next` is the address of the following part, null at the end."""

    items: list[T]
    next: str | None


def cut(items: Sequence[T], part: Part, key: Callable[[T], str]) -> tuple[Sequence[T], str | None]:
    """The part of a whole list that follows the cursor's item, and the key to go on with."""
    after = part.after()
    places = [place for place, item in enumerate(items, start=1) if key(item) == after]
    if after is not None and not places:
        raise _unusable()
    rest = items[places[0] if places else 0 :]
    return rest[: part.limit], key(rest[part.limit - 1]) if len(rest) > part.limit else None


def listed(request: Request, items: Sequence[M], next_key: str | None, columns: Columns[M]) -> Response:
    """Answer with a part of a list: JSON, or CSV or Parquet for whoever prefers it."""
    following = None if next_key is None else _address(request, next_key)
    answer = tabular(
        request, list(columns), lambda: [[cell(item) for cell in columns.values()] for item in items]
    )
    if answer is None:
        content = {"items": [item.model_dump(mode="json") for item in items], "next": following}
        answer = JSONResponse(content, headers={"vary": "Accept"})
    if following:
        answer.headers["link"] = f'<{following}>; rel="next"'
    return answer


def wants_csv(request: Request) -> bool:
    """Whether ``text/csv`` is preferred over JSON."""
    return _preferred(request, "text/csv") == "text/csv"


def wants_table(request: Request) -> bool:
    """Whether CSV or Parquet is preferred over JSON."""
    return _preferred(request, "text/csv", PARQUET) != "application/json"


def tabular(
    request: Request, names: Sequence[str], rows: Callable[[], Sequence[Sequence[Cell]]]
) -> Response | None:
    """The answer as a table for whoever prefers CSV or Parquet; None for whoever wants JSON."""
    form = _preferred(request, "text/csv", PARQUET)
    if form == "application/json":
        return None
    content = (csv_bytes if form == "text/csv" else parquet_bytes)(names, rows())
    return Response(content, headers={"vary": "Accept"}, media_type=form)


def _preferred(request: Request, *others: str) -> str:
    """The media type wished for most, JSON before the others."""
    wishes = dict.fromkeys(("application/json", *others), 0.0)
    for entry in request.headers.get("accept", "").split(","):
        name, _, quality = entry.partition(";")
        if name.strip().lower() in wishes:
            wishes[name.strip().lower()] = _quality(quality)
    return max(wishes, key=lambda name: wishes[name])


def _quality(parameters: str) -> float:
    for parameter in parameters.split(";"):
        name, _, value = parameter.strip().partition("=")
        if name == "q":
            try:
                return float(value)
            except ValueError:
                return 0.0
    return 1.0


def _address(request: Request, key: str) -> str:
    cursor = base64.urlsafe_b64encode(key.encode()).decode("ascii")
    url = request.url.include_query_params(cursor=cursor)
    return f"{url.path}?{url.query}"


def _unusable() -> Invalid:
    return Invalid(
        problem("bad-cursor", "This cursor was not given by us. Start without one.", column="cursor")
    )
