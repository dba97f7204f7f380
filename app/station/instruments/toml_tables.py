"""A station's file read table by table: every mistake is collected and named by its table and key."""

import tomllib
from collections.abc import Mapping
from dataclasses import MISSING, fields
from difflib import get_close_matches
from math import inf, isfinite
from re import search
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Final, TypeVar

from app.exchange.problems import Problems, refuse
from solver.errors import Message

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

LARGEST_BYTES: Final = 2**20
_Numbers = TypeVar("_Numbers", bound="DataclassInstance")
_BARE: Final = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-"


def load_toml(data: bytes, filename: str) -> dict[str, Any]:
    """Read a TOML file.

    Raises
    ------
    Invalid
        Too big, not UTF-8, or no TOML, with the line.
    """
    if len(data) > LARGEST_BYTES:
        raise refuse(
            "too-big",
            "The file holds more than 1 MiB. A description of a station is shorter; choose another file.",
            file=filename,
        )
    try:
        return tomllib.loads(data.decode("utf-8-sig"))
    except UnicodeDecodeError:
        raise refuse("not-utf8", "The file is not UTF-8. Save it as UTF-8.", file=filename) from None
    except tomllib.TOMLDecodeError as error:
        line = search(r"at line (\d+)", str(error))
        raise refuse(
            "not-toml",
            "This is not TOML: %(why)s. Correct it there; patterns stand in 'single quotation marks'.",
            file=filename,
            row=int(line[1]) if line else None,
            why=str(error),
        ) from None


class Table:
    """One table of the file; takes typed values out of it and notes what is wrong with them.

    Parameters
    ----------
    content
        What stands in the table.
    problems
        Collects what is wrong, each under the dotted name of its key.
    name
        Dotted name of the table, empty for the file itself.
    """

    def __init__(self, content: Mapping[str, Any], problems: Problems, name: str = "") -> None:
        self._content = content
        self._problems = problems
        self._name = name
        self._taken: set[str] = set()

    @property
    def names(self) -> list[str]:
        """Keys of the table, in their order."""
        return list(self._content)

    def has(self, key: str) -> bool:
        """Whether the key is there."""
        return key in self._content

    def value(self, key: str) -> Any:
        """The value as TOML has it, or None; the caller notes what is wrong with it."""
        self._taken.add(key)
        return self._content.get(key)

    def text(self, key: str, default: str | None = None) -> str:
        """A text; what is missing and has no default is a mistake."""
        value = self.value(key)
        if isinstance(value, str):
            return value
        if value is None and default is not None:
            return default
        if value is None:
            self.missing(key)
        else:
            self.wrong(key, Message("not-a-text", "This must be a text, in quotation marks."))
        return ""

    def number(
        self, key: str, default: float | None = None, smallest: float = 0.0, largest: float = inf
    ) -> float:
        """A finite number within the bounds, likewise."""
        value = self.value(key)
        if value is None and default is not None:
            return default
        if value is None:
            self.missing(key)
        elif not _is_number(value) or not smallest <= value <= largest:
            self.wrong(key, _bounds(smallest, largest))
        else:
            return float(value)
        return smallest if isfinite(smallest) else 0.0

    def interval(self, key: str) -> tuple[float, float]:
        """Two numbers in brackets, the smaller first."""
        value = self.value(key)
        if value is None:
            self.missing(key)
        elif (
            isinstance(value, list)
            and len(value) == 2
            and all(map(_is_number, value))
            and value[0] < value[1]
        ):
            return float(value[0]), float(value[1])
        else:
            self.wrong(
                key,
                Message(
                    "not-an-interval",
                    "These must be two numbers in brackets, the smaller one first: [-10, 370].",
                ),
            )
        return 0.0, 0.0

    def table(self, key: str, *, required: bool = False) -> "Table":
        """A table in this one; an empty one when it is not there."""
        value = self.value(key)
        if isinstance(value, dict) or (value is None and not required):
            return Table(value or {}, self._problems, self.place(key))
        if value is None:
            self.missing(key)
        else:
            self.wrong(
                key, Message("not-a-table", "This must be a table. Begin it with its name in brackets.")
            )
        # One mistake is enough: what a table that is not there lacks is not told.
        return Table({}, Problems(None))

    def tables(self) -> dict[str, "Table"]:
        """Every key of this table, each a table."""
        return {key: self.table(key) for key in self._content}

    def part(self, content: Mapping[str, Any], place: str) -> "Table":
        """A table that stands in this one in another way than under a key: one of several in brackets."""
        return Table(content, self._problems, f"{self._name}.{place}" if self._name else place)

    def texts(self, key: str) -> tuple[str, ...]:
        """Texts in brackets, one at least."""
        value = self.value(key)
        if isinstance(value, list) and value and all(isinstance(item, str) for item in value):
            return tuple(value)
        self.wrong(key, Message("not-texts", 'These must be texts in brackets: ["jx", "jy"].'))
        return ()

    def flags(self) -> dict[str, bool]:
        """All keys of the table, each true or false."""
        found = {}
        for key in self._content:
            value = self.value(key)
            if isinstance(value, bool):
                found[key] = value
            else:
                self.wrong(key, Message("not-a-flag", "This must be true or false, without quotation marks."))
        return found

    def numbers_into(
        self, kind: type[_Numbers], ranges: Mapping[str, tuple[float, float]] = MappingProxyType({})
    ) -> _Numbers:
        """A dataclass of numbers made of the keys of its fields; a field's default holds where a key lacks.

        Parameters
        ----------
        kind
            The dataclass.
        ranges
            Smallest and largest value of a field; a number not below 0 where none is given.
        """
        values = {}
        for item in fields(kind):
            default = None if item.default is MISSING else item.default
            values[item.name] = self.number(item.name, default, *ranges.get(item.name, ()))
        self.finish()
        return kind(**values)

    def finish(self) -> None:
        """Note every key that nobody asked for."""
        for key in self._content:
            if key not in self._taken:
                self.unknown(key, sorted(self._taken))

    def unknown(self, key: str, known: list[str]) -> None:
        """Note that a key is none of those that are known here."""
        near = get_close_matches(key, known, 1)
        if near:
            self.wrong(
                key,
                Message("unknown-key", "This is not known here. Was “%(near)s” meant?", {"near": near[0]}),
            )
        else:
            self.wrong(
                key,
                Message(
                    "unknown-key",
                    "This is not known here. Choose from %(known)s.",
                    {"known": ", ".join(known)},
                ),
            )

    def missing(self, key: str) -> None:
        """Note that a key is not there."""
        self.wrong(key, Message("missing-key", "This key is missing. Add it; simulated.toml shows how."))

    def wrong(self, key: str, message: Message) -> None:
        """Note a problem of one key."""
        self._problems.note(message, column=self.place(key))

    def place(self, key: str) -> str:
        """Dotted name of a key, quoted as TOML wants it."""
        step = key if key and set(key) <= set(_BARE) else f'"{key}"'
        return f"{self._name}.{step}" if self._name else step


def _bounds(smallest: float, largest: float) -> Message:
    if isfinite(largest):
        return Message(
            "not-a-number",
            "This must be a number from %(smallest)g to %(largest)g, without quotation marks.",
            {"smallest": smallest, "largest": largest},
        )
    return Message(
        "not-a-number",
        "This must be a number not below %(smallest)g, without quotation marks.",
        {"smallest": smallest},
    )


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and isfinite(value)
