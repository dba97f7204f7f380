"""Commands of a device, and how a header finds its own (SCPI 1999.0, volume 1, chapter 6).

A pattern is written as in a manual, ``SYSTem:ERRor[:NEXT]?``: capitals are the short form, the whole
word the long one, brackets may be left out, and any case will do. Nothing between the two forms is taken.
"""

import re
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any, Final

from simdevice.scpi.errors import ScpiError
from simdevice.scpi.syntax import Kind, Parameter, Unit

_SWITCH: Final = {"ON": True, "OFF": False}


@dataclass(frozen=True, slots=True)
class Real:
    """A number between limits, in the one unit that may be written after it."""

    low: float
    high: float
    unit: str = ""

    def value(self, parameter: Parameter) -> float:
        """The parameter's number; raises `ScpiError` for what is none or lies outside."""
        if parameter.kind is not Kind.NUMBER:
            raise ScpiError(parameter.kind.value, parameter.text[:40])
        if parameter.suffix and not self.unit:
            raise ScpiError(-138, parameter.text[:40])
        if parameter.suffix not in ("", self.unit):
            raise ScpiError(-131, f"{parameter.suffix[:12]}: the unit is {self.unit}")
        if not self.low <= parameter.number <= self.high:
            raise ScpiError(-222, f"{parameter.number:g} is not from {self.low:g} to {self.high:g}")
        return parameter.number


@dataclass(frozen=True, slots=True)
class Whole:
    """A whole number between limits; what is written with decimals is rounded."""

    low: int
    high: int

    def value(self, parameter: Parameter) -> int:
        """As `Real.value`."""
        return round(Real(self.low, self.high).value(parameter))


@dataclass(frozen=True, slots=True)
class Switch:
    """ON or OFF, or a number, of which only 0 is off."""

    def value(self, parameter: Parameter) -> bool:
        """As `Real.value`."""
        if parameter.kind is Kind.WORD:
            if parameter.text not in _SWITCH:
                raise ScpiError(-224, f"{parameter.text}: ON or OFF")
            return _SWITCH[parameter.text]
        return round(Real(-1e9, 1e9).value(parameter)) != 0


Answer = str | bytes | None
"""Text, or a block's bytes; nothing for a command."""


@dataclass(frozen=True, slots=True)
class Command:
    """One command or, with a question mark, one query."""

    pattern: str
    action: Callable[..., Answer]
    takes: Sequence[Real | Whole | Switch] = ()

    def run(self, parameters: Sequence[Parameter]) -> Answer:
        """Execute; raises `ScpiError`."""
        if len(parameters) > len(self.takes):
            raise ScpiError(-108, f"{self.pattern} takes {len(self.takes)}")
        if len(parameters) < len(self.takes):
            raise ScpiError(-109, f"{self.pattern} takes {len(self.takes)}")
        values = [kind.value(parameter) for kind, parameter in zip(self.takes, parameters, strict=True)]
        return self.action(*values)


_Node = dict[str, Any]
_COMMAND: Final = "", "?"
"""Keys of a node under which its command and its query stand; no mnemonic is like them."""


class Tree:
    """Commands by header."""

    def __init__(self, commands: Iterable[Command]) -> None:
        self._root: _Node = {}
        for command in commands:
            for words in _spellings(command.pattern.removesuffix("?")):
                node = self._root
                for word in words:
                    node = _grow(node, word)
                node[_COMMAND[command.pattern.endswith("?")]] = command

    def find(self, unit: Unit, path: tuple[str, ...]) -> tuple[Command, tuple[str, ...]]:
        """The command of a unit, and the path for the unit after it.

        Parameters
        ----------
        unit
            What was read.
        path
            Where the last unit of the same message ended: a header without a colon in front goes
            on from there. Common commands leave it as it is.

        Raises
        ------
        ScpiError
            −113.
        """
        words = unit.words if unit.is_common or unit.from_root else (*path, *unit.words)
        node = self._root
        for word in words:
            node = node.get(word) or {}
        command = node.get(_COMMAND[unit.is_query])
        if command is None:
            raise ScpiError(-113, ":".join(words)[:60] + "?" * unit.is_query)
        return command, path if unit.is_common else words[:-1]


def _spellings(pattern: str) -> Iterator[list[str]]:
    """With and without each part in brackets, as mnemonics."""
    bracket = re.search(r"\[(.*?)\]", pattern)
    if bracket is None:
        yield pattern.split(":")
        return
    before, after = pattern[: bracket.start()], pattern[bracket.end() :]
    for between in (bracket[1], ""):
        yield from _spellings(before + between + after)


def _grow(node: _Node, mnemonic: str) -> _Node:
    """The child of that name, under its short and its long form."""
    long = mnemonic.upper()
    short = "".join(char for char in mnemonic if not char.islower())
    child: _Node = node.setdefault(long, {})
    node.setdefault(short, child)
    return child
