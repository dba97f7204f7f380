"""Long columns of a `Table` as arrays in the laboratory's unit: vectorised, exact all the same.

Texts are parsed by pyarrow, which rounds correctly, as Python's float() does. A shift by a power of
ten is done on the text (``0.004536`` becomes ``0.004536e3``), so it is exact too. Whatever does not
go that way, or is not finite or is absurdly large, is read cell by cell, where every problem gets its row.
"""

from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
from numpy.typing import NDArray

from app.exchange import fields
from app.exchange.fields import full_turn
from app.exchange.headers import Column
from app.exchange.numbers import LARGEST, overflow, power_of_ten, read_decimal, shifted
from app.exchange.problems import Problems
from app.exchange.table import Table, texts_of
from solver.errors import Message

Array = NDArray[np.float64]


def samples(table: Table, column: Column, problems: Problems) -> Array:
    """Read a column with a finite number in every row, (n,); NaN stands where one is wrong.

    Parameters
    ----------
    problems
        Takes a problem for each cell that is empty, no number, NaN or infinite.
    """
    unit, lab_unit = column.unit or "", column.lab_unit or ""
    values = _vectorised(table.columns[column.name], power_of_ten(unit, lab_unit), comma=table.comma)
    if values is None:
        return _cell_by_cell(table, column, range(len(table)), np.empty(len(table)), problems)
    wrong = np.flatnonzero(~(np.abs(values) <= LARGEST))
    return _cell_by_cell(table, column, wrong, values, problems) if len(wrong) else values


def _vectorised(column: Any, shift: int | None, *, comma: bool) -> Array | None:
    """Parse and shift a whole column; None when it takes more than this way can do."""
    if shift is None:
        return None
    if pa.types.is_floating(column.type) or pa.types.is_integer(column.type):
        if shift == 0:
            return _array(pc.cast(column, pa.float64(), safe=False))
        if pa.types.is_floating(column.type):
            column = pc.cast(column, pa.float64())
        column = pc.cast(column, pa.string())
    if not pa.types.is_string(column.type) or column.null_count:
        return None
    if comma:
        column = pc.replace_substring(column, ",", ".")
    if shift:
        if pc.any(pc.match_substring(column, "e", ignore_case=True)).as_py():
            return None
        column = pc.binary_join_element_wise(column, f"e{shift}", "")
    try:
        return _array(pc.cast(column, pa.float64()))
    except pa.ArrowInvalid:
        return None


def _array(column: Any) -> Array:
    return np.ascontiguousarray(column.combine_chunks().to_numpy(zero_copy_only=False), dtype=np.float64)


def _cell_by_cell(table: Table, column: Column, places: Any, values: Array, problems: Problems) -> Array:
    """Read the cells at `places` one by one into a copy of `values`, noting what is wrong."""
    values = values.copy()
    values[places] = np.nan
    cells = table.columns[column.name]
    if len(places) < len(table):
        cells = cells.take(pa.array(places))
    for place, text in zip(places, texts_of(cells), strict=True):
        number = read_decimal(text, comma=table.comma)
        if isinstance(number, Message):
            problems.note(number, row=table.lines[place], column=column.name)
            continue
        value = shifted(number, column.unit or "", column.lab_unit or "")
        if abs(value) <= LARGEST:
            values[place] = value
        else:
            problems.note(overflow(text), row=table.lines[place], column=column.name)
    return values


def angles(table: Table, column: Column, problems: Problems) -> Array:
    """Read a long column of stand angles, degrees in [0, 360), of which few are different."""
    encoded = table.columns[column.name].combine_chunks().dictionary_encode(null_encoding="encode")
    codes = encoded.indices.to_numpy(zero_copy_only=False)
    different: list[float] = []
    for code, text in enumerate(texts_of(encoded.dictionary)):
        number = read_decimal(text, comma=table.comma)
        if isinstance(number, Message):
            first = int(np.argmax(codes == code)) if problems.room else 0
            problems.note(number, row=table.lines[first], column=column.name)
            different.append(np.nan)
        else:
            different.append(full_turn(number, column.unit or "deg"))
    return np.asarray(np.array(different, dtype=np.float64)[codes])


def counts(table: Table, column: Column, problems: Problems) -> NDArray[np.int64]:
    """Read a long column of repeats: whole numbers from 0."""
    plain = _vectorised(table.columns[column.name], 0, comma=table.comma)
    if (
        plain is not None
        and np.isfinite(plain).all()
        and ((plain >= 0) & (plain % 1 == 0) & (plain < 1e6)).all()
    ):
        return plain.astype(np.int64)
    return np.array(fields.counts(table, column, problems), dtype=np.int64)
