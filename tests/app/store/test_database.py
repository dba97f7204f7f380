"""Transactions: all or nothing, and a writer waits for the writer before it."""

import threading
from pathlib import Path

import pytest
import sqlalchemy as sa

from app.store.database import Database


@pytest.fixture
def database(tmp_path: Path):
    database = Database(f"sqlite:///{(tmp_path / 'book.sqlite').as_posix()}")
    with database.write() as session:
        session.execute(sa.text("CREATE TABLE count (n INTEGER)"))
        session.execute(sa.text("INSERT INTO count VALUES (0)"))
    yield database
    database.close()


def value(database: Database) -> int:
    with database.read() as session:
        return session.execute(sa.text("SELECT n FROM count")).scalar_one()


def test_a_committed_write_survives_a_power_cut_by_its_pragmas(database):
    with database.read() as session:
        pragma = {
            name: session.execute(sa.text(f"PRAGMA {name}")).scalar_one()
            for name in ("journal_mode", "synchronous", "foreign_keys", "busy_timeout")
        }
    # sqlite.org/pragma.html: synchronous 2 is FULL.
    assert pragma == {"journal_mode": "wal", "synchronous": 2, "foreign_keys": 1, "busy_timeout": 30000}


def test_an_exception_undoes_everything_even_a_new_table(database):
    def fail_half_way() -> None:
        with database.write() as session:
            session.execute(sa.text("UPDATE count SET n = 5"))
            session.execute(sa.text("CREATE TABLE other (n INTEGER)"))
            raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        fail_half_way()
    assert value(database) == 0
    with database.read() as session:
        assert session.execute(sa.text("SELECT name FROM sqlite_master WHERE name = 'other'")).all() == []


def test_increments_of_many_threads_are_all_counted(database):
    """Read, then write: without BEGIN IMMEDIATE two threads read the same number and one is lost."""

    def count() -> None:
        for _ in range(10):
            with database.write() as session:
                n = session.execute(sa.text("SELECT n FROM count")).scalar_one()
                session.execute(sa.text("UPDATE count SET n = :n"), {"n": n + 1})

    threads = [threading.Thread(target=count) for _ in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert value(database) == 80


def test_a_reader_sees_one_moment_while_others_write(database):
    with database.read() as session:
        before = session.execute(sa.text("SELECT n FROM count")).scalar_one()
        with database.write() as other:
            other.execute(sa.text("UPDATE count SET n = 7"))
        assert session.execute(sa.text("SELECT n FROM count")).scalar_one() == before
    assert value(database) == 7


def test_reading_changes_nothing(database):
    with database.read() as session:
        session.execute(sa.text("UPDATE count SET n = 9"))
    assert value(database) == 0
