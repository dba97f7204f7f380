"""Where a laboratory's data are and how the service runs: from the environment or the command line."""

import os
from dataclasses import dataclass, field
from pathlib import Path

import platformdirs


def default_data_folder() -> Path:
    """`DRIFTBOOK_DATA`, else a folder of the user's."""
    named = os.environ.get("DRIFTBOOK_DATA")
    return Path(named) if named else Path(platformdirs.user_data_dir("driftbook", appauthor=False))


def _default_workers() -> int:
    return max(1, min(4, os.cpu_count() or 1))


@dataclass(frozen=True, slots=True)
class Settings:
    """One laboratory's service.

    Attributes
    ----------
    data
        Folder of the database and the record files.
    database_url
        SQLAlchemy URL; empty means ``driftbook.sqlite`` in the data folder.
    workers
        How many jobs may compute at once.
    origin
        Public origin of the service behind a proxy (``https://lab.example``), for the check of
        cross-site requests and for secure cookies; empty when it is reached directly.
    upload_limit_bytes
        Largest request body.
    """

    data: Path = field(default_factory=default_data_folder)
    database_url: str = ""
    workers: int = field(default_factory=_default_workers)
    origin: str = field(default_factory=lambda: os.environ.get("DRIFTBOOK_ORIGIN", ""))
    upload_limit_bytes: int = 1 << 30

    @property
    def url(self) -> str:
        """The database's URL."""
        return self.database_url or f"sqlite:///{(self.data / 'driftbook.sqlite').as_posix()}"

    @property
    def records(self) -> Path:
        """Folder of the record files."""
        return self.data / "records"

    @property
    def uploads(self) -> Path:
        """Folder of uploads on their way in."""
        return self.data / "incoming"
