"""Parquet and NumPy's npz to a `Table`: nothing is believed about sizes before it is checked."""

import io
import math
import zipfile
import zlib
from collections.abc import Mapping
from typing import Any, Final

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from numpy.lib import format as npy

from app.exchange.compression import LARGEST_BYTES, too_big
from app.exchange.headers import header_names
from app.exchange.problems import Problems, refuse
from app.exchange.table import Table, Values
from solver.errors import Message

_BYTES_PER_VALUE: Final = 8
_MOST_COLUMNS: Final = 1000

# what zipfile and numpy raise on bytes that are no npz
_DAMAGED: Final = (
    OSError, ValueError, KeyError, TypeError, EOFError, SyntaxError, RuntimeError, NotImplementedError,
    RecursionError, MemoryError, zipfile.BadZipFile, zipfile.LargeZipFile, zlib.error,
)  # fmt: skip


def read_parquet(data: bytes, filename: str) -> Table:
    """Read the flat columns of a Parquet file.

    Raises
    ------
    Invalid
        Damaged, too big when unpacked, no row, or a column name twice.
    """
    try:
        file = pq.ParquetFile(pa.BufferReader(data))
        schema = file.schema_arrow
        if (
            len(schema) > _MOST_COLUMNS
            or file.metadata.num_rows * len(schema) * _BYTES_PER_VALUE > LARGEST_BYTES
        ):
            raise too_big(filename, LARGEST_BYTES)
        flat = [place for place, item in enumerate(schema) if not pa.types.is_nested(item.type)]
        table = file.read(use_threads=False)
    except (OSError, pa.ArrowException, MemoryError, OverflowError, ValueError) as error:
        raise refuse(
            "damaged",
            "The Parquet file is damaged or was cut short. Copy or export it again.",
            file=filename,
        ) from error
    if table.nbytes > LARGEST_BYTES:
        raise too_big(filename, LARGEST_BYTES)
    names = _names([table.column_names[place] for place in flat], table.num_rows, filename)
    columns = {name: _plain(table.column(place)) for name, place in zip(names, flat, strict=True)}
    return Table(filename, columns, range(1, table.num_rows + 1), None, True, _metadata(schema))


def _plain(column: Values) -> Values:
    """Values of a dictionary-encoded column instead of its codes."""
    if pa.types.is_dictionary(column.type):
        return column.cast(column.type.value_type)
    return column


def _metadata(schema: pa.Schema) -> Mapping[str, str]:
    pairs = (schema.metadata or {}).items()
    return {key.decode("utf-8", "replace"): value.decode("utf-8", "replace") for key, value in pairs}


def _names(names: list[str], rows: int, filename: str) -> list[str]:
    problems = Problems(filename)
    lower = header_names(names, problems, None)
    if not rows or not names:
        problems.note(Message("no-rows", "The file holds no row. Export it again."))
    problems.raise_if_any()
    return lower


def read_npz(data: bytes, filename: str) -> Table:
    """Read an npz file of one-dimensional arrays of one length; single values count for every row.

    Raises
    ------
    Invalid
        Damaged, too big, arrays of several lengths or of something else than numbers or text.
    """
    try:
        arrays = _arrays(data, filename)
    except _DAMAGED as error:
        raise refuse(
            "damaged",
            "The npz file is damaged, or holds something else than plain arrays. Save it with numpy.savez.",
            file=filename,
        ) from error
    problems = Problems(filename)
    lengths = {len(array) for array in arrays.values() if array.ndim}
    for name, array in arrays.items():
        if array.ndim > 1 or array.dtype.kind not in "fiuU":
            problems.note(
                Message(
                    "not-a-column",
                    "The array %(name)s is not one row of numbers. "
                    "Save each column as a one-dimensional array.",
                    {"name": name},
                ),
                column=name,
            )
    if len(lengths) > 1:
        listed = ", ".join(f"{name} {len(array)}" for name, array in arrays.items() if array.ndim)
        problems.note(
            Message(
                "ragged-columns",
                "The arrays have different lengths (%(lengths)s). Save arrays of one length.",
                {"lengths": listed},
            )
        )
    problems.raise_if_any()
    rows = lengths.pop() if lengths else 0
    names = _names(list(arrays), rows, filename)
    columns = {name: _column(array, rows) for name, array in zip(names, arrays.values(), strict=True)}
    return Table(filename, columns, range(1, rows + 1), None, True)


def _arrays(data: bytes, filename: str) -> dict[str, np.ndarray[Any, Any]]:
    """Unpack the members, each no longer than its directory entry says."""
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        members = [item for item in archive.infolist() if item.filename.endswith(".npy")]
        if len(members) > _MOST_COLUMNS or sum(item.file_size for item in members) > LARGEST_BYTES:
            raise too_big(filename, LARGEST_BYTES)
        return {item.filename.removesuffix(".npy"): _array(archive.read(item)) for item in members}


def _array(member: bytes) -> np.ndarray[Any, Any]:
    """Read one array; its header cannot claim more than there are bytes."""
    stream = io.BytesIO(member)
    version = npy.read_magic(stream)
    read_header = npy.read_array_header_1_0 if version == (1, 0) else npy.read_array_header_2_0
    shape, _, dtype = read_header(stream)
    values = member[stream.tell() :]
    if dtype.hasobject or math.prod(shape) * dtype.itemsize != len(values) or len(shape) > 2:
        raise ValueError
    return np.frombuffer(values, dtype).reshape(shape)


def _column(array: np.ndarray[Any, Any], rows: int) -> Values:
    full = np.broadcast_to(array, (rows,)) if array.ndim == 0 else array
    if full.dtype.kind == "f":
        full = full.astype(np.float64)
    elif full.dtype.kind in "iu":
        full = full.astype(full.dtype.newbyteorder("="))
    return pa.chunked_array([pa.array(np.ascontiguousarray(full))])
