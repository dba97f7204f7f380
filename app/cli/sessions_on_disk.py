"""Sessions as files and folders on a command line."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from app.exchange.items import is_session, open_item
from app.exchange.session_folder import SessionFiles


@dataclass(frozen=True, slots=True)
class Item:
    """One session to work on, and how the user called it."""

    name: str
    path: Path

    def read(self) -> SessionFiles:
        """Read its files: a folder, a ZIP archive, or one file of means or records."""
        return open_item(self.path)


def items(paths: Sequence[Path]) -> Iterator[Item]:
    """Each path's sessions: a folder that is no session itself gives one for each of its entries."""
    for path in paths:
        entries = _entries(path) if path.is_dir() else []
        yield from (Item(str(entry), entry) for entry in entries or [path])


def _entries(folder: Path) -> list[Path]:
    """What is in a folder of sessions; empty when the folder is a session itself."""
    entries = sorted(entry for entry in folder.iterdir() if not entry.name.startswith("."))
    return [] if is_session(entry.name for entry in entries) else entries
