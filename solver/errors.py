"""What can go wrong in a calibration, in words that travel.

A `Message` keeps its English template and its values apart, so that the edge can show it in
another language. `SolverError` carries one.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any


@dataclass(frozen=True, slots=True)
class Message:
    """A code for programs and a sentence for people.

    Parameters
    ----------
    code
        Short, stable, lower case with hyphens: ``unobservable``.
    template
        English sentence with ``%(name)s`` placeholders; it is also the translation's key.
    values
        What the placeholders stand for.
    """

    code: str
    template: str
    values: Mapping[str, Any] = field(default_factory=dict)

    @property
    def text(self) -> str:
        """The sentence in English."""
        return self.template % self.values if self.values else self.template


class SolverError(ValueError):
    """A calibration that cannot be given: `message` says what and why."""

    def __init__(self, message: Message) -> None:
        super().__init__(message.text)
        self.message = message


class InputError(SolverError):
    """The input itself is unusable: shapes, non-finite values, positions missing for the method."""


class NotConverged(SolverError):
    """The successive approximations did not converge; `iterations` holds every round, (rounds, 8)."""

    def __init__(self, message: Message, iterations: Any) -> None:
        super().__init__(message)
        self.iterations = iterations
