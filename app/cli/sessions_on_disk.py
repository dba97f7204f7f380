"""Sessions as files and folders on a command line."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from app.errors import Invalid, problem
from app.exchange.archive import FolderFiles, ZipFiles
from app.exchange.session_folder import SessionFiles, read_session


@dataclass(frozen=True, slots=True)
class Item:
    """One session to work on, and how the user called it."""

    name: str
    path: Path

    def read(self) -> SessionFiles:
        """Read its files: a folder, a ZIP archive, or one file of means or records."""
        return read_session(self._files(), self.name)

    def _files(self) -> Mapping[str, bytes]:
        if self.path.is_dir():
            return FolderFiles(self.path)
        if not self.path.is_file():
            raise Invalid(problem("no-file", "There is no such file or folder.", file=self.name))
        content = self.path.read_bytes()
        if self.path.suffix.lower() == ".zip":
            return ZipFiles(content, self.path.name)
        return {self.path.name: content}


def items(paths: Sequence[Path]) -> Iterator[Item]:
    """Each path's sessions: a folder whose entries are sessions themselves gives one for each."""
    for path in paths:
        inner = _inner(path) if path.is_dir() else []
        if inner:
            yield from (Item(str(entry), entry) for entry in inner)
        else:
            yield Item(str(path), path)


def _inner(folder: Path) -> list[Path]:
    """The sessions in a folder of sessions; empty when the folder is a session itself.

    It is one when it holds files; it holds sessions when there are only folders and archives in it.
    """
    entries = sorted(entry for entry in folder.iterdir() if not entry.name.startswith("."))
    many = entries and all(entry.is_dir() or entry.suffix.lower() == ".zip" for entry in entries)
    return entries if many else []
