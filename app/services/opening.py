"""Opening a laboratory's data folder."""

from collections.abc import Iterator
from contextlib import contextmanager

from sqlalchemy.orm import Session

from app.services.lab import Lab, Queue
from app.settings import Settings
from app.store.database import Database
from app.store.migrate import upgrade
from app.store.records import RecordFiles


class _NoQueue:
    """For commands that run no jobs: asking for one is a mistake of the program."""

    def enqueue(self, session: Session, job_id: str, *, priority: int = 100) -> None:
        raise RuntimeError("no job engine runs here")

    def cancel(self, job_id: str) -> None:
        raise RuntimeError("no job engine runs here")


@contextmanager
def open_lab(settings: Settings, queue: Queue | None = None) -> Iterator[Lab]:
    """The laboratory in the data folder, which is made and brought up to date when it has to be."""
    settings.records.mkdir(parents=True, exist_ok=True)
    settings.uploads.mkdir(parents=True, exist_ok=True)
    database = Database(settings.url)
    try:
        upgrade(database)
        yield Lab(settings, database, RecordFiles(settings.records), queue or _NoQueue())
    finally:
        database.close()
