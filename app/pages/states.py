"""States of sessions in words, as entries of the index."""

from typing import Final

from app.i18n import gettext, marked
from app.pages.labels import Mark

_STATES: Final = {
    "measuring": Mark("running", marked("Measuring")),
    "ready": Mark("due", marked("Ready to solve")),
    "solving": Mark("running", marked("Solving")),
    "failed": Mark("out", marked("Not solved")),
    "solved": Mark("ok", marked("Solved")),
}


def session_state(key: str) -> Mark:
    """A session's state, whatever its result was."""
    mark = _STATES.get(key, Mark("todo", key))
    return Mark(mark.shape, gettext(mark.word))
