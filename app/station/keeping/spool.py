"""The station's disk: one run per folder, everything on it before it is used.

journal.jsonl           what happened, line by line (`app.station.keeping.journal`, `app.station.keeping.entries`)
attempts/000003.blocks  the samples of an acquisition as they came (`app.station.keeping.blocks`)
records/000003.parquet  the record file of a whole take, as it is sent
lock                    held while a station works on the folder
"""

import hashlib
import threading
from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path
from types import TracebackType
from typing import Final, Self

from filelock import FileLock, Timeout

from app.errors import AppError, Conflict, problem
from app.exchange.record_files import write_record_parquet
from app.exchange.rows import CurrentRecord
from app.station.contracts import Place
from app.station.keeping import durable
from app.station.keeping.blocks import BlockFile
from app.station.keeping.entries import Entry, Level, Noted, Said, from_json, to_json
from app.station.keeping.history import Attempt, History
from app.station.keeping.journal import Journal, read_journal
from solver.errors import Message

_JOURNAL: Final = "journal.jsonl"


class RecordDamaged(AppError):
    """A record file is not what was written; the take can be measured again."""


class Spool:
    """An open run's folder. Every thread of the station may `add` and read."""

    def __init__(self, folder: Path, told: Callable[[Entry, History], None] | None = None) -> None:
        """Open the folder, make it if need be, and read everything back.

        Parameters
        ----------
        told
            Hears of every entry once it is on the disk.

        Raises
        ------
        Conflict
            Another station works on it.
        SpoolFailed
            The disk cannot be written, or lost something.
        """
        self.folder = folder
        self._told = told
        durable.make_folders(folder, folder / "attempts", folder / "records")
        self._lock_file = FileLock(folder / "lock", thread_local=False)
        _take(self._lock_file, folder)
        try:
            self._journal = Journal(folder / _JOURNAL)
            self.history = History()
            for said in self._journal.entries:
                self.history.apply(*from_json(said))
        except BaseException:
            self._lock_file.release()
            raise
        self.lock = threading.RLock()
        """Hold it while reading `history` from a thread that is not alone."""
        self.news = threading.Event()
        """Set by every entry; whoever waits for entries clears it."""

    def add(self, entry: Entry) -> None:
        """Write an entry; when this returns it is on the disk and in `history`."""
        with self.lock:
            at = datetime.now(UTC)
            self._journal.append(to_json(at, entry))
            self.history.apply(at, entry)
            self.news.set()
            if self._told is not None:
                self._told(entry, self.history)

    def note(self, level: Level, message: Message, place: Place | None = None) -> None:
        """Write what a person should know."""
        self.add(Noted(level, Said.of(message), place))

    def blocks(self, attempt: int) -> BlockFile:
        """The samples of an acquisition, to read and to append."""
        return BlockFile(self.folder / "attempts" / f"{attempt:06d}.blocks")

    def keep_record(self, attempt: Attempt, blocks: BlockFile) -> tuple[CurrentRecord, str]:
        """Write the record file of a whole acquisition; give the record and the file's SHA-256.

        Written again, it has the same bytes.
        """
        begun, target = self.history.begun, attempt.target
        record = CurrentRecord(
            target.theta_deg, target.psi_deg, *blocks.columns(), repeat=target.repeat,
            started_at=attempt.acquiring.started_at if attempt.acquiring else None,
            temperature_c=begun.temperature_c if begun else None,
        )  # fmt: skip
        content = write_record_parquet(record)
        durable.write_whole(self._record(attempt.number), content)
        return record, hashlib.sha256(content).hexdigest()

    def record(self, attempt: Attempt) -> bytes:
        """The bytes of a judged take's record file, checked against the journal.

        Raises
        ------
        RecordDamaged
            The file is not what was written.
        SpoolFailed
            It cannot be read.
        """
        judged = attempt.judged
        path = self._record(attempt.number)
        content = durable.read_whole(path) if path.exists() else b""
        if judged is None or hashlib.sha256(content).hexdigest() != judged.digest:
            raise RecordDamaged(
                problem(
                    "record-damaged",
                    "%(path)s does not hold what was written to it: the disk is damaged. This position is "
                    "measured again.",
                    path=str(path),
                )
            )
        return content

    def close(self) -> None:
        """Close the files and let the next station have the folder."""
        self._journal.close()
        self._lock_file.release()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def _record(self, attempt: int) -> Path:
        return self.folder / "records" / f"{attempt:06d}.parquet"


def history_in(folder: Path) -> History:
    """What a folder's journal says, without touching it; that of a run that never began when there is none."""
    history = History()
    for said in read_journal(folder / _JOURNAL)[0]:
        history.apply(*from_json(said))
    return history


def _take(lock: FileLock, folder: Path) -> None:
    try:
        lock.acquire(blocking=False)
    except Timeout:
        raise Conflict(
            problem(
                "spool-in-use",
                "Another station works on %(folder)s. Let it finish, or give this one a folder of its own.",
                file="--spool",
                folder=str(folder),
            )
        ) from None
