"""Where the runs of this computer are, and which of them a command means."""

import re
from datetime import UTC, datetime
from pathlib import Path
from typing import Final

from app.errors import Conflict, problem
from app.settings import default_data_folder
from app.station.contracts import Place
from app.station.keeping.entries import Begun
from app.station.keeping.history import History
from app.station.keeping.spool import history_in

_PLAIN: Final = re.compile(r"[^A-Za-z0-9]+")


def home() -> Path:
    """Folder of the station's runs and of what it remembers: in the data folder of the user."""
    return default_data_folder() / "station"


def folder_for(gyro: str, stand: str) -> Path:
    """The newest unfinished run of a gyro on a stand, or a new folder named after both and the moment."""
    name = "-".join(_PLAIN.sub("_", part) for part in (stand, gyro))
    for folder in sorted((home() / "runs").glob(f"{name}-*"), reverse=True):
        history = history_in(folder)
        begun = history.begun
        if begun is not None and (begun.gyro, begun.stand) == (gyro, stand) and history.finished is None:
            return folder
    return home() / "runs" / f"{name}-{datetime.now(UTC):%Y%m%dT%H%M%S}"


def require_same(folder: Path, history: History, wanted: Begun, places: tuple[Place, ...]) -> None:
    """Refuse to go on with another run than the one that is meant.

    Raises
    ------
    Conflict
        The folder holds the run of another gyro or stand, or with other positions.
    """
    begun = history.begun
    if begun is None or not history.places:
        return
    if (begun.gyro, begun.stand) != (wanted.gyro, wanted.stand):
        raise Conflict(
            problem(
                "other-run",
                "%(folder)s holds a run of gyro %(gyro)s on stand %(stand)s. Go on with that one, or give another "
                "folder.",
                column="--spool",
                folder=str(folder),
                gyro=begun.gyro,
                stand=begun.stand,
            )
        )
    if places and places != history.places:
        raise Conflict(
            problem(
                "other-positions",
                "The run in %(folder)s was begun with other positions. Leave --positions out to go on with it, or "
                "give another folder.",
                column="--positions",
                folder=str(folder),
            )
        )
