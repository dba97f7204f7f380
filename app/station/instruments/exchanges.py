"""What is said to an instrument and what it answers, as a station's file describes it; nothing is sent here.

A command is one exchange or several. An exchange sends a text with placeholders (``{theta_deg:.4f}``)
and, where the instrument answers, takes named values out of the answer: from a line of text by a regular
expression with named groups, or from a definite-length block of numbers (IEEE 488.2, 8.7.9) or a line of
numbers in columns. A value's name says what it is, so only its unit is to be described.
"""

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from decimal import Decimal
from typing import Final

import numpy as np
from numpy.typing import NDArray

from app.exchange.numbers import power_of_ten, read_decimal, shifted
from app.station.contracts import Array

KIND_OF: Final[Mapping[str, str]] = {
    "theta": "angle", "psi": "angle", "jx": "current", "jy": "current", "t": "time",
    "index": "count", "samples": "count", "label": "count",
    "running": "flag", "overload": "flag", "moving": "flag", "homed": "flag", "emergency_stop": "flag",
    "identity": "text", "code": "text", "text": "text",
}  # fmt: skip
"""What the values of an answer are called, and what kind each is."""

LAB_UNIT: Final[Mapping[str, str]] = {"angle": "deg", "current": "ma", "time": "s"}
"""Unit of each kind in the program."""

YES: Final = "1|ON|YES|TRUE"

Value = float | int | bool | str | None


class NotUnderstood(ValueError):
    """An answer that is not what the description says."""


@dataclass(frozen=True, slots=True)
class Words:
    """An answer in one line of text.

    Attributes
    ----------
    pattern
        Matches the whole line; its named groups are the values.
    units
        Unit of each value that has one.
    yes
        Matches the whole text of a flag that is up, in any case.
    """

    pattern: re.Pattern[str]
    units: Mapping[str, str] = field(default_factory=dict)
    yes: re.Pattern[str] = field(default_factory=lambda: re.compile(YES, re.IGNORECASE))

    @property
    def names(self) -> tuple[str, ...]:
        """Values that it gives."""
        return tuple(self.pattern.groupindex)

    def values(self, line: str) -> dict[str, Value]:
        """Values by name, in the program's units; None for a group that took no part in the match.

        Raises
        ------
        NotUnderstood
            When the line does not match, or a number is none.
        """
        match = self.pattern.fullmatch(line.strip())
        if match is None:
            raise NotUnderstood(line)
        return {name: self._value(name, text) for name, text in match.groupdict().items()}

    def _value(self, name: str, text: str | None) -> Value:
        kind = KIND_OF[name]
        if text is None or kind == "text":
            return text
        if kind == "flag":
            return self.yes.fullmatch(text.strip()) is not None
        number = _decimal(text)
        if kind == "count":
            if number != number.to_integral_value():
                raise NotUnderstood(text)
            return int(number)
        return shifted(number, self.units[name], LAB_UNIT[kind])


@dataclass(frozen=True, slots=True)
class Columns:
    """An answer of many numbers, row by row.

    Attributes
    ----------
    names
        Of the columns, in their order.
    units
        Unit of each column that has one.
    element
        numpy's name of a binary number (``<f8``) in a definite-length block, or None for text.
    separator
        Between the numbers of a text.
    """

    names: tuple[str, ...]
    units: Mapping[str, str]
    element: str | None = None
    separator: str = ","

    def of_block(self, data: bytes) -> dict[str, Array]:
        """Columns of a block's content, (n,) each, in the program's units.

        Raises
        ------
        NotUnderstood
            When it does not consist of whole rows, or holds what is no number.
        """
        element = np.dtype(self.element)
        if len(data) % (element.itemsize * len(self.names)):
            raise NotUnderstood(f"{len(data)} bytes")
        rows = np.frombuffer(data, element).astype(np.float64).reshape(-1, len(self.names))
        if not np.isfinite(rows).all():
            raise NotUnderstood("NaN")
        return {
            name: _scaled(rows[:, place], self.units.get(name), KIND_OF[name])
            for place, name in enumerate(self.names)
        }

    def of_text(self, line: str) -> dict[str, Array]:
        """Columns of a line of numbers, likewise; each number is shifted exactly and rounded once."""
        texts = [text for text in line.strip().split(self.separator) if text.strip()]
        if len(texts) % len(self.names):
            raise NotUnderstood(line)
        return {
            name: np.array([self._number(name, text) for text in texts[place :: len(self.names)]], np.float64)
            for place, name in enumerate(self.names)
        }

    def _number(self, name: str, text: str) -> float:
        kind = KIND_OF[name]
        number = _decimal(text)
        return shifted(number, self.units[name], LAB_UNIT[kind]) if kind in LAB_UNIT else float(number)


@dataclass(frozen=True, slots=True)
class Exchange:
    """One text sent, and what comes back; nothing does when `answer` is None."""

    send: str
    answer: Words | Columns | None = None

    def text(self, values: Mapping[str, float]) -> str:
        """What is sent, with the values in their places."""
        return self.send.format_map(values)


@dataclass(frozen=True, slots=True)
class Command:
    """Exchanges in their order, and what holds without asking.

    Attributes
    ----------
    exchanges
        At least one.
    assumed
        Flags that the instrument cannot tell.
    """

    exchanges: tuple[Exchange, ...]
    assumed: Mapping[str, bool] = field(default_factory=dict)

    @property
    def names(self) -> frozenset[str]:
        """Every value that it gives."""
        told = {name for exchange in self.exchanges if exchange.answer for name in exchange.answer.names}
        return frozenset(told | set(self.assumed))


def _decimal(text: str) -> Decimal:
    number = read_decimal(text, comma=False)
    if not isinstance(number, Decimal):
        raise NotUnderstood(text)
    return number


def _scaled(column: NDArray[np.float64], unit: str | None, kind: str) -> Array:
    """A column in the program's unit: multiplied or divided once by what float64 holds exactly."""
    if unit is None:
        return column.copy()
    lab_unit = LAB_UNIT[kind]
    power = power_of_ten(unit, lab_unit)
    if power is None:
        return column * shifted(Decimal(1), unit, lab_unit)
    return column * 10.0**power if power >= 0 else column / 10.0**-power
