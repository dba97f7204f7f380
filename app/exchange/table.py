"""A file of columns, whatever its format: CSV, Parquet or NumPy's npz, each as it is or compressed."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, TypeAlias

import pyarrow as pa
import pyarrow.compute as pc

Values: TypeAlias = "pa.ChunkedArray[Any]"
"""A column as pyarrow holds it."""


@dataclass(frozen=True, slots=True)
class Table:
    """Named columns of one length, values as the file has them.

    Attributes
    ----------
    file
        Name of the file as the user gave it.
    columns
        By name, lower case: texts from CSV; texts, numbers or times from Parquet and npz.
    lines
        Line of each row in the file as an editor counts it; row numbers from 1 where the format
        has no lines.
    header_line
        Line of the header, None where the format has no lines.
    comma
        Whether a decimal comma is understood in texts.
    metadata
        What the file says beside its columns (Parquet's key-value metadata).
    """

    file: str
    columns: Mapping[str, Values]
    lines: Sequence[int]
    header_line: int | None
    comma: bool
    metadata: Mapping[str, str] = field(default_factory=dict)

    def __len__(self) -> int:
        return len(self.lines)

    @property
    def names(self) -> tuple[str, ...]:
        """Column names, lower case, in the file's order."""
        return tuple(self.columns)

    def texts(self, name: str) -> Iterator[str]:
        """Iterate over a column's values as text; empty where there is none."""
        return texts_of(self.columns[name])


def texts_of(column: Any) -> Iterator[str]:
    """Values of a column as text; empty where there is none.

    A float64 becomes the shortest decimal that reads back as the same bits.
    """
    if pa.types.is_floating(column.type):
        column = pc.cast(column, pa.float64())
    elif pa.types.is_timestamp(column.type):
        instants = pc.cast(column, pa.timestamp("us", column.type.tz), safe=False).to_pylist()
        return ("" if value is None else value.isoformat() for value in instants)
    return ("" if value is None else str(value) for value in column.to_pylist())
