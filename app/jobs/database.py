"""DBOS's own engine on our database.

DBOS neither switches SQLite to WAL nor asks for `synchronous=FULL`, and begins transactions in the
driver's way, so it gets an engine of its own instead of sharing the store's.
"""

import sqlite3
import time
from collections.abc import Callable
from typing import Any, Final

import sqlalchemy as sa
from sqlalchemy import event

_PRAGMAS: Final = ("busy_timeout=30000", "journal_mode=WAL", "synchronous=FULL", "foreign_keys=ON")
_SUBSEC_SINCE: Final = (3, 42)
_PROVIDED: Final = "driftbook.unixepoch"


def make_engine(url: str) -> sa.Engine:
    """Open the database for DBOS."""
    if not url.startswith("sqlite"):
        return sa.create_engine(url, pool_pre_ping=True, pool_size=10, max_overflow=10)
    if sa.make_url(url).database in (None, "", ":memory:"):
        raise ValueError("jobs need a database in a file: a database in memory does not outlive its process")
    engine = sa.create_engine(url, pool_size=10, max_overflow=10)
    event.listen(engine, "connect", _prepare_sqlite)
    return engine


def _prepare_sqlite(connection: sqlite3.Connection, _record: Any) -> None:
    connection.isolation_level = "IMMEDIATE"
    for pragma in _PRAGMAS:
        connection.execute(f"PRAGMA {pragma}").close()
    _define_unixepoch(connection)


def provide_unixepoch(connection: sa.Connection) -> None:
    """Make DBOS's statements work on a connection of somebody else's (once per connection).

    On Python ≥ 3.12 DBOS writes ``unixepoch('subsec')`` into its statements and into its tables'
    defaults whatever SQLite it meets, and SQLite knows the modifier only since 3.42.
    """
    if connection.dialect.name == "sqlite" and not connection.info.get(_PROVIDED):
        driver = connection.connection.dbapi_connection
        assert isinstance(driver, sqlite3.Connection)
        _define_unixepoch(driver)
        connection.info[_PROVIDED] = True


def _define_unixepoch(connection: sqlite3.Connection) -> None:
    if sqlite3.sqlite_version_info < _SUBSEC_SINCE:
        # Of one argument only: the built-in function keeps every other call.
        connection.create_function("unixepoch", 1, _unixepoch)


def _unixepoch(modifier: object, clock: Callable[[], float] = time.time) -> float:
    if modifier not in ("subsec", "subsecond"):
        raise ValueError("only unixepoch('subsec') is defined on this SQLite")
    return clock()
