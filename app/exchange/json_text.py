"""JSON as people write it by hand: what is wrong is named by line, nothing odd gets through."""

import json
import math
from collections.abc import Mapping
from typing import Any, Final

from app.exchange.problems import Problems, refuse
from solver.errors import Message

LARGEST_BYTES: Final = 4 * 2**20


def load_object(data: bytes, filename: str) -> dict[str, Any]:
    """Read one JSON object, UTF-8 with or without BOM.

    Raises
    ------
    Invalid
        Too big, no JSON (with the line), nested too deeply, a key twice, NaN, or no object.
    """
    if len(data) > LARGEST_BYTES:
        raise refuse(
            "too-big",
            "The file holds more than %(limit)d MiB. A description of a session is shorter; "
            "choose another file.",
            file=filename,
            limit=LARGEST_BYTES // 2**20,
        )
    try:
        content = json.loads(data.decode("utf-8-sig"), object_pairs_hook=_object, parse_constant=_no_constant)
    except UnicodeDecodeError:
        raise refuse("not-utf8", "The file is not UTF-8. Save it as UTF-8.", file=filename) from None
    except json.JSONDecodeError as error:
        raise refuse(
            "not-json",
            "This is not JSON from here on, character %(place)d of the line: %(why)s. Correct it there.",
            file=filename,
            row=error.lineno,
            place=error.colno,
            why=error.msg,
        ) from None
    except RecursionError:
        raise refuse(
            "not-json", "The JSON is nested too deeply. Write it as the documentation shows.", file=filename
        ) from None
    except ValueError as error:
        raise refuse(
            "not-json", "The JSON cannot be used: %(why)s. Correct it.", file=filename, why=str(error)[:200]
        ) from None
    if not isinstance(content, dict):
        raise refuse(
            "not-json", "The file must hold one JSON object, in braces { }. Correct it.", file=filename
        )
    return content


def _object(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    content = dict(pairs)
    if len(content) != len(pairs):
        names = [name for name, _ in pairs]
        twice = next(name for name in names if names.count(name) > 1)
        raise ValueError(f"the key “{twice[:40]}” stands there twice")
    return content


def _no_constant(name: str) -> float:
    raise ValueError(f"{name} is not a value")


class Reader:
    """Takes typed values out of a JSON object, noting what is wrong under its JSON pointer."""

    def __init__(self, content: Mapping[str, Any], problems: Problems, pointer: str = "") -> None:
        self._content = content
        self._problems = problems
        self._pointer = pointer

    def text(self, key: str) -> str | None:
        """A text that is not empty, or None."""
        value = self._content.get(key)
        if value is None:
            return None
        if isinstance(value, str) and value.strip():
            return value
        self.wrong(
            key, Message("not-a-text", "This must be a text that is not empty. Put it in quotation marks.")
        )
        return None

    def number(self, key: str, smallest: float = -math.inf, largest: float = math.inf) -> float | None:
        """A finite number within the bounds, or None."""
        value = self._content.get(key)
        if value is None:
            return None
        if isinstance(value, int | float) and not isinstance(value, bool):
            try:
                number = float(value)
            except OverflowError:
                number = math.inf
            if math.isfinite(number) and smallest <= number <= largest:
                return number
        message = Message("not-a-number", "This must be a number, without quotation marks.")
        if math.isfinite(smallest) and math.isfinite(largest):
            message = Message(
                "not-a-number",
                "This must be a number from %(smallest)g to %(largest)g, without quotation marks.",
                {"smallest": smallest, "largest": largest},
            )
        self.wrong(key, message)
        return None

    def count(self, key: str) -> int | None:
        """A whole number from 0, or None."""
        value = self._content.get(key)
        if value is None:
            return None
        if isinstance(value, int) and not isinstance(value, bool) and 0 <= value < 10**6:
            return value
        self.wrong(key, Message("not-a-count", "This must be a whole number from 0. It counts the repeats."))
        return None

    def wrong(self, key: str, message: Message) -> None:
        """Note a problem of one key, escaped as RFC 6901 has it."""
        step = key.replace("~", "~0").replace("/", "~1")
        self._problems.note(message, column=f"{self._pointer}/{step}")
