"""Finding what people name: a gyro by its serial number."""

from app.errors import NotFound, problem
from app.services.lab import Work
from app.store import equipment
from app.store.tables import Gyro


def find_gyro(work: Work, serial: str) -> Gyro:
    """The gyro's row, or `NotFound`."""
    row = equipment.gyro(work.db, serial)
    if row is None:
        raise NotFound(problem("unknown-gyro", "There is no gyro %(serial)s. Register it first.",
                               column="gyro", serial=serial))  # fmt: skip
    return row
