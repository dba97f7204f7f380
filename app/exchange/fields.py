"""Columns of a `Table` as numbers in the laboratory's unit, problems named by row and column."""

from collections.abc import Iterator
from datetime import UTC, datetime
from decimal import Decimal
from math import nan
from typing import Final

from app.exchange.headers import Column
from app.exchange.numbers import LARGEST, exact_in, overflow, read_decimal, shifted
from app.exchange.problems import Problems
from app.exchange.table import Table
from solver.errors import Message

MOST_ROWS: Final = 100_000
"""A table of positions is shorter; a longer one is a record brought to the wrong place."""


def check_length(table: Table) -> None:
    """Refuse a table too long to be one of positions.

    Raises
    ------
    Invalid
        ``too-many-rows``.
    """
    problems = Problems(table.file)
    if len(table) > MOST_ROWS:
        problems.note(
            Message(
                "too-many-rows",
                "A table of positions cannot have %(rows)d rows. If it is a record of currents, name its "
                "column of times t_s.",
                {"rows": len(table)},
            )
        )
    problems.raise_if_any()


def numbers(table: Table, column: Column, problems: Problems) -> list[float]:
    """Read a column in which every row must have a number; NaN stands where one is wrong."""
    return [
        nan if value is None else _rounded(value, column, problems, row)
        for row, value in _decimals(table, column, problems, blank=False)
    ]


def optional_numbers(table: Table, column: Column | None, problems: Problems) -> list[float | None]:
    """Read a column that may be missing or have empty cells: None there."""
    if column is None:
        return [None] * len(table)
    return [
        None if value is None else _rounded(value, column, problems, row)
        for row, value in _decimals(table, column, problems, blank=True)
    ]


def angles(table: Table, column: Column, problems: Problems) -> list[float]:
    """Read a column of stand angles, degrees, brought exactly into [0, 360)."""
    return [
        nan if value is None else full_turn(value, column.unit or "deg")
        for _, value in _decimals(table, column, problems, blank=False)
    ]


def full_turn(value: Decimal, unit: str = "deg") -> float:
    """Bring an angle into [0, 360)°: the float64 nearest to the exact remainder."""
    nearest = float(exact_in(value, unit, "deg") % 360)
    return nearest if nearest < 360.0 else 0.0


def _decimals(
    table: Table, column: Column, problems: Problems, *, blank: bool
) -> Iterator[tuple[int, Decimal | None]]:
    """Line and exact value, in the column's own unit, of each row; None where there is none."""
    for row, text in zip(table.lines, table.texts(column.name), strict=True):
        if blank and not text.strip():
            yield row, None
            continue
        value = read_decimal(text, comma=table.comma)
        if isinstance(value, Message):
            problems.note(value, row=row, column=column.name)
            yield row, None
        else:
            yield row, value


def _rounded(value: Decimal, column: Column, problems: Problems, row: int) -> float:
    result = shifted(value, column.unit or "", column.lab_unit or "")
    if abs(result) > LARGEST:
        problems.note(overflow(str(value)), row=row, column=column.name)
        return nan
    return result


def counts(table: Table, column: Column, problems: Problems) -> list[int]:
    """Read a column of whole numbers from 0."""
    values: list[int] = []
    for row, value in _decimals(table, column, problems, blank=False):
        whole = value is not None and value == value.to_integral_value() and 0 <= value < 10**6
        values.append(int(value) if whole and value is not None else 0)
        if value is not None and not whole:
            problems.note(
                Message(
                    "not-a-count",
                    "%(value)s does not count repeats. Write 0 for the first measurement of a position, "
                    "1 for its first repeat.",
                    {"value": str(value)[:40]},
                ),
                row=row,
                column=column.name,
            )
    return values


def instants(table: Table, column: Column | None, problems: Problems) -> list[datetime | None]:
    """Read a column of times; empty cells are None, a time without offset is UTC."""
    if column is None:
        return [None] * len(table)
    values: list[datetime | None] = []
    for row, text in zip(table.lines, table.texts(column.name), strict=True):
        value = instant(text) if text.strip() else None
        if isinstance(value, Message):
            problems.note(value, row=row, column=column.name)
            value = None
        values.append(value)
    return values


def instant(text: str) -> datetime | Message:
    """Read one time in ISO 8601; without offset it is UTC."""
    try:
        value = datetime.fromisoformat(text.strip())
    except ValueError:
        return Message(
            "bad-time",
            "“%(text)s” is not a time. Write it like 2026-03-01T09:30:00+03:00.",
            {"text": text[:40]},
        )
    return value if value.tzinfo else value.replace(tzinfo=UTC)
