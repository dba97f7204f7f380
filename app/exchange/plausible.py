"""Currents a thousand times too large or too small: a unit other than the header says.

The whole Earth rate is about 7 µA for a scale factor of 10 rad/(s·A). A file whose currents are
all far from that is only warned of, for other gyros have other scale factors; nothing is ever
rescaled silently. One row that is a thousand times off the others of its file is refused.
"""

from collections.abc import Sequence
from math import floor, log10
from statistics import median
from typing import Final

from app.exchange.headers import Column
from app.exchange.problems import Problems
from app.exchange.rows import MeansRow
from solver.constants import EARTH_RATE
from solver.errors import Message
from solver.units import ma_from_ampere

_USUAL_SCALE: Final = 10.0  # rad/(s·A)
CODE: Final = "current-unit"
"""Of every word about currents in another unit."""
USUAL_MA: Final = ma_from_ampere(EARTH_RATE / _USUAL_SCALE)
"""Current for the whole Earth rate, mA."""

_HALF_WAY: Final = 1000.0**0.5
_SLIP: Final = 1000.0
_RANGES: Final = (1.0, 1.2, 1.5, 2.0, 2.5, 3.0, 5.0)
_FEWEST: Final = 4  # rows from which "the others" can be told


def current_unit(rows: Sequence[MeansRow], columns: dict[str, Column], problems: Problems) -> list[Message]:
    """Note rows that slipped by a factor of 1000; warn when the whole file looks like another unit."""
    sizes = _sizes(rows)
    if len(rows) >= _FEWEST and median(sizes):
        _check_too_large(rows, sizes, columns, problems)
        _check_too_small(rows, sizes, columns, problems)
    usual = _unusual(sizes)
    return [] if usual is None else [_other_unit(usual, columns["jx"].name, problems.file or "")]


def another_unit(rows: Sequence[MeansRow]) -> list[Message]:
    """Warn when all currents of a session look like another unit, whichever way they came."""
    usual = _unusual(_sizes(rows))
    if usual is None:
        return []
    values = {"value": usual, "usual": USUAL_MA}
    if usual > USUAL_MA:
        return [
            Message(
                CODE, "Currents of about %(value).3g mA are large for a gyro in the Earth rate (usual are %(usual).1g "
                "mA). If they are really in µA, bring them in again in their unit; until then nothing is expected of "
                "the gyro by this result.", values,
            )
        ]  # fmt: skip
    return [
        Message(
            CODE, "Currents of about %(value).3g mA are small for a gyro in the Earth rate (usual are %(usual).1g mA). "
            "If they are really in A, bring them in again in their unit; until then nothing is expected of the gyro "
            "by this result.", values,
        )
    ]  # fmt: skip


def _sizes(rows: Sequence[MeansRow]) -> list[float]:
    return [max(abs(row.jx_ma), abs(row.jy_ma)) for row in rows]


def _unusual(sizes: Sequence[float]) -> float | None:
    """The usual size of these currents, mA, when it is far from that of other gyros."""
    usual = median(sizes)
    return usual if usual and not USUAL_MA / _HALF_WAY <= usual <= USUAL_MA * _HALF_WAY else None


def _check_too_large(
    rows: Sequence[MeansRow], sizes: Sequence[float], columns: dict[str, Column], problems: Problems
) -> None:
    """A current above a hundred times the median that fits the others once divided by 1000.

    An ammeter's range is a round number: a current that lies on one is saturated, which the
    diagnosis of the fit tells, and is let through.
    """
    usual = median(sizes)
    others = [size for size in sizes if size <= 100.0 * usual]
    for row in rows:
        for name, value in (("jx", row.jx_ma), ("jy", row.jy_ma)):
            large = abs(value) > 100.0 * usual and abs(value) / _SLIP <= 3.0 * max(others)
            if large and not _is_a_range(abs(value)):
                problems.note(_slipped("large", value), row=row.line, column=columns[name].name)


def _is_a_range(value: float) -> bool:
    leading = value / 10.0 ** floor(log10(value) + 1e-9)
    return any(abs(leading - mark) < 1e-6 for mark in _RANGES)


def _check_too_small(
    rows: Sequence[MeansRow], sizes: Sequence[float], columns: dict[str, Column], problems: Problems
) -> None:
    """One row alone with both currents far below all others, which fits them once multiplied by 1000.

    Alone, because honest currents may vanish together at every ψ of one θ (the spin axis along
    the Earth's, at a pole).
    """
    smallest, next_one = sorted(sizes)[:2]
    fits = next_one / 3.0 <= smallest * _SLIP <= 3.0 * max(sizes)
    if fits and smallest < next_one / 30.0:
        row = rows[list(sizes).index(smallest)]
        problems.note(_slipped("small", smallest), row=row.line, column=columns["jx"].name)


def _slipped(which: str, value: float) -> Message:
    if which == "large":
        return Message(
            CODE,
            "%(value)g mA is about 1000 times the other currents of this file. Write it in the unit of the "
            "column's name.",
            {"value": value},
        )
    return Message(
        CODE,
        "The currents of this row, at most %(value)g mA, are about 1000 times smaller than those of all "
        "other rows. Write them in the unit of the column's name.",
        {"value": value},
    )


def _other_unit(usual: float, name: str, file: str) -> Message:
    values = {"file": file, "value": usual, "name": name, "usual": USUAL_MA}
    if usual > USUAL_MA:
        return Message(
            CODE,
            "%(file)s: currents of about %(value).3g mA are large for a gyro in the Earth rate (usual are "
            "%(usual).1g mA). If %(name)s is really in µA, name the columns jx_ua and jy_ua.",
            values,
        )
    return Message(
        CODE,
        "%(file)s: currents of about %(value).3g mA are small for a gyro in the Earth rate (usual are "
        "%(usual).1g mA). If %(name)s is really in A, name the columns jx_a and jy_a.",
        values,
    )
