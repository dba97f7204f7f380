"""CSV to a `Table`, with the line of every row; what is malformed is named by line.

Two ways lead to the same table. Large files without quotes, comments or empty lines between their
rows go through pyarrow. All others, and every file that pyarrow refuses, go through the csv module
line by line, which knows what to say about them.
"""

import csv
import io
import re
from collections.abc import Iterator, Sequence
from typing import Final

import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.csv as arrow_csv

from app.exchange.headers import header_names
from app.exchange.problems import Problems, refuse
from app.exchange.table import Table, Values
from solver.errors import Message

FAST_FROM_BYTES: Final = 64 * 2**10
"""Smaller files are read line by line at once: that is quick enough."""

_SEPARATORS: Final = ";\t,"
_SEPARATOR_NAMES: Final = {";": "semicolons", "\t": "tabs", ",": "commas"}
_SLOW_MARKS: Final = (b'"', b"\n#", b"\n\n", b"\n\r", b"\n ", b"\n\t", b"\x00")
_LONE_RETURN = re.compile(rb"\r(?!\n)")
_NUMERIC = re.compile(r"[-+−–0-9.,eE\s]*[0-9][-+−–0-9.,eE\s]*")

Rows = Iterator[tuple[int, list[str]]]


def read_csv(data: bytes, filename: str) -> Table:
    """Read CSV with a header, separated by commas, semicolons or tabs.

    Raises
    ------
    Invalid
        Not UTF-8, no header, a header name twice, rows of another length than the header.
    """
    data = data.removeprefix(b"\xef\xbb\xbf")
    _check_text(data, filename)
    fast = _read_fast(data, filename) if len(data) >= FAST_FROM_BYTES else None
    return fast or _read_slow(data, filename)


def _check_text(data: bytes, filename: str) -> None:
    """Refuse what is not UTF-8 text, naming the first such byte."""
    if data.startswith((b"\xff\xfe", b"\xfe\xff")) or b"\x00" in data[:4096]:
        raise refuse(
            "not-utf8",
            "This is not a CSV file in UTF-8 (it may be UTF-16, or no text at all). "
            "Save it as “CSV UTF-8”, or as Parquet or npz.",
            file=filename,
        )
    if data.isascii():
        return
    try:
        data.decode("utf-8")
    except UnicodeDecodeError as error:
        raise refuse(
            "not-utf8",
            "Byte %(place)d of this line (hexadecimal %(byte)s) is not UTF-8. Save the file as “CSV UTF-8”.",
            file=filename,
            row=data.count(b"\n", 0, error.start) + 1,
            place=error.start - data.rfind(b"\n", 0, error.start),
            byte=f"{data[error.start]:02X}",
        ) from None


def _separator(header: str) -> str:
    """Take the separator from the header: column names hold none themselves."""
    counts = {mark: header.count(mark) for mark in _SEPARATORS}
    return max(counts, key=lambda mark: counts[mark]) if any(counts.values()) else ","


def _names(cells: Sequence[str], filename: str, line: int) -> list[str]:
    """Check the header and return its names in lower case; unnamed trailing columns are dropped."""
    if all(_NUMERIC.fullmatch(cell) for cell in cells if cell.strip()):
        raise refuse(
            "no-header",
            "The first line holds numbers. Put a line with the column names above it, like "
            "“theta_deg,psi_deg,jx_ma,jy_ma”.",
            file=filename,
            row=line,
        )
    problems = Problems(filename)
    names = header_names(cells, problems, line)
    while names and not names[-1]:
        names.pop()
    for place, name in enumerate(names, 1):
        if not name:
            problems.note(
                Message(
                    "unnamed-column",
                    "Column %(place)d has no name. Name it in the header, or remove it.",
                    {"place": place},
                ),
                row=line,
            )
    problems.raise_if_any()
    return names


def _read_fast(data: bytes, filename: str) -> Table | None:
    """Read a large plain file through pyarrow; None when it is not plain enough."""
    start, line = 0, 1
    while (end := data.find(b"\n", start)) >= 0:
        header = data[start:end].strip()
        if header and not header.startswith(b"#"):
            break
        start, line = end + 1, line + 1
    body = data[end + 1 :].rstrip()
    if end < 0 or not body or b"\r" in header or body[:1] in b"# \t\r\n":
        return None
    if any(mark in data for mark in _SLOW_MARKS[:1]) or any(mark in body for mark in _SLOW_MARKS):
        return None
    if b"\r" in body and _LONE_RETURN.search(body):
        return None
    text = header.decode("utf-8")
    separator = _separator(text)
    names = _names(text.split(separator), filename, line)
    columns = _parse_plain(body, separator, names)
    if columns is None or pc.any(pc.equal(columns[names[0]], pa.scalar(""))).as_py():
        return None
    rows = columns[names[0]].length()
    return Table(filename, columns, range(line + 1, line + 1 + rows), line, separator != ",")


