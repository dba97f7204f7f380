"""Files as they are brought in: their bytes kept, their records kept as Parquet, their means ready to save.

Everything here happens before the transaction that refers to it: whatever a row names is on disk.
"""

import shutil
import zipfile
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Final

from app.errors import Invalid, problem
from app.exchange.archive import ZipFiles
from app.exchange.certificate import write_certificate_csv
from app.exchange.items import read_item
from app.exchange.records import read_record
from app.exchange.rows import CertificateRow, Facts
from app.exchange.session_folder import SessionFiles
from app.exchange.session_json import FILE_NAME, read_session_json
from app.services import calibrations, ingest, sessions, stands
from app.services.ingest import Measured, Saved, Source, measured_item, source_suffix
from app.services.keeping import keep_record
from app.services.lab import Work
from app.services.sessions import NewSession
from app.services.views import JobView, SessionView
from app.store.records import RecordFiles
from solver.errors import Message

LARGEST_AT_ONCE: Final = 32 * 2**20
"""A session whose files are longer than this together, in bytes, is read in the background."""


@dataclass(frozen=True, slots=True)
class Wanted:
    """What is said beside the files; None leaves it to their `session.json`."""

    gyro: str | None = None
    stand: str | None = None
    certificate: str | None = None
    started_at: datetime | None = None
    method: str | None = None


@dataclass(frozen=True, slots=True)
class Arrived:
    """A session's files, kept; `measured` is None when they are to be read in the background."""

    digest: str
    name: str
    facts: Facts
    certificate: Sequence[CertificateRow] = ()
    measured: tuple[Measured, ...] | None = None
    warnings: tuple[Message, ...] = ()


@dataclass(frozen=True, slots=True)
class BroughtIn:
    """The session made of them."""

    session: SessionView
    saved: tuple[Saved, ...]
    job: JobView | None
    warnings: tuple[Message, ...]


def keep_position(
    files: RecordFiles, path: Path, name: str, theta_deg: float, psi_deg: float, repeat: int | None
) -> tuple[Measured, list[Message]]:
    """Read one position's record from a file and keep it: as it came, and as Parquet.

    Raises
    ------
    Invalid
        The file cannot be read, or holds more than one measurement.
    """
    content = path.read_bytes()
    records, warnings = read_record(content, name, theta_deg=theta_deg, psi_deg=psi_deg, repeat=repeat)
    if len(records) != 1:
        raise Invalid(
            problem(
                "several-positions",
                "The file holds %(count)d measurements; here one position is wanted. Upload it as a session.",
                file=name,
                count=len(records),
            )
        )
    source = Source("upload", files.put(content, source_suffix(name)), name)
    return measured_item(keep_record(files, records[0]), source), warnings


def kept_item(files: RecordFiles, item: SessionFiles, source: Source) -> Iterator[Measured]:
    """Keep an item's records one by one; the means given for further positions come after them."""
    for record in item.records:
        yield measured_item(keep_record(files, record), source)
    for row in item.measured()[len(item.records) :]:
        yield Measured(replace(row, line=None), source)


def arrive(files: RecordFiles, path: Path, name: str) -> Arrived:
    """Keep an uploaded session: its bytes; and unless it is long, its records and means.

    Parameters
    ----------
    path
        The bytes, on the file system of the record files; the file is moved away.
    name
        As the user gave it.

    Raises
    ------
    Invalid
        With the problems of every file.
    """
    length, facts = _looked_at(path, name)
    if length > LARGEST_AT_ONCE:
        return Arrived(files.take(path, source_suffix(name)), name, facts)
    item = read_item(path.read_bytes(), name)
    digest = files.take(path, source_suffix(name))
    measured = tuple(kept_item(files, item, Source("upload", digest, name)))
    return Arrived(digest, name, item.facts, item.certificate, measured, tuple(item.warnings))


