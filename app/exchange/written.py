"""Tables as this product writes them: CSV (commas, points, decimals that read back bit by bit) and Parquet."""

import csv
import io
from collections.abc import Iterable, Sequence
from datetime import datetime

import pyarrow as pa
import pyarrow.parquet as pq

Cell = float | int | str | datetime | None


def csv_bytes(names: Sequence[str], rows: Iterable[Sequence[Cell]]) -> bytes:
    """Write a header and rows as UTF-8 without BOM, lines ended by LF."""
    stream = io.StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow(names)
    writer.writerows([_text(cell) for cell in row] for row in rows)
    return stream.getvalue().encode()


def parquet_bytes(names: Sequence[str], rows: Iterable[Sequence[Cell]]) -> bytes:
    """Write the same table as Parquet: a column's type is that of its values, empty cells are null."""
    columns = list(zip(*rows, strict=True)) or [()] * len(names)
    table = pa.table({name: pa.array(column) for name, column in zip(names, columns, strict=True)})
    stream = pa.BufferOutputStream()
    pq.write_table(table, stream)
    content: bytes = stream.getvalue().to_pybytes()
    return content


def _text(cell: Cell) -> str:
    if cell is None:
        return ""
    if isinstance(cell, datetime):
        return cell.isoformat()
    if isinstance(cell, float):
        return repr(float(cell)).removesuffix(".0")
    return str(cell)