def _parse_plain(body: bytes, separator: str, names: list[str]) -> dict[str, Values] | None:
    try:
        table = arrow_csv.read_csv(
            io.BytesIO(body),
            arrow_csv.ReadOptions(column_names=names, use_threads=False),
            arrow_csv.ParseOptions(delimiter=separator, quote_char=False, ignore_empty_lines=False),
            arrow_csv.ConvertOptions(
                column_types=dict.fromkeys(names, pa.string()), strings_can_be_null=False, check_utf8=False
            ),
        )
    except pa.ArrowException:
        return None
    return {name: table.column(name) for name in names}


class _Lines:
    """Lines of a text without comments and empty lines; `number` is that of the last one given."""

    def __init__(self, text: str) -> None:
        self._lines = io.StringIO(text, newline=None)
        self.number = 0

    def __iter__(self) -> "_Lines":
        return self

    def __next__(self) -> str:
        for line in self._lines:
            self.number += 1
            bare = line.strip()
            if bare and not bare.startswith("#"):
                return line
        raise StopIteration


def _read_slow(data: bytes, filename: str) -> Table:
    """Read line by line through the csv module, collecting what is wrong."""
    lines = _Lines(data.decode("utf-8"))
    header = next(lines, "")
    if not header:
        raise refuse("empty-file", "The file has no header and no row. Export it again.", file=filename)
    separator, header_line = _separator(header), lines.number
    names = _names(next(csv.reader([header], delimiter=separator), []), filename, header_line)
    problems = Problems(filename)
    numbers: list[int] = []
    rows: list[list[str]] = []
    for number, cells in _records(lines, separator, problems):
        if len(cells) != len(names):
            cells = _trimmed(cells, len(names))
        if len(cells) == len(names):
            numbers.append(number)
            rows.append(cells)
        elif any(cell.strip() for cell in cells):
            problems.note(_ragged(cells, len(names), separator), row=number)
    if not rows and not problems:
        problems.note(
            Message("no-rows", "There is no row below the header. Export the file again."), row=header_line
        )
    problems.raise_if_any()
    columns = {
        name: pa.chunked_array([pa.array(cells, pa.string())])
        for name, cells in zip(names, zip(*rows, strict=True), strict=True)
    }
    return Table(filename, columns, numbers, header_line, separator != ",")


def _records(lines: _Lines, separator: str, problems: Problems) -> Rows:
    """Give the line and the cells of each row that is not empty."""
    reader = csv.reader(lines, delimiter=separator, strict=True)
    while True:
        try:
            cells = next(reader, None)
        except csv.Error:
            problems.note(
                Message(
                    "bad-quotes",
                    "The quotation marks of this row do not fit, or a value is too long. "
                    "Write the values without quotation marks.",
                ),
                row=lines.number,
            )
            return
        if cells is None:
            return
        if any(cell.strip() for cell in cells):
            yield lines.number, cells


def _trimmed(cells: list[str], width: int) -> list[str]:
    """Drop empty cells beyond the header's columns, as spreadsheets write them."""
    return cells[:width] if not any(cell.strip() for cell in cells[width:]) else cells


def _ragged(cells: list[str], width: int, separator: str) -> Message:
    """Say why a row may have another number of values than the header has columns."""
    others = [mark for mark in _SEPARATORS if mark != separator and mark in separator.join(cells)]
    if len(cells) == 1 and others and separator not in cells[0]:
        return Message(
            "mixed-separators",
            "The header is separated by %(header)s, this row by %(row)s. "
            "Use one separator in the whole file.",
            {"header": _SEPARATOR_NAMES[separator], "row": _SEPARATOR_NAMES[others[0]]},
        )
    if separator == "," and len(cells) > width and all(_NUMERIC.fullmatch(cell) for cell in cells if cell):
        return Message(
            "decimal-comma",
            "This row has %(cells)d values for %(width)d columns: probably decimal commas in a file "
            "separated by commas. Separate the columns by semicolons, or write decimal points.",
            {"cells": len(cells), "width": width},
        )
    return Message(
        "ragged-row",
        "This row has %(cells)d values, the header %(width)d columns. Give every column one value.",
        {"cells": len(cells), "width": width},
    )
