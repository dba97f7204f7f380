"""Whether the laboratory can work: what a load balancer and an operator ask."""

import tempfile
from collections.abc import Mapping
from typing import Final

from sqlalchemy.exc import SQLAlchemyError

from app.services.lab import Lab
from app.store.migrate import is_current

OK: Final = "ok"


def checks(lab: Lab) -> Mapping[str, str]:
    """Each part with ``ok`` or what is wrong with it."""
    return {"database": _database(lab), "data": _data_folder(lab)}


def _database(lab: Lab) -> str:
    try:
        return OK if is_current(lab.database) else "migrations are missing: run “driftbook migrate”"
    except SQLAlchemyError as error:
        return f"not reachable ({type(error).__name__})"


def _data_folder(lab: Lab) -> str:
    try:
        for folder in (lab.settings.records, lab.settings.uploads):
            with tempfile.TemporaryFile(dir=folder) as file:
                file.write(b"ready")
    except OSError as error:
        return f"cannot be written ({error.strerror})"
    return OK
