"""Kinds of fields, and the bases of what comes in and what goes out."""

from datetime import UTC, date, datetime, time, timedelta
from typing import Annotated, Any, Final

from pydantic import AfterValidator, BaseModel, BeforeValidator, ConfigDict, Field, StringConstraints
from pydantic_core import PydanticCustomError

_LARGEST_ID: Final = 2**31 - 1
_YEARS: Final = range(1900, 2200)


class Incoming(BaseModel):
    """Something sent to us: a field that we do not know is refused, not ignored."""

    model_config = ConfigDict(extra="forbid", allow_inf_nan=False)


class Outgoing(BaseModel):
    """Something we answer, read from a view of the services."""

    model_config = ConfigDict(from_attributes=True, validate_by_name=True, validate_by_alias=True)


def _only_text(value: Any) -> Any:
    """JSON has no times: a bare number would be taken for seconds since 1970."""
    if not isinstance(value, str | datetime | date):
        raise PydanticCustomError("datetime_type", "a time in ISO 8601")
    return value


def _in_utc(moment: datetime) -> datetime:
    """A time without an offset is UTC; the year is one in which gyros are calibrated."""
    if moment.year not in _YEARS:
        raise PydanticCustomError("year_range", "a year from 1900 to 2199")
    return (moment if moment.tzinfo else moment.replace(tzinfo=UTC)).astimezone(UTC)


def _none_when_empty(value: Any) -> Any:
    return None if value == "" else value


def _end_of_day(value: Any) -> Any:
    """A day as the end of a period means the whole of that day."""
    if isinstance(value, str) and len(value) == len("2026-01-01"):
        day = date.fromisoformat(value)
        return datetime.combine(day, time(), UTC) + timedelta(days=1, microseconds=-1)
    return value


def _day(value: Any) -> Any:
    if isinstance(value, str) and len(value) == len("2026-01-01"):
        return value
    if isinstance(value, date) and not isinstance(value, datetime):
        return value
    raise PydanticCustomError("date_type", "a day in ISO 8601")


Id = Annotated[int, Field(ge=1, le=_LARGEST_ID)]
Number = Annotated[float, Field(strict=True)]
"""A JSON number; text is not taken for one, so that nothing is read differently here and in a file."""

Positive = Annotated[float, Field(strict=True, gt=0)]
NotNegative = Annotated[float, Field(strict=True, ge=0)]
QueryNotNegative = Annotated[float, Field(ge=0)]
"""The same in a query, where everything is text."""

Angle = Annotated[float, Field(strict=True, ge=-720, le=720)]
PathAngle = Annotated[float, Field(ge=-720, le=720, allow_inf_nan=False)]
Name = Annotated[str, StringConstraints(min_length=1, max_length=100, pattern=r"^[^\x00]*$")]
Text = Annotated[str, StringConstraints(max_length=4000, pattern=r"^[^\x00]*$")]
Day = Annotated[date, BeforeValidator(_day)]
Moment = Annotated[datetime, AfterValidator(_in_utc), BeforeValidator(_only_text)]
Since = Annotated[Moment | None, BeforeValidator(_none_when_empty)]
Until = Annotated[Moment | None, BeforeValidator(_end_of_day), BeforeValidator(_none_when_empty)]
OptionalText = Annotated[str | None, BeforeValidator(_none_when_empty)]
"""A part of the query that may stand there empty."""
