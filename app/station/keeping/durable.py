"""Writes that a power cut cannot take back: a file is synced before anybody relies on it.

Whatever goes wrong with the disk ends in `SpoolFailed`: the station stops with a sentence rather than measure
what it cannot keep.
"""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO

from app.errors import AppError, problem

_SYNC_FOLDERS = os.name == "posix"  # Windows keeps a renamed file's name without it


class SpoolFailed(AppError):
    """The station's disk does not take or give back what it must keep."""


def append(stream: BinaryIO, data: bytes) -> None:
    """Write at the end of an open file and sync; a cut in between leaves a piece that reading drops."""
    with _plainly(Path(stream.name)):
        stream.write(data)
        stream.flush()
        os.fsync(stream.fileno())


def write_whole(path: Path, data: bytes) -> None:
    """Put a file in its place, whole or not at all."""
    temporary = path.with_name(path.name + ".new")
    with _plainly(path):
        with temporary.open("wb") as file:
            file.write(data)
            file.flush()
            os.fsync(file.fileno())
        temporary.replace(path)
        sync_folder(path.parent)


def read_whole(path: Path) -> bytes:
    """Read a file that was written."""
    with _plainly(path):
        return path.read_bytes()


def make_folders(*folders: Path) -> None:
    """Make folders, their parents too."""
    for folder in folders:
        with _plainly(folder):
            folder.mkdir(parents=True, exist_ok=True)


def open_to_append(path: Path, good: int) -> BinaryIO:
    """Open a file to append to it, cut down to its first `good` bytes."""
    with _plainly(path):
        new = not path.exists()
        stream = path.open("ab")
        if not new:
            stream.truncate(good)
            os.fsync(stream.fileno())
        else:
            sync_folder(path.parent)
        return stream


def sync_folder(folder: Path) -> None:
    """Make the names in a folder as durable as the files."""
    if not _SYNC_FOLDERS:
        return
    handle = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


@contextmanager
def _plainly(path: Path) -> Iterator[None]:
    try:
        yield
    except OSError as error:
        raise SpoolFailed(
            problem(
                "spool-unwritable",
                "The station's disk does not keep %(path)s (%(why)s). Make room or mend it and run the same "
                "command again: it goes on where it was, nothing measured so far is lost.",
                path=str(path),
                why=error.strerror or str(error),
            )
        ) from error
