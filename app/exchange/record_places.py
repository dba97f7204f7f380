"""Which position a record belongs to: said by the caller, by columns, by metadata or by the name."""

import re
from decimal import Decimal
from pathlib import PurePosixPath
from typing import Final, NamedTuple

import numpy as np

from app.exchange import samples
from app.exchange.fields import full_turn
from app.exchange.headers import Column
from app.exchange.numbers import read_decimal
from app.exchange.positions import Positions, repeats, same_angle
from app.exchange.problems import Problems
from app.exchange.table import Table
from solver.errors import Message

_NAME: Final = re.compile(
    r"theta(-?[0-9]{1,6}(?:\.[0-9]{1,12})?)_psi(-?[0-9]{1,6}(?:\.[0-9]{1,12})?)(?:_repeat([0-9]{1,6}))?(?![0-9])",
    re.IGNORECASE,
)


class Place(NamedTuple):
    """A measurement of one position, degrees in [0, 360); `repeat` is None where it is not said."""

    theta_deg: float
    psi_deg: float
    repeat: int | None = None


def position_of(filename: str) -> Place | None:
    """Read the position from a name like ``theta090_psi270_repeat1.csv``; None when it has none."""
    match = _NAME.search(PurePosixPath(filename.replace("\\", "/")).name)
    if match is None:
        return None
    theta, psi, repeat = match.groups()
    return Place(full_turn(Decimal(theta)), full_turn(Decimal(psi)), None if repeat is None else int(repeat))


def record_name(theta_deg: float, psi_deg: float, repeat: int, suffix: str) -> str:
    """Name of a position's file: ``theta090_psi270_repeat1.csv``, the repeat only when it is not 0."""
    counted = f"_repeat{repeat}" if repeat else ""
    return f"theta{_degrees(theta_deg)}_psi{_degrees(psi_deg)}{counted}.{suffix}"


def _degrees(angle_deg: float) -> str:
    whole, _, decimals = f"{Decimal(repr(float(angle_deg))):f}".partition(".")
    return f"{int(whole):03d}" + (f".{decimals}" if decimals.strip("0") else "")


def given(theta_deg: float | None, psi_deg: float | None, repeat: int | None) -> Place | None:
    """The position that the caller gave, if both of its angles are known."""
    if theta_deg is None or psi_deg is None:
        return None
    theta, psi = (full_turn(Decimal(repr(float(angle)))) for angle in (theta_deg, psi_deg))
    return Place(theta, psi, repeat)


def places(
    table: Table, columns: dict[str, Column], known: Place | None, problems: Problems
) -> tuple[list[tuple[slice, Place]], list[Message]]:
    """Cut a record into measurements: the rows of each and its position.

    Parameters
    ----------
    columns
        As resolved; with ``theta`` and ``psi`` every unbroken run of one position is a measurement.
    known
        The position the caller gave; the file must not contradict it by its columns.
    problems
        Takes what is wrong; then the answer is of no use.

    Returns
    -------
    measurements
        In the file's order.
    warnings
        ``position-differs``, when a file's name says another position.
    """
    named = position_of(table.file)
    if "theta" in columns and "psi" in columns:
        runs = _runs(table, columns, problems)
        if known is not None:
            runs = _agreeing(runs, known, table, columns, problems)
        alone = runs[0][1] if len(runs) == 1 else None
        return runs, _differing(alone, named, table.file)
    if "theta" in columns or "psi" in columns:
        message = Message(
            "missing-column",
            "A position needs both theta_deg and psi_deg. Add the other column, or leave both out and name "
            "the file like theta090_psi270.csv.",
        )
        problems.note(message, row=table.header_line)
        return [], []
    place = known or _from_metadata(table) or named
    if place is None:
        message = Message(
            "position-unknown",
            "Nothing says which position this record belongs to. Name the file like theta090_psi270.csv, "
            "add the columns theta_deg and psi_deg, or list the file in session.json.",
        )
        problems.note(message)
        return [], []
    return [(slice(0, len(table)), place)], _differing(place, named, table.file)


