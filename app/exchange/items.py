"""Whatever lies at a path or comes in one upload: a session, or a single file of any kind."""

from collections.abc import Iterable
from pathlib import Path

from app.exchange.archive import LARGEST_ARCHIVE, FolderFiles, ZipFiles
from app.exchange.certificate import read_certificate
from app.exchange.compression import too_big
from app.exchange.formats import kind_of, open_table
from app.exchange.means import read_means
from app.exchange.problems import refuse
from app.exchange.records import position_of, read_record
from app.exchange.session_folder import SessionFiles, read_session, stem_of
from app.exchange.session_json import FILE_NAME


def is_session(names: Iterable[str]) -> bool:
    """Whether files with such names make up one session, rather than a folder of several items."""
    return any(
        name == FILE_NAME or stem_of(name) == "certificate" or ("/" not in name and position_of(name))
        for name in names
    )


def open_item(path: Path) -> SessionFiles:
    """Read what lies at `path`: a session's folder or ZIP archive, or one file of any kind.

    Raises
    ------
    Invalid
        With every problem found, also when there is nothing at `path`.
    """
    try:
        if path.is_dir():
            return read_session(FolderFiles(path), path.name)
        if path.stat().st_size > LARGEST_ARCHIVE:
            raise too_big(path.name, LARGEST_ARCHIVE)
        return read_item(path.read_bytes(), path.name)
    except OSError as error:
        raise refuse(
            "no-file",
            "The file cannot be read (%(why)s). Check its name and who may read it.",
            file=str(path),
            why=error.strerror or str(error),
        ) from error


def read_item(data: bytes, filename: str) -> SessionFiles:
    """Read one file of any kind: a session's ZIP archive, means, a record or a certificate.

    Raises
    ------
    Invalid
        With every problem found; ``unknown-content`` when its columns are none of these.
    """
    if data.startswith(b"PK") and not _is_npz(data, filename):
        return read_session(ZipFiles(data, filename), filename)
    kind = kind_of(open_table(data, filename))
    if kind == "record":
        records, warnings = read_record(data, filename)
        return SessionFiles(records=records, warnings=warnings)
    if kind == "certificate":
        certificate, warnings = read_certificate(data, filename)
        return SessionFiles(certificate=certificate, warnings=warnings)
    means, warnings = read_means(data, filename)  # says what a header lacks when it is neither
    return SessionFiles(means=means, warnings=warnings)


def _is_npz(data: bytes, filename: str) -> bool:
    names = list(ZipFiles(data, filename))
    office = {"[Content_Types].xml", "mimetype"} & set(
        names
    )  # refused by the reader of tables, which says so
    return bool(office) or (bool(names) and all(name.endswith(".npy") for name in names))
