import sqlite3
import time
from pathlib import Path

import pytest
import sqlalchemy as sa

from app.jobs import database


@pytest.fixture
def url(tmp_path: Path) -> str:
    return f"sqlite:///{(tmp_path / 'book.sqlite').as_posix()}"


def test_an_acknowledged_commit_survives_a_power_cut(url: str) -> None:
    engine = database.make_engine(url)
    with engine.connect() as connection:
        pragmas = {
            name: connection.exec_driver_sql(f"PRAGMA {name}").scalar_one()
            for name in ("journal_mode", "synchronous", "busy_timeout", "foreign_keys")
        }
    engine.dispose()
    # 2 is FULL (https://sqlite.org/pragma.html#pragma_synchronous)
    assert pragmas == {"journal_mode": "wal", "synchronous": 2, "busy_timeout": 30000, "foreign_keys": 1}


def test_memory_is_refused() -> None:
    with pytest.raises(ValueError, match="in a file"):
        database.make_engine("sqlite://")


def seconds_now(connection: sa.Connection) -> float | None:
    value: float | None = connection.exec_driver_sql("SELECT unixepoch('subsec')").scalar()
    return value


def test_dbos_may_ask_for_fractions_of_a_second(url: str) -> None:
    engine = database.make_engine(url)
    with engine.connect() as connection:
        # It is the same clock, read twice.
        assert seconds_now(connection) == pytest.approx(time.time(), abs=5)
    engine.dispose()


def test_on_a_connection_of_somebody_else_too(url: str) -> None:
    engine = sa.create_engine(url)
    with engine.connect() as connection:
        for _ in range(2):
            database.provide_unixepoch(connection)
            assert seconds_now(connection) == pytest.approx(time.time(), abs=5)
        # The other calls of the function are SQLite's own, if it has them (3.38).
        if sqlite3.sqlite_version_info >= (3, 38):
            assert connection.exec_driver_sql("SELECT unixepoch('1970-01-02', '+1 day')").scalar() == 172800
    engine.dispose()


@pytest.mark.skipif(sqlite3.sqlite_version_info >= (3, 42), reason="SQLite knows it by itself")
def test_nothing_else_is_made_up(url: str) -> None:
    engine = database.make_engine(url)
    with engine.connect() as connection, pytest.raises(sa.exc.OperationalError):
        connection.exec_driver_sql("SELECT unixepoch('1970-01-02')")
    engine.dispose()
