"""The laboratory as the layers above hold it: settings, database, record files and jobs."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from datetime import UTC, datetime
from typing import Protocol

from sqlalchemy.orm import Session

from app.settings import Settings
from app.store.database import Database
from app.store.records import RecordFiles


@dataclass(frozen=True, slots=True)
class Person:
    """Who acts: a person signed in, a token's owner, or the command line."""

    name: str
    full_name: str
    role: str
    scopes: frozenset[str]


class Queue(Protocol):
    """What services need of the job engine."""

    def enqueue(self, session: Session, job_id: str, *, priority: int = 100) -> None:
        """Put a job in the queue, in the caller's transaction."""

    def cancel(self, job_id: str) -> None:
        """Stop a job that is queued or running."""


@dataclass(slots=True)
class Work:
    """One transaction, who does it and when. `afterwards` is called once it is committed."""

    db: Session
    files: RecordFiles
    queue: Queue
    person: Person
    now: datetime = field(default_factory=lambda: datetime.now(UTC))
    afterwards: list[Callable[[], None]] = field(default_factory=list)


class Lab:
    """Gives out `Work`. A `read` changes nothing; a `write` is all or nothing.

    `stopping` says that the service is about to end: whoever follows something lets go.
    """

    def __init__(self, settings: Settings, database: Database, files: RecordFiles, queue: Queue) -> None:
        self.settings = settings
        self.database = database
        self.files = files
        self.queue = queue
        self.stopping = False

    @contextmanager
    def read(self, person: Person) -> Iterator[Work]:
        """A consistent view."""
        with self.database.read() as session:
            yield Work(session, self.files, self.queue, person)

    @contextmanager
    def write(self, person: Person) -> Iterator[Work]:
        """One transaction; committed when the block ends well."""
        with self.database.write() as session:
            work = Work(session, self.files, self.queue, person)
            yield work
        for act in work.afterwards:
            act()