def _runs(table: Table, columns: dict[str, Column], problems: Problems) -> list[tuple[slice, Place]]:
    """Unbroken runs of one position, and of one repeat where there is such a column."""
    theta, psi = (samples.angles(table, columns[name], problems) for name in ("theta", "psi"))
    counted = samples.counts(table, columns["repeat"], problems) if "repeat" in columns else None
    if problems:
        return []
    changes = (np.diff(theta) != 0) | (np.diff(psi) != 0)
    if counted is not None:
        changes |= np.diff(counted) != 0
    starts = [0, *(int(place) for place in np.flatnonzero(changes) + 1)]
    ends = [*starts[1:], len(table)]
    positions = [(float(theta[start]), float(psi[start])) for start in starts]
    numbers = repeats(positions) if counted is None else [int(counted[start]) for start in starts]
    runs = [
        (slice(start, end), Place(*position, number))
        for start, end, position, number in zip(starts, ends, positions, numbers, strict=True)
    ]
    if counted is not None:
        _check_repeats(runs, table, columns["repeat"].name, problems)
    return runs


def _check_repeats(runs: list[tuple[slice, Place]], table: Table, column: str, problems: Problems) -> None:
    known = Positions()
    first: dict[tuple[int, int | None], int] = {}
    for rows, place in runs:
        line = table.lines[rows.start]
        before = first.setdefault((known.put(place.theta_deg, place.psi_deg), place.repeat), line)
        if before != line:
            problems.note(
                Message(
                    "duplicate-position",
                    "The position θ %(theta)g°, ψ %(psi)g° with repeat %(repeat)s began in row %(before)d "
                    "already. Give this run another repeat, or leave the column repeat out.",
                    {
                        "theta": place.theta_deg,
                        "psi": place.psi_deg,
                        "repeat": place.repeat,
                        "before": before,
                    },
                ),
                row=line,
                column=column,
            )


def _agreeing(
    runs: list[tuple[slice, Place]],
    known: Place,
    table: Table,
    columns: dict[str, Column],
    problems: Problems,
) -> list[tuple[slice, Place]]:
    """The one run of a file brought for a position, under that position; others are problems."""
    for rows, place in runs:
        if not _same(place, known):
            problems.note(
                Message(
                    "position-differs",
                    "This row belongs to θ %(theta)g°, ψ %(psi)g°, but the record was brought for "
                    "θ %(wanted_theta)g°, ψ %(wanted_psi)g°. Bring it for its own position, "
                    "or a long file as a whole session.",
                    {"theta": place.theta_deg, "psi": place.psi_deg,
                     "wanted_theta": known.theta_deg, "wanted_psi": known.psi_deg},
                ),
                row=table.lines[rows.start],
                column=columns["theta"].name,
            )  # fmt: skip
    if known.repeat is None or len(runs) != 1:
        return runs
    return [(rows, known) for rows, _ in runs]


def _same(a: Place, b: Place) -> bool:
    return same_angle(a.theta_deg, b.theta_deg) and same_angle(a.psi_deg, b.psi_deg)


def _from_metadata(table: Table) -> Place | None:
    """The position that our own Parquet files carry beside their columns."""
    numbers = [read_decimal(table.metadata.get(name, "")) for name in ("theta_deg", "psi_deg")]
    if any(isinstance(number, Message) for number in numbers):
        return None
    theta, psi = (full_turn(number) for number in numbers if isinstance(number, Decimal))
    repeat = table.metadata.get("repeat", "")
    counts = repeat.isascii() and repeat.isdigit() and len(repeat) < 7
    return Place(theta, psi, int(repeat) if counts else None)


def _differing(place: Place | None, named: Place | None, filename: str) -> list[Message]:
    if place is None or named is None or _same(place, named):
        return []
    return [
        Message(
            "position-differs",
            "%(file)s: the name says θ %(named_theta)g°, ψ %(named_psi)g°, but it is taken for θ %(theta)g°, "
            "ψ %(psi)g°. Rename the file, or correct the position.",
            {"file": filename, "theta": place.theta_deg, "psi": place.psi_deg,
             "named_theta": named.theta_deg, "named_psi": named.psi_deg},
        )
    ]  # fmt: skip
