"""Forms: what was typed, what is wrong with it, and where."""

from collections.abc import AsyncIterator, Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from datetime import date
from typing import Annotated, TypeVar

from fastapi import Depends, Request
from starlette.datastructures import FormData, UploadFile

from app.errors import Invalid, Problem, problem
from app.exchange.numbers import typed
from app.i18n import gettext, translate
from app.pages import labels
from solver.errors import Message

T = TypeVar("T")


async def _sent(request: Request) -> AsyncIterator[FormData]:
    async with request.form(max_fields=4000) as data:
        yield data


Sent = Annotated[FormData, Depends(_sent)]
"""The fields and files of a form that was sent."""


@dataclass(frozen=True, slots=True)
class Form:
    """A form as it stands: values by field, as typed, and the problems found.

    Attributes
    ----------
    values
        By field, in the order of the page; fields that were not sent are empty.
    problems
        A problem belongs to the field of its `column`; others belong to the form.
    """

    values: Mapping[str, str] = field(default_factory=dict)
    problems: Sequence[Problem] = ()

    @classmethod
    def of(cls, sent: FormData, *fields: str) -> "Form":
        """What was sent in these fields; files are left out."""
        return cls({name: _text(sent.get(name)) for name in fields})

    def with_problems(self, *problems: Problem) -> "Form":
        """The same values with these problems."""
        return Form(self.values, (*self.problems, *problems))

    def value(self, name: str) -> str:
        """What stands in a field."""
        return self.values.get(name, "")

    def problem(self, name: str) -> str:
        """What is wrong with a field, in the current language; empty when nothing is."""
        return " ".join(translate(item.message) for item in self.problems if item.column == name)

    @property
    def first(self) -> str | None:
        """The first field with a problem: the focus goes there."""
        wrong = {item.column for item in self.problems}
        return next((name for name in self.values if name in wrong), None)

    @property
    def general(self) -> tuple[str, ...]:
        """Problems that belong to no field of this form, each with its place."""
        return tuple(sentence(item) for item in self.problems if item.column not in self.values)


def sentence(item: Problem) -> str:
    """A problem with its place, in the current language: ``currents.csv, row 7: …``."""
    parts = [item.file, item.row and gettext("row %(row)d") % {"row": item.row},
             item.column and gettext("column %(column)s") % {"column": item.column}]  # fmt: skip
    where = ", ".join(part for part in parts if part)
    text = translate(_with_roles(item.message))
    return f"{where}: {text}" if where else text


def _with_roles(message: Message) -> Message:
    """The message with the roles that it names in words."""
    told = {name: ", ".join(labels.role(role) for role in message.values[name].split(", "))
            for name in ("role", "roles") if name in message.values}  # fmt: skip
    return replace(message, values={**message.values, **told})


def negative(name: str, value: float | None) -> list[Problem]:
    """What to say of a standard uncertainty below zero."""
    if value is None or not value < 0:
        return []
    return [problem("negative-uncertainty", "A standard uncertainty is not negative. Take the sign away.",
                    column=name)]  # fmt: skip


def _text(value: UploadFile | str | None) -> str:
    return value if isinstance(value, str) else ""


class Fields:
    """Reads the fields of a form and collects what is wrong, so that all is said at once."""

    def __init__(self, form: Form) -> None:
        self._form = form
        self._problems: list[Problem] = []

    def number(self, name: str, unit: str) -> float:
        """A number that must be there; decimal point and comma both count."""
        return self._tried(lambda: typed(self._form.value(name), unit, column=name), float("nan"))

    def optional(self, name: str, unit: str) -> float | None:
        """A number, or None for an empty field."""
        return self.number(name, unit) if self._form.value(name).strip() else None

    def not_negative(self, name: str) -> float | None:
        """A standard uncertainty, or None for an empty field."""
        value = self.optional(name, "")
        self.wrong(*negative(name, value))
        return value

    def whole(self, name: str) -> int:
        """A whole number that must be there."""
        text = self._form.value(name).strip()
        if text.isascii() and text.isdigit() and len(text) <= 19:
            return int(text)
        self.wrong(problem("not-whole", "“%(text)s” is not a whole number. Write digits only, as in 42.",
                           column=name, text=text[:40]))  # fmt: skip
        return 0

    def day(self, name: str) -> date:
        """A date as the browser sends it (2026-11-20) or as it is written in Russian (20.11.2026)."""
        text = self._form.value(name).strip()
        parts = text.split(".")
        iso = "-".join(reversed(parts)) if len(parts) == 3 else text
        try:
            return date.fromisoformat(iso)
        except ValueError:
            self.wrong(problem("bad-date", "“%(text)s” is not a date. Write it like 2026-11-20.",
                               column=name, text=text[:40]))  # fmt: skip
            return date.min

    def text(self, name: str, limit: int = 2000) -> str:
        """What stands there, without surrounding blanks."""
        value = self._form.value(name).strip()
        if len(value) > limit:
            self.wrong(problem("too-long", "This is too long. Keep it to %(limit)d characters.",
                               column=name, limit=limit))  # fmt: skip
        return value

    def wrong(self, *problems: Problem) -> None:
        """Note further problems."""
        self._problems.extend(problems)

    def check(self) -> None:
        """Raise `Invalid` with every problem found."""
        if self._problems:
            raise Invalid(*self._problems)

    def _tried(self, read: Callable[[], T], otherwise: T) -> T:
        try:
            return read()
        except Invalid as error:
            self._problems.extend(error.problems)
            return otherwise
