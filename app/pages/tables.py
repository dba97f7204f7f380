"""A list as CSV, JSON or Parquet: the same rows as on the page, in laboratory units, for spreadsheets and programs."""

import csv
import io
import json
from collections.abc import Sequence
from datetime import datetime
from typing import Any

from fastapi import Response

from app.exchange.written import parquet_bytes

Row = dict[str, Any]


def csv_answer(rows: Sequence[Row], columns: Sequence[str], name: str) -> Response:
    """The rows as a CSV file; numbers with every bit, points as decimal signs."""
    text = io.StringIO()
    writer = csv.DictWriter(text, columns, lineterminator="\n")
    writer.writeheader()
    writer.writerows({key: _harmless(value) for key, value in row.items()} for row in rows)
    return Response(
        text.getvalue(), media_type="text/csv; charset=utf-8",
        headers={"content-disposition": f'attachment; filename="{name}.csv"'},
    )  # fmt: skip


def json_answer(rows: Sequence[Row]) -> Response:
    """The rows as a JSON list."""
    return Response(json.dumps(rows, default=_as_text, ensure_ascii=False), media_type="application/json")


def parquet_answer(rows: Sequence[Row], columns: Sequence[str], name: str) -> Response:
    """The rows as a Parquet file."""
    content = parquet_bytes(columns, [[row.get(column) for column in columns] for row in rows])
    return Response(
        content, media_type="application/vnd.apache.parquet",
        headers={"content-disposition": f'attachment; filename="{name}.parquet"'},
    )  # fmt: skip


def _as_text(value: object) -> str:
    return value.isoformat() if isinstance(value, datetime) else str(value)


def _harmless(value: Any) -> Any:
    """Keep a spreadsheet from taking somebody's text for a formula."""
    if isinstance(value, datetime):
        return value.isoformat()
    return f"'{value}" if isinstance(value, str) and value.startswith(("=", "+", "-", "@")) else value
