"""CSV as this product writes it: commas, decimal points, shortest decimals that read back bit by bit."""

import csv
import io
from collections.abc import Iterable, Sequence
from datetime import datetime

Cell = float | int | str | datetime | None


def csv_bytes(names: Sequence[str], rows: Iterable[Sequence[Cell]]) -> bytes:
    """Write a header and rows as UTF-8 without BOM, lines ended by LF."""
    stream = io.StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow(names)
    writer.writerows([_text(cell) for cell in row] for row in rows)
    return stream.getvalue().encode()


def _text(cell: Cell) -> str:
    if cell is None:
        return ""
    if isinstance(cell, datetime):
        return cell.isoformat()
    if isinstance(cell, float):
        return repr(float(cell)).removesuffix(".0")
    return str(cell)
