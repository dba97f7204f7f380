"""Record files, named by the SHA-256 of their bytes.

A file is written under a temporary name, synced, renamed, and its folder synced, before anybody
refers to it; so a row in the database never names a file that is not wholly there. Two writers of
the same bytes meet in the same file.
"""

import hashlib
import os
import tempfile
from collections.abc import Iterator
from pathlib import Path

_SYNC_FOLDERS = os.name == "posix"


class RecordFiles:
    """A folder of content-addressed files: ``ab/cdef….parquet``."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    def put(self, content: bytes, suffix: str) -> str:
        """Keep the bytes and give their SHA-256 as hexadecimal digits; present bytes are not rewritten."""
        digest = hashlib.sha256(content).hexdigest()
        target = self.path(digest, suffix)
        if target.exists():
            return digest
        target.parent.mkdir(parents=True, exist_ok=True)
        handle, temporary = tempfile.mkstemp(dir=target.parent, prefix=".new-")
        try:
            with os.fdopen(handle, "wb") as file:
                file.write(content)
                file.flush()
                os.fsync(file.fileno())
            Path(temporary).replace(target)
        except BaseException:
            Path(temporary).unlink(missing_ok=True)
            raise
        _sync_folder(target.parent)
        _sync_folder(self.folder)
        return digest

    def take(self, file: Path, suffix: str) -> str:
        """Keep a file's bytes without reading them whole: it is moved, from this very file system."""
        with file.open("rb") as content:
            digest = hashlib.file_digest(content, "sha256").hexdigest()
            os.fsync(content.fileno())
        target = self.path(digest, suffix)
        if not target.exists():
            target.parent.mkdir(parents=True, exist_ok=True)
            file.replace(target)
            _sync_folder(target.parent)
            _sync_folder(self.folder)
        return digest

    def path(self, digest: str, suffix: str) -> Path:
        """Where the bytes with this digest are."""
        return self.folder / digest[:2] / f"{digest[2:]}.{suffix}"

    def read(self, digest: str, suffix: str) -> bytes:
        """The bytes, checked against their name.

        Raises
        ------
        OSError
            When the file is missing or its bytes are not those of its name.
        """
        content = self.path(digest, suffix).read_bytes()
        if hashlib.sha256(content).hexdigest() != digest:
            raise OSError(f"record file {digest} does not hold the bytes of its name")
        return content

    def __iter__(self) -> Iterator[tuple[str, Path]]:
        """Every stored file as (digest, path)."""
        for path in sorted(self.folder.glob("??/*.*")):
            if not path.name.startswith("."):
                yield path.parent.name + path.name.split(".", 1)[0], path


def _sync_folder(folder: Path) -> None:
    if not _SYNC_FOLDERS:
        return
    handle = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)
