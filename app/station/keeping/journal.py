"""The journal: JSON lines, only ever appended, each with its CRC-32 and on the disk before it counts.

    {"crc": "0c3ab7f1", "entry": {…}}

A line that a power cut tore off is the last one; it was never relied on, and reading drops it. A bad line
with good ones after it is a damaged disk: then nothing is guessed.
"""

import json
import zlib
from pathlib import Path
from typing import Any, Final

from app.errors import problem
from app.station.keeping import durable
from app.station.keeping.durable import SpoolFailed

_HEAD: Final = b'{"crc": "'
_BETWEEN: Final = b'", "entry": '


class Journal:
    """An open journal; `entries` are those that were there when it was opened."""

    def __init__(self, path: Path) -> None:
        self.entries, good = read_journal(path)
        self._stream = durable.open_to_append(path, good)
        self._broken: BaseException | None = None

    def append(self, entry: dict[str, Any]) -> None:
        """Add an entry; when this returns it is on the disk."""
        if self._broken is not None:  # a torn line must stay the last one
            raise _closed(self._broken)
        try:
            durable.append(self._stream, encoded(entry))
        except BaseException as error:
            self._broken = error
            raise

    def close(self) -> None:
        """Close the file."""
        self._stream.close()


def encoded(entry: dict[str, Any]) -> bytes:
    """One line of the journal."""
    body = json.dumps(entry, ensure_ascii=False, allow_nan=False).encode()
    return _HEAD + b"%08x" % zlib.crc32(body) + _BETWEEN + body + b"}\n"


def read_journal(path: Path) -> tuple[list[dict[str, Any]], int]:
    """Read the entries, and the length of the good part; a file that is not there has none.

    Raises
    ------
    SpoolFailed
        A line other than the last one is damaged.
    """
    data = path.read_bytes() if path.exists() else b""
    entries: list[dict[str, Any]] = []
    good = at = number = 0
    torn: int | None = None
    while at < len(data):
        end = data.find(b"\n", at) + 1 or len(data)
        number += 1
        entry = _decoded(data[at:end])
        if entry is None:
            torn = torn or number
        elif torn is not None:
            raise _damaged(path, torn)
        else:
            entries.append(entry)
            good = end
        at = end
    return entries, good


def _decoded(line: bytes) -> dict[str, Any] | None:
    start = len(_HEAD) + 8
    if not (line.startswith(_HEAD) and line.endswith(b"}\n") and line[start:].startswith(_BETWEEN)):
        return None
    body = line[start + len(_BETWEEN) : -2]
    if line[len(_HEAD) : start] != b"%08x" % zlib.crc32(body):
        return None
    entry: dict[str, Any] = json.loads(body)
    return entry


def _closed(why: BaseException) -> SpoolFailed:
    """What keeps a journal from being written any more, for whoever comes after the one who met it."""
    if isinstance(why, SpoolFailed):
        return SpoolFailed(*why.problems)
    return SpoolFailed(
        problem("journal-closed", "The journal could not be written; start the same command again.")
    )


def _damaged(path: Path, line: int) -> SpoolFailed:
    return SpoolFailed(
        problem(
            "journal-damaged",
            "Line %(line)d of %(path)s is damaged, and what follows it is not: the disk lost something. Keep the "
            "folder for whoever looks into it and measure anew with another --spool.",
            line=line,
            path=str(path),
        )
    )
