"""Program messages taken apart (IEEE 488.2-1992, chapter 7): units, headers, parameters.

A message is one line. Its units are separated by semicolons; a unit is a header, and after white space
its parameters, separated by commas. White space is every code up to 32 but the line feed.
"""

import math
import re
from collections.abc import Iterator
from dataclasses import dataclass
from enum import Enum
from typing import Final

from simdevice.scpi.errors import ScpiError

_WHITE: Final = "".join(map(chr, range(33)))
_HEADER: Final = re.compile(r"(\*[A-Za-z]\w*|:?[A-Za-z]\w*(?::[A-Za-z]\w*)*)(\?)?", re.ASCII)
_NUMBER: Final = re.compile(
    r"([+-]?(?:\d+\.?\d*|\.\d+))(?:[\x00-\x20]*[eE][\x00-\x20]*([+-]?\d+))?[\x00-\x20]*([A-Za-z/][\w./]*)?",
    re.ASCII,
)
_OTHER_BASES: Final = {"H": 16, "Q": 8, "B": 2}
_WORD: Final = re.compile(r"[A-Za-z]\w*", re.ASCII)
_QUOTED: Final = re.compile(r"\"(?:[^\"]|\"\")*\"|'(?:[^']|'')*'")
_LONGEST_WORD: Final = 12
_MOST_DIGITS: Final = 255
_LARGEST_EXPONENT: Final = 32000


class Kind(Enum):
    """What a parameter is; the number is the error where a command does not take one."""

    NUMBER = -128
    WORD = -148
    STRING = -158


@dataclass(frozen=True, slots=True)
class Parameter:
    """One parameter: a number with its suffix (upper case, or empty), a word or a string's contents."""

    kind: Kind
    text: str
    number: float = math.nan
    suffix: str = ""


@dataclass(frozen=True, slots=True)
class Unit:
    """One command or query.

    `words` are the header's mnemonics in upper case, for a common command the one word with its star.
    `from_root` tells a header that begins at the root with a colon.
    """

    words: tuple[str, ...]
    is_query: bool
    from_root: bool
    parameters: tuple[Parameter, ...]

    @property
    def is_common(self) -> bool:
        """Whether it is a command of IEEE 488.2 itself, such as ``*IDN?``."""
        return self.words[0].startswith("*")


def units(message: bytes) -> Iterator[Unit]:
    """Units of a message, one after the other, as far as they are understood.

    Raises
    ------
    ScpiError
        A command error, when the iteration comes to what is not.
    """
    text = message.decode("latin-1")
    if (wrong := re.search(r"[^\x00-\x7e]", text)) is not None:
        raise ScpiError(-101, f"byte {ord(wrong[0])} at {wrong.start() + 1}")
    for part in _split(text, ";"):
        if stripped := part.strip(_WHITE):
            yield _unit(stripped)


def _unit(text: str) -> Unit:
    end = next((place for place, char in enumerate(text) if char in _WHITE), len(text))
    header, rest = text[:end], text[end:].strip(_WHITE)
    found = _HEADER.fullmatch(header)
    if found is None:
        raise ScpiError(-110 if header[:1].isalpha() or header[:1] in "*:" else -102, header[:40])
    words = tuple(found[1].lstrip(":").upper().split(":"))
    if any(len(word.lstrip("*")) > _LONGEST_WORD for word in words):
        raise ScpiError(-112, header[:40])
    parameters = tuple(map(_parameter, _split(rest, ","))) if rest else ()
    return Unit(words, found[2] is not None, header.startswith(":"), parameters)


def _split(text: str, separator: str) -> list[str]:
    """At separators outside strings."""
    if '"' not in text and "'" not in text:
        return text.split(separator)
    parts, begin, place = [], 0, 0
    while place < len(text):
        if text[place] in "\"'":
            quoted = _QUOTED.match(text, place)
            if quoted is None:
                raise ScpiError(-151, "a string is not closed")
            place = quoted.end()
            continue
        if text[place] == separator:
            parts.append(text[begin:place])
            begin = place + 1
        place += 1
    return [*parts, text[begin:]]


def _parameter(text: str) -> Parameter:
    text = text.strip(_WHITE)
    first = text[:1]
    if not text:
        raise ScpiError(-102, "a parameter is empty")
    if first in "\"'":
        if _QUOTED.fullmatch(text) is None:
            raise ScpiError(-151, text[:40])
        return Parameter(Kind.STRING, text[1:-1].replace(first * 2, first))
    if first == "#":
        return _other_base(text)
    if first == "(":
        raise ScpiError(-178, text[:40])
    if first in "+-.0123456789":
        return _number(text)
    if _WORD.fullmatch(text) is None:
        raise ScpiError(-141 if first.isalpha() else -102, text[:40])
    if len(text) > _LONGEST_WORD:
        raise ScpiError(-144, text[:40])
    return Parameter(Kind.WORD, text.upper())


def _number(text: str) -> Parameter:
    found = _NUMBER.fullmatch(text)
    if found is None:
        raise ScpiError(-121, text[:40])
    mantissa, exponent, suffix = found[1], found[2] or "0", found[3] or ""
    if len(mantissa) > _MOST_DIGITS:
        raise ScpiError(-124, f"{len(mantissa)} characters")
    if len(exponent) > len(str(_LARGEST_EXPONENT)) + 1 or abs(int(exponent)) > _LARGEST_EXPONENT:
        raise ScpiError(-123, text[:40])
    number = float(f"{mantissa}e{exponent}")
    if math.isinf(number):
        raise ScpiError(-123, text[:40])
    return Parameter(Kind.NUMBER, text, number, suffix.upper())


def _other_base(text: str) -> Parameter:
    base = _OTHER_BASES.get(text[1:2].upper())
    if base is None:
        raise ScpiError(-168 if text[1:2].isdigit() else -161, text[:40])
    digits = text[2:]
    if len(digits) > _MOST_DIGITS:
        raise ScpiError(-124, f"{len(digits)} characters")
    if not digits.isalnum():
        raise ScpiError(-121, text[:40])
    try:
        return Parameter(Kind.NUMBER, text, float(int(digits, base)))
    except ValueError:
        raise ScpiError(-121, text[:40]) from None
