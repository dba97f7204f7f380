"""The rows of a certificate as a person gives them: typed into a grid, pasted, or as a file.

All three become the file that `app.exchange.certificate` reads, so that one place says what is wrong;
its problems come back to the cell of the grid or the line of the text they belong to.
"""

import csv
import io
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Final

from starlette.datastructures import FormData, UploadFile

from app.errors import Invalid, Problem, problem
from app.exchange.certificate import read_certificate
from app.exchange.rows import CertificateRow
from app.figures import entered
from app.i18n import gettext
from solver.errors import Message

COLUMNS: Final = tuple(CertificateRow.__slots__)
ANGLES: Final = COLUMNS[2:5]
UNCERTAINTIES: Final = COLUMNS[5:]
MOST_ROWS: Final = 200
"""A grid of this size can still be looked through; more come as a file."""

Cells = Mapping[str, str]


@dataclass(frozen=True, slots=True)
class Given:
    """What was given: rows read, warnings about them, and the grid to show when the form comes back."""

    rows: Sequence[CertificateRow]
    warnings: Sequence[Message]
    grid: Sequence[Cells]


class Unusable(Exception):
    """The rows cannot be used; `grid` is what to show again."""

    def __init__(self, problems: Sequence[Problem], grid: Sequence[Cells]) -> None:
        super().__init__("\n".join(item.text for item in problems))
        self.problems = problems
        self.grid = grid


def empty_grid() -> list[Cells]:
    """Sixteen positions, θ outer, ψ inner, with nothing certified yet."""
    steps = ("0", "90", "180", "270")
    blank = dict.fromkeys(COLUMNS, "")
    return [{**blank, "theta_deg": theta, "psi_deg": psi} for theta in steps for psi in steps]


def grid_of(rows: Sequence[CertificateRow]) -> list[Cells]:
    """Rows as the grid shows them."""
    return [{name: entered(getattr(row, name)) for name in COLUMNS} for row in rows]


def given(sent: FormData) -> Given:
    """Read what was given: a file counts before pasted text, that before the grid.

    Raises
    ------
    Unusable
        With every problem found: of the grid by cell (`column` is ``alpha_arcsec.3``), of text and
        file by row and column.
    """
    grid = sent_grid(sent)
    upload, pasted = sent.get("file"), sent.get("pasted")
    if isinstance(upload, UploadFile) and upload.filename:
        return _read(upload.file.read(), upload.filename, grid)
    if isinstance(pasted, str) and pasted.strip():
        return _read_pasted(pasted, grid)
    return _read_grid(grid)


def sent_grid(sent: FormData) -> list[Cells]:
    """The grid as it was typed."""
    grid: list[Cells] = []
    for number in range(MOST_ROWS):
        cells = {name: sent.get(f"{name}.{number}") for name in COLUMNS}
        if cells["theta_deg"] is None:
            break
        grid.append({name: text if isinstance(text, str) else "" for name, text in cells.items()})
    return grid or empty_grid()


def _read(data: bytes, name: str, grid: Sequence[Cells], lines_before: int = 0) -> Given:
    try:
        rows, warnings = read_certificate(data, name)
    except Invalid as error:
        moved = [replace(item, row=item.row - lines_before if item.row else None) for item in error.problems]
        raise Unusable(moved, grid) from error
    return Given(rows, warnings, grid_of(rows))


def _read_pasted(text: str, grid: Sequence[Cells]) -> Given:
    """Cells copied from a spreadsheet, separated by tabs, often come without their head."""
    text = text.strip("\r\n")
    first = text.splitlines()[0]
    headless = not any(letter.isalpha() for letter in first)
    if headless:
        separator = next((mark for mark in "\t;" if mark in first), ",")
        width = max(len(COLUMNS) - len(UNCERTAINTIES), first.count(separator) + 1)
        text = f"{separator.join(COLUMNS[:width])}\n{text}"
    return _read(text.encode(), gettext("pasted rows"), grid, lines_before=1 if headless else 0)


def _read_grid(grid: Sequence[Cells]) -> Given:
    """The rows of the grid in which something is certified."""
    used = [
        number
        for number, cells in enumerate(grid)
        if any(cells[name].strip() for name in (*ANGLES, *UNCERTAINTIES))
    ]
    if not used:
        nothing = problem(
            "no-angles", "No angle is entered. Type the certificate’s angles into the table, paste them, or bring "
            "its file.",
        )  # fmt: skip
        raise Unusable([nothing], grid)
    columns = [
        name
        for name in COLUMNS
        if name not in UNCERTAINTIES or any(grid[number][name].strip() for number in used)
    ]
    text = io.StringIO()
    writer = csv.writer(text, delimiter=";", lineterminator="\n")
    writer.writerow(columns)
    writer.writerows([[" ".join(grid[number][name].split()) for name in columns] for number in used])
    try:
        rows, warnings = read_certificate(text.getvalue().encode(), gettext("the table"))
    except Invalid as error:
        raise Unusable([_in_cell(item, used) for item in error.problems], grid) from error
    return Given(rows, warnings, grid)


def _in_cell(item: Problem, used: Sequence[int]) -> Problem:
    """A problem of the file made of the grid, at its cell; line 1 is the head."""
    if item.row is None or item.column is None or not 2 <= item.row <= len(used) + 1:
        return item
    return replace(item, file=None, row=None, column=f"{item.column}.{used[item.row - 2]}")
