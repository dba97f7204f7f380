"""Collecting what is wrong with one file, so that a person mends it in one go."""

from typing import Any, Final

from app.errors import Invalid, Problem, problem
from solver.errors import Message

SHOWN: Final = 20
"""So many problems of one file are named; the rest is counted."""


class Problems:
    """The problems of one file, in the order found.

    Parameters
    ----------
    file
        Name of the file as the user gave it; every problem carries it.
    """

    def __init__(self, file: str | None) -> None:
        self.file = file
        self._shown: list[Problem] = []
        self._count = 0

    def __bool__(self) -> bool:
        return self._count > 0

    def __len__(self) -> int:
        return self._count

    @property
    def room(self) -> int:
        """How many more will be shown; whoever searches a long file may stop at 0."""
        return SHOWN - len(self._shown)

    def add(self, item: Problem) -> None:
        """Add one problem; beyond the first `SHOWN` it is only counted."""
        self._count += 1
        if len(self._shown) < SHOWN:
            self._shown.append(item)

    def note(self, message: Message, *, row: int | None = None, column: str | None = None) -> None:
        """Add `message` as a problem of this file."""
        self.add(Problem(message, file=self.file, row=row, column=column))

    def count_further(self, further: int) -> None:
        """Count problems that the caller did not look at one by one."""
        self._count += further

    def raise_if_any(self) -> None:
        """Raise `Invalid` with what was collected.

        Raises
        ------
        Invalid
            When there is at least one problem.
        """
        if not self._count:
            return
        shown = list(self._shown)
        hidden = self._count - len(shown)
        if hidden:
            shown.append(
                problem(
                    "more-problems",
                    "… and %(count)d more problems. Mend these first, then read the file again.",
                    file=self.file,
                    count=hidden,
                )
            )
        raise Invalid(*shown)


def refuse(code: str, template: str, /, **where_and_values: Any) -> Invalid:
    """Make an `Invalid` with one problem: ``raise refuse("empty-file", "…", file=name)``."""
    return Invalid(problem(code, template, **where_and_values))
