"""What can go wrong outside the mathematics: one class per kind, each with what, where and the cure.

The API turns an `AppError` into a problem document (RFC 9457), a page into a sentence beside the
field, the command into one line on standard error; none of them decides what the error is.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

from solver.errors import Message


@dataclass(frozen=True, slots=True)
class Problem:
    """One thing that is wrong, and where.

    Parameters
    ----------
    message
        What is wrong and what to do, as a translatable template with its values.
    file
        Name of the file as the user gave it.
    row
        Line of the file as an editor counts it (the header is line 1), or row of a table.
    column
        Name of the column or field, or a command's option.
    """

    message: Message
    file: str | None = None
    row: int | None = None
    column: str | None = None

    @property
    def where(self) -> str:
        """``currents.csv, row 7, column jx_ma`` as far as it is known."""
        option = self.column is not None and self.column.startswith("--")
        column = self.column if option else self.column and f"column {self.column}"
        parts = [self.file, self.row and f"row {self.row}", column]
        return ", ".join(part for part in parts if part)

    @property
    def text(self) -> str:
        """Where and what, in English."""
        return f"{self.where}: {self.message.text}" if self.where else self.message.text


def problem(
    code: str,
    template: str,
    /,
    *,
    file: str | None = None,
    row: int | None = None,
    column: str | None = None,
    **values: Any,
) -> Problem:
    """Make a `Problem` from a code, a template and the template's values."""
    return Problem(Message(code, template, values), file=file, row=row, column=column)


class AppError(Exception):
    """Base of every foreseen error. `problems` holds at least one."""

    status: ClassVar[int] = 400
    title: ClassVar[str] = "Bad request"

    def __init__(self, *problems: Problem) -> None:
        self.problems: Sequence[Problem] = problems
        super().__init__("\n".join(item.text for item in problems))


class Invalid(AppError):
    """Input that cannot be used: the fields or rows are named in `problems`."""

    status = 422
    title = "Input not usable"


class NotFound(AppError):
    """Something addressed by name or number is not there."""

    status = 404
    title = "Not found"


class Conflict(AppError):
    """It contradicts what is already there."""

    status = 409
    title = "Conflict"


class Unauthenticated(AppError):
    """Nobody, or nobody known, is asking."""

    status = 401
    title = "Sign in first"


class Forbidden(AppError):
    """Known, but not allowed to do this."""

    status = 403
    title = "Not allowed"