def bring_in(work: Work, arrived: Arrived, wanted: Wanted) -> BroughtIn:
    """Open a session for files that have arrived, save or import what they measured, solve if asked.

    Raises
    ------
    Invalid
        Neither the files nor the request name gyro and stand; a position is not certified.
    """
    opened = sessions.open_session(work, _new_session(arrived.facts, wanted))
    job: JobView | None
    if arrived.measured is None:
        job = ingest.request_import(work, opened.id, arrived.digest, arrived.name, wanted.method)
        return BroughtIn(sessions.session(work, opened.id), (), job, arrived.warnings)
    saved = ingest.save(work, opened.id, arrived.measured)
    job = calibrations.request(work, opened.id, wanted.method) if wanted.method else None
    warnings = arrived.warnings + _differences(work, opened, arrived)
    return BroughtIn(sessions.session(work, opened.id), saved, job, warnings)


def sweep(folder: Path, older_than: timedelta) -> None:
    """Remove what uploads left behind when the service was killed."""
    oldest = datetime.now(UTC) - older_than
    for path in folder.iterdir():
        if datetime.fromtimestamp(path.stat().st_mtime, UTC) < oldest:
            shutil.rmtree(path) if path.is_dir() else path.unlink()


def brought_before(work: Work, session_id: int) -> BroughtIn:
    """A session that was brought in by an earlier request."""
    found = sessions.detail(work, session_id)
    saved = tuple(Saved(item, new=False) for item in found.revisions)
    return BroughtIn(found.session, saved, found.session.job, ())


def _looked_at(path: Path, name: str) -> tuple[int, Facts]:
    """Length of everything in it, and what its `session.json` says."""
    if not zipfile.is_zipfile(path):
        return path.stat().st_size, Facts()
    with zipfile.ZipFile(path) as archive:
        length = sum(member.file_size for member in archive.infolist())
    if length <= LARGEST_AT_ONCE:
        return length, Facts()  # it is read in full at once
    inside = ZipFiles(path.read_bytes(), name)
    return length, read_session_json(inside[FILE_NAME])[0] if FILE_NAME in inside else Facts()


def _new_session(facts: Facts, wanted: Wanted) -> NewSession:
    gyro, stand = wanted.gyro or facts.gyro, wanted.stand or facts.stand
    absent = [name for name, value in (("gyro", gyro), ("stand", stand)) if value is None]
    if gyro is None or stand is None:
        raise Invalid(
            *(
                problem("not-named", "Name the %(what)s, here or in session.json.", column=name, what=name)
                for name in absent
            )
        )
    return NewSession(
        gyro, stand, wanted.certificate, started_at=wanted.started_at or facts.started_at,
        temperature_c=facts.temperature_c, origin="upload",
    )  # fmt: skip


def _differences(work: Work, opened: SessionView, arrived: Arrived) -> tuple[Message, ...]:
    """Where the request, or the laboratory's book, says something else than the files."""
    facts, found = arrived.facts, []
    for name in ("gyro", "stand"):
        said, used = getattr(facts, name), getattr(opened, name)
        if said is not None and said != used:
            found.append(
                Message(
                    "differs",
                    "session.json names the %(what)s %(said)s; %(used)s was used.",
                    {"what": name, "said": said, "used": used},
                )
            )
    if facts.latitude_deg is not None and facts.latitude_deg != opened.latitude_deg:
        found.append(
            Message(
                "latitude-differs",
                "session.json gives the latitude %(said)g°; that of stand %(stand)s, %(used)g°, was used.",
                {"said": facts.latitude_deg, "stand": opened.stand, "used": opened.latitude_deg},
            )
        )
    ours = stands.certificate_rows(sessions.find_session(work, opened.id).certificate)
    if arrived.certificate and _sorted_csv(arrived.certificate) != _sorted_csv(ours):
        found.append(
            Message(
                "certificate-differs",
                "The certificate among the files is not certificate %(number)s of stand %(stand)s, which was "
                "used.",
                {"number": opened.certificate, "stand": opened.stand},
            )
        )
    return tuple(found)


def _sorted_csv(rows: Sequence[CertificateRow]) -> bytes:
    return write_certificate_csv(sorted(rows, key=lambda row: (row.theta_deg, row.psi_deg)))
