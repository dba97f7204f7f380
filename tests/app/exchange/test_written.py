"""The same table as CSV and as Parquet."""

import io
from datetime import UTC, datetime

import pyarrow.parquet as pq

from app.exchange.written import csv_bytes, parquet_bytes

NAMES = ("gyro", "at", "value", "session")
ROWS = [("0417", datetime(2026, 3, 1, 9, 30, tzinfo=UTC), 0.1, 78), ("0423", None, None, 79)]


def test_csv_reads_back_bit_by_bit() -> None:
    assert csv_bytes(NAMES, ROWS).decode().splitlines() == [
        "gyro,at,value,session", "0417,2026-03-01T09:30:00+00:00,0.1,78", "0423,,,79",
    ]  # fmt: skip


def test_parquet_holds_the_same_values() -> None:
    read = pq.read_table(io.BytesIO(parquet_bytes(NAMES, ROWS)))
    assert read.column_names == list(NAMES)
    assert [tuple(row.values()) for row in read.to_pylist()] == ROWS


def test_a_table_without_rows_keeps_its_columns() -> None:
    assert pq.read_table(io.BytesIO(parquet_bytes(NAMES, []))).column_names == list(NAMES)
    assert csv_bytes(NAMES, []) == b"gyro,at,value,session\n"
