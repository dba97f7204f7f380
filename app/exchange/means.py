"""Mean currents of a session's positions: from a file, back to CSV, and against a certificate."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Final

from app.errors import Problem, problem
from app.exchange.fields import angles, check_length, counts, instants, numbers, optional_numbers
from app.exchange.formats import open_table
from app.exchange.headers import Column, lab_name, resolve
from app.exchange.plausible import current_unit
from app.exchange.positions import Positions, repeats
from app.exchange.problems import Problems
from app.exchange.rows import CertificateRow, MeansRow
from app.exchange.table import Table
from app.exchange.written import csv_bytes
from solver.errors import Message

_REQUIRED: Final = ("theta", "psi", "jx", "jy")
_OPTIONAL: Final = ("u_jx", "u_jy", "duration", "rate", "temperature", "started_at", "repeat")
_POSITIVE: Final = ("u_jx", "u_jy", "duration", "rate")
_WRITTEN: Final = (*_REQUIRED, "u_jx", "u_jy", "duration", "rate", "started_at", "temperature", "repeat")


def read_means(data: bytes, filename: str) -> tuple[list[MeansRow], list[Message]]:
    """Read a file of mean currents in any format of `formats.open_table`.

    Parameters
    ----------
    data, filename
        The whole file, and its name as the user gave it.

    Returns
    -------
    rows
        In the file's order, θ and ψ in [0, 360)°. Without a column ``repeat`` the repeats of a
        position are numbered in order of appearance.
    warnings
        Columns not used, currents that look like another unit, a row that occurs twice.

    Raises
    ------
    Invalid
        With every problem found (the first twenty in full), each with file, row and column.
    """
    table = open_table(data, filename)
    check_length(table)
    problems = Problems(filename)
    columns, warnings = resolve(table.names, _REQUIRED, _OPTIONAL, problems, table.header_line)
    problems.raise_if_any()
    rows = _rows(table, columns, problems)
    problems.raise_if_any()
    _check_positive(rows, columns, problems)
    _check_repeats(rows, columns, problems)
    warnings += current_unit(rows, columns, problems)
    problems.raise_if_any()
    return rows, warnings + _copies(rows, filename)


def _rows(table: Table, columns: dict[str, Column], problems: Problems) -> list[MeansRow]:
    theta, psi = (angles(table, columns[name], problems) for name in ("theta", "psi"))
    jx, jy = (numbers(table, columns[name], problems) for name in ("jx", "jy"))
    u_jx, u_jy, duration, rate, temperature = (
        optional_numbers(table, columns.get(name), problems) for name in _OPTIONAL[:5]
    )
    started = instants(table, columns.get("started_at"), problems)
    if "repeat" in columns:
        repeat = counts(table, columns["repeat"], problems)
    else:
        repeat = [] if problems else repeats(list(zip(theta, psi, strict=True)))
    problems.raise_if_any()
    every = (theta, psi, jx, jy, u_jx, u_jy, duration, rate, started, temperature, repeat)
    rows = zip(*every, strict=True)
    return [replace(MeansRow(*values), line=line) for values, line in zip(rows, table.lines, strict=True)]


def _check_positive(rows: Sequence[MeansRow], columns: dict[str, Column], problems: Problems) -> None:
    for name in _POSITIVE:
        for row in rows:
            value = getattr(row, lab_name(name))
            if value is not None and value <= 0:
                problems.note(
                    Message(
                        "not-positive",
                        "%(column)s must be greater than zero, not %(value)g. "
                        "Leave the cell empty when it is not known.",
                        {"column": columns[name].name, "value": value},
                    ),
                    row=row.line,
                    column=columns[name].name,
                )


def _check_repeats(rows: Sequence[MeansRow], columns: dict[str, Column], problems: Problems) -> None:
    """Note rows of one position with one number of repeat, which only a column can bring about."""
    if "repeat" not in columns:
        return
    known = Positions()
    first: dict[tuple[int, int], MeansRow] = {}
    for row in rows:
        before = first.setdefault((known.put(row.theta_deg, row.psi_deg), row.repeat), row)
        if before is not row:
            problems.note(
                Message(
                    "duplicate-position",
                    "The position θ %(theta)g°, ψ %(psi)g° with repeat %(repeat)d stands in row %(before)s "
                    "already. Give it another repeat, or leave the column repeat out.",
                    {"theta": row.theta_deg, "psi": row.psi_deg, "repeat": row.repeat, "before": before.line},
                ),
                row=row.line,
                column="repeat",
            )


def _copies(rows: Sequence[MeansRow], filename: str) -> list[Message]:
    """Warn of rows equal in position and both currents: a copy rather than a second measurement."""
    first: dict[MeansRow, int | None] = {}
    warnings: list[Message] = []
    for row in rows:
        bare = MeansRow(row.theta_deg, row.psi_deg, row.jx_ma, row.jy_ma)
        if bare in first:
            warnings.append(
                Message(
                    "same-twice",
                    "%(file)s: row %(row)s repeats row %(before)s to the last digit and counts as a second "
                    "measurement. Remove it if it is a copy.",
                    {"file": filename, "row": row.line, "before": first[bare]},
                )
            )
        first.setdefault(bare, row.line)
    return warnings


def match(
    means: Sequence[MeansRow], certificate: Sequence[CertificateRow], *, file: str | None = None
) -> tuple[list[Problem], list[Message]]:
    """Compare the measured positions with the certified ones.

    Parameters
    ----------
    file
        Name of the file of means, for the problems.

    Returns
    -------
    problems
        One for each row of means whose position has no certified angles.
    warnings
        One that names the certified positions with no measurement.
    """
    certified = Positions()
    for entry in certificate:
        certified.put(entry.theta_deg, entry.psi_deg)
    measured = Positions()
    problems: list[Problem] = []
    for row in means:
        measured.put(row.theta_deg, row.psi_deg)
        if certified.find(row.theta_deg, row.psi_deg) is None:
            problems.append(
                problem(
                    "position-not-certified",
                    "The certificate has no angles for θ %(theta)g°, ψ %(psi)g°. Add the position to the "
                    "certificate, correct it here, or remove the row.",
                    file=file,
                    row=row.line,
                    column="theta_deg",
                    theta=row.theta_deg,
                    psi=row.psi_deg,
                )
            )
    missing = [entry for entry in certificate if measured.find(entry.theta_deg, entry.psi_deg) is None]
    return problems, [_missing(missing)] if missing else []


def _missing(entries: Sequence[CertificateRow]) -> Message:
    listed = "; ".join(f"{entry.theta_deg:g}°, {entry.psi_deg:g}°" for entry in entries[:16])
    return Message(
        "positions-missing",
        "Certified positions without a measurement (θ, ψ): %(positions)s. "
        "Measure them for a smaller uncertainty.",
        {"positions": listed + ("; …" if len(entries) > 16 else "")},
    )


def renumbered(rows: Sequence[MeansRow]) -> list[MeansRow]:
    """Number the repeats of rows that come from several places anew, in their order."""
    numbers = repeats([(row.theta_deg, row.psi_deg) for row in rows])
    return [replace(row, repeat=number) for row, number in zip(rows, numbers, strict=True)]


def write_means_csv(rows: Sequence[MeansRow]) -> bytes:
    """Write mean currents as CSV: reading it back gives the same bits.

    Optional columns are written when any row has them, ``repeat`` when any is not 0.
    """
    names = [lab_name(name) for name in _REQUIRED]
    absent = {"repeat": 0}
    names += [
        name
        for name in map(lab_name, _WRITTEN[len(_REQUIRED) :])
        if any(getattr(row, name) != absent.get(name) for row in rows)
    ]
    return csv_bytes(names, [[getattr(row, name) for name in names] for row in rows])
