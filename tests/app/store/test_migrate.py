"""Migrations make exactly the tables that the code uses."""

from pathlib import Path

import sqlalchemy as sa
from alembic.autogenerate import compare_metadata
from alembic.migration import MigrationContext

from app.jobs.tables import DBOS_TABLES
from app.store.database import Database
from app.store.migrate import ours, upgrade
from app.store.tables import Base


def test_migrated_and_declared_tables_are_the_same(tmp_path: Path):
    database = Database(f"sqlite:///{(tmp_path / 'book.sqlite').as_posix()}")
    upgrade(database)
    upgrade(database)  # a second time changes nothing
    with database.engine.connect() as connection:
        context = MigrationContext.configure(connection, opts={"include_name": ours, "compare_type": True})
        assert compare_metadata(context, Base.metadata) == []
        assert set(Base.metadata.tables) <= set(sa.inspect(connection).get_table_names())
    database.close()


def test_the_job_engines_tables_are_left_alone():
    assert not set(DBOS_TABLES) & set(Base.metadata.tables)
    assert not any(ours(name, "table", {}) for name in DBOS_TABLES)
