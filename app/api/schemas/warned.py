"""Something worth knowing that stops nothing."""

from collections.abc import Iterable

from app.api.schemas.common import Outgoing
from solver.errors import Message


class Warned(Outgoing):
    """A warning: a code for programs, a sentence for people."""

    code: str
    message: str


def warned(messages: Iterable[Message]) -> list[Warned]:
    """Warnings as they are answered."""
    return [Warned(code=message.code, message=message.text) for message in messages]
