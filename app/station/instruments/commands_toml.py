"""Commands and answers out of a station's file, checked so far that nothing but the instrument can refuse them."""

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from string import Formatter
from typing import Final

import numpy as np

from app.exchange.numbers import SIZES
from app.station.instruments.dialogue import Errors
from app.station.instruments.exchanges import KIND_OF, LAB_UNIT, YES, Columns, Command, Exchange, Words
from app.station.instruments.toml_tables import Table
from solver.errors import Message

_NO_ERROR: Final = "[+-]?0+"
_NEVER: Final = re.compile("(?!)")


@dataclass(frozen=True, slots=True)
class Form:
    """What a command must and may be.

    Attributes
    ----------
    places
        Values that may stand in what is sent, each with an example.
    sends
        Groups of these, of each of which one at least must stand there.
    gives
        Values that the answers must give.
    may_give
        Values that they may give besides.
    """

    places: Mapping[str, float] = field(default_factory=dict)
    sends: tuple[frozenset[str], ...] = ()
    gives: frozenset[str] = frozenset()
    may_give: frozenset[str] = frozenset()


def command(table: Table, key: str, form: Form) -> Command:
    """Read a command: a text to send, a table with its answer, or several of these in brackets."""
    value = table.value(key)
    if value is None:
        table.missing(key)
        return Command(())
    parts = value if isinstance(value, list) and value else [value]
    exchanges: list[Exchange] = []
    assumed: dict[str, bool] = {}
    for number, part in enumerate(parts):
        place = f"{key}[{number}]" if parts is value else key
        if isinstance(part, str):
            exchanges.append(Exchange(part))
        elif isinstance(part, dict):
            _read_part(table.part(part, place), exchanges, assumed)
        else:
            table.wrong(
                key,
                Message("not-a-command", "This must be a text to send, or a table with send and answer."),
            )
    read = Command(tuple(exchanges), assumed)
    _check_places(table, key, form, read)
    _check_names(table, key, form, read)
    return read


def errors(table: Table, key: str) -> Errors | None:
    """How the instrument tells its errors; None when the file says nothing of it."""
    if not table.has(key):
        return None
    part = table.table(key)
    none = pattern(part, "none", _NO_ERROR)
    exchanges: list[Exchange] = []
    _read_part(part, exchanges, {})
    if not exchanges or not isinstance(answer := exchanges[0].answer, Words):
        part.missing("answer")
        return None
    if not answer.names or not set(answer.names) <= {"code", "text"}:
        part.wrong(
            "answer",
            Message("no-value", "The answer gives no %(names)s. Name a group: (?P<%(first)s>…).",
                    {"names": "code, text", "first": "code"}),
        )  # fmt: skip
    return Errors(exchanges[0], none)


def pattern(table: Table, key: str, default: str | None = None) -> re.Pattern[str]:
    """Read a regular expression; letters match in either case."""
    text = table.text(key, default)
    try:
        return re.compile(text, re.IGNORECASE)
    except re.error as error:
        table.wrong(
            key,
            Message(
                "not-a-pattern",
                "This is no regular expression: %(why)s. Write it in 'single quotation marks'.",
                {"why": str(error)},
            ),
        )
    return _NEVER


def _read_part(part: Table, exchanges: list[Exchange], assumed: dict[str, bool]) -> None:
    if part.has("assume"):
        assumed.update(part.table("assume").flags())
        part.finish()
        return
    send = part.text("send")
    yes = pattern(part, "yes", YES)
    answer: Words | Columns | None = None
    if part.has("columns"):
        answer = _columns(part)
    elif part.has("answer"):
        form = pattern(part, "answer")
        answer = Words(form, _units(part, tuple(form.groupindex)), yes)
    part.finish()
    exchanges.append(Exchange(send, answer))


def _columns(part: Table) -> Columns:
    names = part.texts("columns")
    element = part.text("block", "") or None
    if element is not None and not _is_number_type(element):
        part.wrong(
            "block",
            Message("not-a-type", "This is no type of a binary number. Write <f8, >f4, <i4 or the like."),
        )
        element = None
    return Columns(names, _units(part, names), element, part.text("separator", ","))


def _is_number_type(text: str) -> bool:
    return re.fullmatch(r"[<>](f[48]|[iu][1248])", text) is not None and np.dtype(text).itemsize > 0


def _units(part: Table, names: tuple[str, ...]) -> dict[str, str]:
    """Unit of each value that has one: of its own in `units`, else the common `unit`."""
    common = part.text("unit", "")
    own = part.table("units")
    units = {}
    for name in names:
        kind = KIND_OF.get(name, "")
        if kind not in LAB_UNIT:
            continue
        key = name if own.has(name) else "unit"
        unit = (own.text(name) if own.has(name) else common).lower()
        if unit in SIZES[kind]:
            units[name] = unit
            continue
        (own if own.has(name) else part).wrong(
            key,
            Message(
                "unknown-unit",
                "The unit of %(name)s must be one of %(known)s.",
                {"name": name, "known": ", ".join(SIZES[kind])},
            ),
        )
        units[name] = LAB_UNIT[kind]
    own.finish()
    return units


def _check_places(table: Table, key: str, form: Form, read: Command) -> None:
    """Every placeholder must be known here and take its example; those that matter must be used."""
    used: set[str] = set()
    known = True
    for exchange in read.exchanges:
        try:
            names = {name for _, name, _, _ in Formatter().parse(exchange.send) if name is not None}
            strange = sorted(names - set(form.places))
            if strange:
                table.wrong(
                    key,
                    Message(
                        "unknown-placeholder",
                        "Nothing is known of {%(name)s} here. Choose from %(known)s; a brace that is to be sent is "
                        "written twice.",
                        {"name": strange[0], "known": _listed(form.places)},
                    ),
                )
                known = False
                continue
            exchange.text(form.places)
            used |= names
        except (ValueError, KeyError, IndexError) as error:
            table.wrong(
                key,
                Message(
                    "bad-placeholder", "A placeholder is not written well: %(why)s.", {"why": str(error)}
                ),
            )
    for group in form.sends:
        if known and not used & group:
            table.wrong(
                key,
                Message(
                    "no-placeholder",
                    "This does not send what matters. Put one of %(known)s into it.",
                    {"known": _listed(sorted(group))},
                ),
            )


def _listed(names: Mapping[str, float] | list[str]) -> str:
    return ", ".join(f"{{{name}}}" for name in names) or "–"


def _check_names(table: Table, key: str, form: Form, read: Command) -> None:
    strange = sorted(read.names - form.gives - form.may_give)
    if strange:
        table.wrong(
            key,
            Message(
                "unknown-value",
                "Nothing is known of the value %(name)s here. Choose from %(known)s.",
                {"name": strange[0], "known": ", ".join(sorted(form.gives | form.may_give)) or "–"},
            ),
        )
    lacking = sorted(form.gives - read.names)
    if lacking:
        table.wrong(
            key,
            Message("no-value", "The answer gives no %(names)s. Name a group: (?P<%(first)s>…).",
                    {"names": ", ".join(lacking), "first": lacking[0]}),
        )  # fmt: skip
