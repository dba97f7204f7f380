"""Bring a database up to date.

A further revision is made from the tables by
``python -m app.store.migrate "what changed"``; read it before committing it.
"""

import sys
import tempfile
from pathlib import Path

import sqlalchemy as sa
from alembic import command
from alembic.config import Config
from alembic.runtime.migration import MigrationContext
from alembic.script import ScriptDirectory

from app.store.database import Database
from app.store.tables import Base

MIGRATIONS = Path(__file__).parents[2] / "migrations"


def ours(name: str | None, kind: str, _parents: object) -> bool:
    """Whether Alembic should look at it: the job engine keeps tables of its own in the same file."""
    return kind != "table" or name in Base.metadata.tables


def upgrade(database: Database) -> None:
    """Apply every migration that the database lacks, in one transaction."""
    with database.engine.execution_options(writing=True).begin() as connection:
        command.upgrade(_config(connection), "head")


def is_current(database: Database) -> bool:
    """Whether the database has every migration that this program knows, and none beyond."""
    with database.engine.begin() as connection:
        applied = MigrationContext.configure(connection).get_current_heads()
        return set(applied) == set(ScriptDirectory.from_config(_config(connection)).get_heads())


def _config(connection: sa.Connection) -> Config:
    config = Config()
    config.set_main_option("script_location", str(MIGRATIONS))
    config.attributes["connection"] = connection
    return config


def _write_revision(message: str) -> None:
    with tempfile.TemporaryDirectory() as folder:
        database = Database(f"sqlite:///{Path(folder, 'empty.sqlite').as_posix()}")
        upgrade(database)
        with database.engine.begin() as connection:
            command.revision(_config(connection), message, autogenerate=True)
        database.close()


if __name__ == "__main__":
    _write_revision(sys.argv[1])
