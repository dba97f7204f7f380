"""Column names: quantity and unit, as in ``jx_ma``, ``u_alpha_arcsec``, ``t_s``."""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final

from app.exchange.numbers import SIZES
from app.exchange.problems import Problems
from solver.errors import Message


@dataclass(frozen=True, slots=True)
class Quantity:
    """What a column holds: its kind of unit, and the laboratory's unit for it."""

    kind: str
    lab_unit: str


@dataclass(frozen=True, slots=True)
class Column:
    """A column found: its name in the file, and its unit and the laboratory's (None: no number)."""

    name: str
    unit: str | None
    lab_unit: str | None


_ANGLE = Quantity("angle", "deg")
_SMALL_ANGLE = Quantity("angle", "arcsec")
_CURRENT = Quantity("current", "ma")
_TIME = Quantity("time", "s")

QUANTITIES: Final[Mapping[str, Quantity | None]] = {
    "theta": _ANGLE,
    "psi": _ANGLE,
    "alpha": _SMALL_ANGLE,
    "beta": _SMALL_ANGLE,
    "gamma": _SMALL_ANGLE,
    "u_alpha": _SMALL_ANGLE,
    "u_beta": _SMALL_ANGLE,
    "u_gamma": _SMALL_ANGLE,
    "jx": _CURRENT,
    "jy": _CURRENT,
    "u_jx": _CURRENT,
    "u_jy": _CURRENT,
    "t": _TIME,
    "duration": _TIME,
    "rate": Quantity("frequency", "hz"),
    "temperature": Quantity("temperature", "c"),
    "started_at": None,
    "repeat": None,
}
"""Every quantity that a column may hold; None: without unit."""


def lab_name(quantity: str) -> str:
    """Column name in the laboratory's unit: ``jx`` → ``jx_ma``."""
    kind = QUANTITIES[quantity]
    return f"{quantity}_{kind.lab_unit}" if kind else quantity


def header_names(names: Sequence[str], problems: Problems, row: int | None) -> list[str]:
    """Column names in lower case, without spaces around; one that occurs twice is a problem."""
    lower = [name.strip(" \t\u00a0\ufeff").lower() for name in names]
    for name, count in Counter(lower).items():
        if name and count > 1:
            problems.note(
                Message(
                    "duplicate-column",
                    "The column %(column)s stands in the header %(count)d times. Keep one of them.",
                    {"column": name[:40], "count": count},
                ),
                row=row,
                column=name[:40],
            )
    return lower


def quantity_of(name: str) -> tuple[str, str | None] | None:
    """Split a column's name into quantity and unit; None for a name of no known quantity.

    The unit is what follows, also when it is none of that quantity's (``jx_mv`` → ``mv``), and an
    empty text when it is missing (``jx`` → ``""``).
    """
    if name in QUANTITIES:
        return name, "" if QUANTITIES[name] else None
    quantity, underscore, unit = name.rpartition("_")
    if underscore and QUANTITIES.get(quantity):
        return quantity, unit
    return None


def resolve(
    names: Sequence[str],
    required: Sequence[str],
    optional: Sequence[str],
    problems: Problems,
    row: int | None,
) -> tuple[dict[str, Column], list[Message]]:
    """Find the wanted quantities among the columns.

    Parameters
    ----------
    names
        Column names, lower case.
    required, optional
        Names of quantities.
    problems
        Takes what is wrong: a column missing, named twice in two units, or without a unit.
    row
        Line of the header.

    Returns
    -------
    columns
        By quantity; those in `problems` are left out.
    warnings
        One that names the columns not used.
    """
    found: dict[str, list[tuple[str, str | None]]] = {}
    unused: list[str] = []
    for name in names:
        split = quantity_of(name)
        if split and split[0] in (*required, *optional):
            found.setdefault(split[0], []).append((name, split[1]))
        elif name:
            unused.append(name)
    if not any(quantity in found for quantity in required):
        problems.note(_wrong_header(names, required), row=row)
        return {}, []
    columns: dict[str, Column] = {}
    for quantity in (*required, *optional):
        column = _column(quantity, found.get(quantity, []), problems, row)
        if column:
            columns[quantity] = column
        elif quantity in required and quantity not in found:
            problems.note(
                Message(
                    "missing-column",
                    "There is no column %(wanted)s. Add it to the header; found are: %(found)s.",
                    {"wanted": lab_name(quantity), "found": _listed(names)},
                ),
                row=row,
                column=lab_name(quantity),
            )
    return columns, [_unused(problems.file, unused)] if unused else []


def _column(
    quantity: str, named: list[tuple[str, str | None]], problems: Problems, row: int | None
) -> Column | None:
    """Take the one column of a quantity, or note what is wrong with its name."""
    if not named:
        return None
    if len(named) > 1:
        problems.note(
            Message(
                "two-units",
                "The columns %(columns)s hold one quantity. Keep one of them.",
                {"columns": _listed([name for name, _ in named])},
            ),
            row=row,
            column=named[1][0],
        )
        return None
    name, unit = named[0]
    kind = QUANTITIES[quantity]
    if kind is None:
        return Column(name, None, None)
    if unit in SIZES[kind.kind]:
        return Column(name, unit, kind.lab_unit)
    values = {"column": name, "choices": _listed([f"{quantity}_{unit}" for unit in _ascii_units(kind)])}
    if unit:
        problems.note(
            Message(
                "unknown-unit",
                "The column %(column)s has an unknown unit. Call it one of: %(choices)s.",
                values,
            ),
            row=row,
            column=name,
        )
    else:
        problems.note(
            Message(
                "no-unit", "The column %(column)s does not say its unit. Call it one of: %(choices)s.", values
            ),
            row=row,
            column=name,
        )
    return None


def _ascii_units(kind: Quantity) -> list[str]:
    return [unit for unit in SIZES[kind.kind] if unit.isascii()]


def _wrong_header(names: Sequence[str], required: Sequence[str]) -> Message:
    wanted = ",".join(lab_name(quantity) for quantity in required)
    return Message(
        "wrong-header",
        "The header names none of the columns needed. Write it like “%(wanted)s”; found are: %(found)s.",
        {"wanted": wanted, "found": _listed(names)},
    )


def _unused(file: str | None, names: list[str]) -> Message:
    return Message(
        "columns-ignored",
        "%(file)s: these columns are not used: %(columns)s.",
        {"file": file or "", "columns": _listed(names)},
    )


def _listed(names: Sequence[str]) -> str:
    shown = ", ".join(name[:40] for name in names[:12])
    return shown + (", …" if len(names) > 12 else "")
