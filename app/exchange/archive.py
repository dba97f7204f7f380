"""The files of a session as a mapping from name to bytes: a folder's or a ZIP archive's.

A file is read when it is asked for, one at a time. Nothing outside the folder is ever touched, and
no member of an archive is unpacked further than it may be long.
"""

import io
import os
import stat
import zipfile
import zlib
from collections.abc import Iterator, Mapping
from pathlib import Path, PurePosixPath
from typing import Final

from app.exchange.compression import LARGEST_BYTES, too_big
from app.exchange.problems import Problems, refuse
from solver.errors import Message

MOST_FILES: Final = 10_000
LARGEST_ARCHIVE: Final = 2 * LARGEST_BYTES
_EPOCH: Final = (1980, 1, 1, 0, 0, 0)


def is_safe(name: str) -> bool:
    """Whether a name stays within its folder: relative, no “..”, no drive, no control character."""
    path = PurePosixPath(name)
    return bool(
        name
        and not path.is_absolute()
        and ".." not in path.parts
        and not set(name) & set("\\:\0")
        and name.isprintable()
    )


class FolderFiles(Mapping[str, bytes]):
    """Files of a folder and its subfolders; hidden ones and links out of it are left out.

    Raises
    ------
    Invalid
        When there are too many files for a session, or one too big is asked for.
    """

    def __init__(self, folder: Path) -> None:
        self._paths: dict[str, Path] = {}
        root = folder.resolve()
        for parent, folders, names in os.walk(root):
            folders[:] = sorted(name for name in folders if not name.startswith("."))
            for name in sorted(names):
                path = Path(parent) / name
                if not name.startswith(".") and path.resolve().is_relative_to(root) and path.is_file():
                    self._paths[path.relative_to(root).as_posix()] = path
            if len(self._paths) > MOST_FILES:
                raise _too_many(str(folder))

    def __getitem__(self, name: str) -> bytes:
        path = self._paths[name]
        if path.stat().st_size > LARGEST_BYTES:
            raise too_big(name, LARGEST_BYTES)
        return path.read_bytes()

    def __iter__(self) -> Iterator[str]:
        return iter(self._paths)

    def __len__(self) -> int:
        return len(self._paths)


class ZipFiles(Mapping[str, bytes]):
    """Members of a ZIP archive; one folder around all of them is taken off.

    Raises
    ------
    Invalid
        Damaged, encrypted, too many or too big members, names that lead out of the archive.
    """

    def __init__(self, data: bytes, filename: str) -> None:
        self._filename = filename
        try:
            self._archive = zipfile.ZipFile(io.BytesIO(data))
            members = self._archive.infolist()
        except (zipfile.BadZipFile, OSError, ValueError, NotImplementedError) as error:
            raise self._damaged() from error
        if len(members) > MOST_FILES:
            raise _too_many(filename)
        if sum(item.file_size for item in members) > LARGEST_ARCHIVE:
            raise too_big(filename, LARGEST_ARCHIVE)
        self._members = _without_common_folder(self._checked(members))

    def _checked(self, members: list[zipfile.ZipInfo]) -> dict[str, zipfile.ZipInfo]:
        problems = Problems(self._filename)
        found: dict[str, zipfile.ZipInfo] = {}
        for item in members:
            name = item.filename
            if item.is_dir():
                continue
            shown = {"name": name[:80]}
            if not is_safe(name) or stat.S_ISLNK(item.external_attr >> 16):
                problems.note(
                    Message(
                        "unsafe-name",
                        "The member “%(name)s” leads out of the archive. Pack the session's folder anew.",
                        shown,
                    )
                )
            elif item.flag_bits & 1:
                problems.note(
                    Message(
                        "encrypted",
                        "The member “%(name)s” is encrypted. Pack the session without a password.",
                        shown,
                    )
                )
            elif name in found:
                problems.note(
                    Message(
                        "duplicate-file",
                        "The member “%(name)s” is in the archive twice. Pack the session's folder anew.",
                        shown,
                    )
                )
            elif not _is_hidden(name):
                found[name] = item
        problems.raise_if_any()
        return found

    def _damaged(self) -> Exception:
        return refuse(
            "damaged",
            "The ZIP archive is damaged or was cut short. Pack or copy it again.",
            file=self._filename,
        )

    def __getitem__(self, name: str) -> bytes:
        item = self._members[name]
        if item.file_size > LARGEST_BYTES:
            raise too_big(name, LARGEST_BYTES)
        try:
            return self._archive.read(item)
        except (zipfile.BadZipFile, OSError, EOFError, ValueError, RuntimeError, NotImplementedError,
                zlib.error) as error:  # fmt: skip
            raise self._damaged() from error

    def __iter__(self) -> Iterator[str]:
        return iter(self._members)

    def __len__(self) -> int:
        return len(self._members)


def _is_hidden(name: str) -> bool:
    return any(part.startswith((".", "__MACOSX")) for part in PurePosixPath(name).parts)


def _without_common_folder(members: dict[str, zipfile.ZipInfo]) -> dict[str, zipfile.ZipInfo]:
    folders = {PurePosixPath(name).parts[0] for name in members}
    if len(folders) != 1 or not all(len(PurePosixPath(name).parts) > 1 for name in members):
        return members
    return {str(PurePosixPath(*PurePosixPath(name).parts[1:])): item for name, item in members.items()}


def _too_many(filename: str) -> Exception:
    return refuse(
        "too-many-files",
        "There are more than %(limit)d files. Choose the folder of one session.",
        file=filename,
        limit=MOST_FILES,
    )


def zip_bytes(files: Mapping[str, bytes]) -> bytes:
    """Pack files into a ZIP archive: equal files, equal bytes."""
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED) as archive:
        for name in sorted(files):
            archive.writestr(zipfile.ZipInfo(name, _EPOCH), files[name], zipfile.ZIP_DEFLATED)
    return stream.getvalue()


def save(files: Mapping[str, bytes], folder: Path) -> None:
    """Write files into a folder, which is made where it is missing."""
    for name, data in files.items():
        if not is_safe(name):
            raise ValueError(f"{name!r} does not stay in its folder")
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(data)
