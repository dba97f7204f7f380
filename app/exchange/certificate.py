"""A stand's certificate: the misalignment of each position, from a file and back to CSV."""

from collections.abc import Sequence
from typing import Final

from app.exchange.fields import angles, check_length, numbers, optional_numbers
from app.exchange.formats import open_table
from app.exchange.headers import Column, lab_name, resolve
from app.exchange.problems import Problems
from app.exchange.rows import CertificateRow
from app.exchange.table import Table
from app.exchange.written import csv_bytes
from solver.errors import Message
from solver.units import ARCSEC_PER_DEG

LARGEST_ARCSEC: Final = 10.0 * ARCSEC_PER_DEG
"""A misalignment above 10° is probably written in another unit than the header says."""

SMALLEST_ARCSEC: Final = 0.05
"""When no misalignment of a stand reaches this, they are probably degrees or radians."""

_ANGLES: Final = ("alpha", "beta", "gamma")
_REQUIRED: Final = ("theta", "psi", *_ANGLES)
_OPTIONAL: Final = ("u_alpha", "u_beta", "u_gamma")


def read_certificate(data: bytes, filename: str) -> tuple[list[CertificateRow], list[Message]]:
    """Read a certificate in any format of `formats.open_table`.

    Parameters
    ----------
    data, filename
        The whole file, and its name as the user gave it.

    Returns
    -------
    rows
        In the file's order, θ and ψ in [0, 360)°, each position once.
    warnings
        Columns not used, angles that look like another unit, uncertainties partly missing.

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
    _check_duplicates(rows, table, problems)
    _check_uncertainties(rows, table, columns, problems)
    problems.raise_if_any()
    return rows, [*warnings, *_unit_warnings(rows, filename), *_gap_warnings(rows, columns, filename)]


def _rows(table: Table, columns: dict[str, Column], problems: Problems) -> list[CertificateRow]:
    stand = [angles(table, columns[name], problems) for name in ("theta", "psi")]
    certified = [numbers(table, columns[name], problems) for name in _ANGLES]
    uncertain = [optional_numbers(table, columns.get(name), problems) for name in _OPTIONAL]
    return [CertificateRow(*values) for values in zip(*stand, *certified, *uncertain, strict=True)]


def _check_duplicates(rows: Sequence[CertificateRow], table: Table, problems: Problems) -> None:
    first: dict[tuple[float, float], int] = {}
    for line, row in zip(table.lines, rows, strict=True):
        position = (round(row.theta_deg, 6) % 360.0, round(row.psi_deg, 6) % 360.0)
        before = first.setdefault(position, line)
        if before != line:
            problems.note(
                Message(
                    "duplicate-position",
                    "The position θ %(theta)g°, ψ %(psi)g° stands in row %(before)d already. "
                    "Keep one of the two rows.",
                    {"theta": row.theta_deg, "psi": row.psi_deg, "before": before},
                ),
                row=line,
                column="theta_deg",
            )


def _check_uncertainties(
    rows: Sequence[CertificateRow], table: Table, columns: dict[str, Column], problems: Problems
) -> None:
    for name in _OPTIONAL:
        for line, row in zip(table.lines, rows, strict=True):
            value = getattr(row, lab_name(name))
            if value is not None and value < 0:
                problems.note(
                    Message(
                        "negative-uncertainty",
                        "A standard uncertainty cannot be negative (%(value)g). Write it without the sign, "
                        "or leave the cell empty when it is not known.",
                        {"value": value},
                    ),
                    row=line,
                    column=columns[name].name,
                )


def _unit_warnings(rows: Sequence[CertificateRow], filename: str) -> list[Message]:
    largest = max(rows, key=_magnitude)
    size = _magnitude(largest)
    place = {"file": filename, "theta": largest.theta_deg, "psi": largest.psi_deg}
    if size > LARGEST_ARCSEC:
        return [
            Message(
                "angle-unit",
                "%(file)s: the misalignment at θ %(theta)g°, ψ %(psi)g° is %(degrees).3g°. "
                "If it is in another unit, name the column so, for example alpha_deg or alpha_arcsec.",
                {**place, "degrees": size / ARCSEC_PER_DEG},
            )
        ]
    if 0 < size < SMALLEST_ARCSEC:
        return [
            Message(
                "angle-unit",
                "%(file)s: no misalignment is above %(arcsec).2g arcsec. "
                "If they are degrees or radians, name the columns so: alpha_deg or alpha_rad.",
                {"file": filename, "arcsec": size},
            )
        ]
    return []


def _magnitude(row: CertificateRow) -> float:
    return max(abs(row.alpha_arcsec), abs(row.beta_arcsec), abs(row.gamma_arcsec))


def _gap_warnings(rows: Sequence[CertificateRow], columns: dict[str, Column], filename: str) -> list[Message]:
    names = [name for name in _OPTIONAL if name in columns]
    missing = [row for row in rows if any(getattr(row, lab_name(name)) is None for name in names)]
    if not names or (len(names) == len(_OPTIONAL) and not missing):
        return []
    return [
        Message(
            "uncertainty-incomplete",
            "%(file)s: the uncertainties are not given for every angle and position. "
            "Fill in u_alpha_arcsec, u_beta_arcsec and u_gamma_arcsec in every row, or leave all three out.",
            {"file": filename},
        )
    ]


def write_certificate_csv(rows: Sequence[CertificateRow]) -> bytes:
    """Write a certificate as CSV: reading it back gives the same bits.

    Columns of uncertainties are written when any row has them.
    """
    names = [lab_name(name) for name in _REQUIRED]
    names += [
        name for name in map(lab_name, _OPTIONAL) if any(getattr(row, name) is not None for row in rows)
    ]
    return csv_bytes(names, [[getattr(row, name) for name in names] for row in rows])
