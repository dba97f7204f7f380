"""A ledger of the tests' own: one table in SQLite, by the driver alone."""

import json
import sqlite3
import time
from collections.abc import Iterator, Sequence
from contextlib import closing, contextmanager
from pathlib import Path
from typing import Any

import sqlalchemy as sa
from sqlalchemy import event
from sqlalchemy.orm import Session

from app.errors import Problem
from app.jobs.engine import JobEngine, Task
from app.jobs.problems import given_up

ENDED = ("succeeded", "failed", "cancelled")
_SCHEMA = """
CREATE TABLE IF NOT EXISTS job (
    id TEXT PRIMARY KEY, function TEXT, payload TEXT, timeout_s REAL, state TEXT DEFAULT 'queued',
    attempts INTEGER DEFAULT 0, output TEXT, problems TEXT, begun_at REAL
);
CREATE TABLE IF NOT EXISTS progress (job TEXT, at REAL, fraction REAL, phase TEXT);
CREATE TABLE IF NOT EXISTS succeeded (job TEXT);
"""


class Jobs:
    """The ledger, and a store that enqueues."""

    def __init__(self, path: Path, max_attempts: int = 10) -> None:
        self.path = path
        self.url = f"sqlite:///{path.as_posix()}"
        self._max_attempts = max_attempts
        with self._connect() as connection:
            connection.executescript(_SCHEMA)
        self.engine = sa.create_engine(self.url)
        event.listen(self.engine, "connect", lambda raw, _: setattr(raw, "isolation_level", None))
        event.listen(self.engine, "begin", lambda connection: connection.exec_driver_sql("BEGIN IMMEDIATE"))

    def close(self) -> None:
        self.engine.dispose()

    @contextmanager
    def _connect(self) -> Iterator[sqlite3.Connection]:
        with closing(sqlite3.connect(self.path, timeout=30)) as connection:
            connection.execute("PRAGMA journal_mode=WAL").close()
            with connection:
                yield connection

    def begin(self, job_id: str) -> Task | None:
        with self._connect() as connection:
            row = connection.execute(
                "UPDATE job SET state = 'running', attempts = attempts + 1, begun_at = ? "
                "WHERE id = ? AND state IN ('queued', 'running') "
                "RETURNING function, payload, timeout_s, attempts",
                (time.time(), job_id),
            ).fetchone()
        if row is None:
            return None
        function, payload, timeout_s, attempts = row
        if attempts > self._max_attempts:
            self.fail(job_id, [given_up(self._max_attempts)])
            return None
        return Task(function, json.loads(payload), timeout_s)

    def progress(self, job_id: str, fraction: float, phase: str) -> None:
        with self._connect() as connection:
            connection.execute(
                "INSERT INTO progress VALUES (?, ?, ?, ?)", (job_id, time.time(), fraction, phase)
            )

    def succeed(self, job_id: str, output: dict[str, Any]) -> None:
        with self._connect() as connection:
            done = connection.execute(
                "UPDATE job SET state = 'succeeded', output = ? WHERE id = ? AND state = 'running'",
                (json.dumps(output), job_id),
            )
            if done.rowcount:
                connection.execute("INSERT INTO succeeded VALUES (?)", (job_id,))

    def fail(self, job_id: str, problems: Sequence[Problem]) -> None:
        told = json.dumps([[item.message.code, item.text] for item in problems])
        with self._connect() as connection:
            connection.execute(
                "UPDATE job SET state = 'failed', problems = ? "
                "WHERE id = ? AND state IN ('queued', 'running')",
                (told, job_id),
            )

    # What a service does -------------------------------------------------------------------------

    def add(
        self, engine: JobEngine, job_id: str, function: str, *, timeout_s: float = 60, **payload: Any
    ) -> str:
        """Store a job and enqueue it, in one transaction."""
        with Session(self.engine) as session, session.begin():
            self.add_within(session, engine, job_id, function, timeout_s=timeout_s, **payload)
        return job_id

    def add_within(
        self,
        session: Session,
        engine: JobEngine,
        job_id: str,
        function: str,
        *,
        timeout_s: float = 60,
        priority: int = 100,
        **payload: Any,
    ) -> None:
        session.execute(
            sa.text(
                "INSERT INTO job (id, function, payload, timeout_s) VALUES (:id, :function, :payload, :s)"
            ),
            {
                "id": job_id,
                "function": f"computations:{function}",
                "payload": json.dumps(payload),
                "s": timeout_s,
            },
        )
        engine.enqueue(session, job_id, priority=priority)

    def mark_cancelled(self, job_id: str) -> None:
        with self._connect() as connection:
            connection.execute("UPDATE job SET state = 'cancelled' WHERE id = ?", (job_id,))

    # What a test asks ----------------------------------------------------------------------------

    def rows(self, statement: str, *values: Any) -> list[Any]:
        with self._connect() as connection:
            return connection.execute(statement, values).fetchall()

    def state(self, job_id: str) -> str:
        ((state,),) = self.rows("SELECT state FROM job WHERE id = ?", job_id)
        return str(state)

    def attempts(self, job_id: str) -> int:
        ((attempts,),) = self.rows("SELECT attempts FROM job WHERE id = ?", job_id)
        return int(attempts)

    def output(self, job_id: str) -> dict[str, Any]:
        ((output,),) = self.rows("SELECT output FROM job WHERE id = ? AND state = 'succeeded'", job_id)
        loaded: dict[str, Any] = json.loads(output)
        return loaded

    def problems(self, job_id: str) -> list[list[str]]:
        ((problems,),) = self.rows("SELECT problems FROM job WHERE id = ? AND state = 'failed'", job_id)
        loaded: list[list[str]] = json.loads(problems)
        return loaded

    def wait(self, job_id: str, *states: str, timeout_s: float = 30) -> str:
        """Wait for one of the states, by default for the job's end; the state."""
        wait_until(lambda: self.state(job_id) in (states or ENDED), timeout_s)
        return self.state(job_id)


def wait_until(true: Any, timeout_s: float = 30) -> None:
    """Wait for something; a machine that is busy with other things may take long."""
    end = time.monotonic() + timeout_s
    while not true():
        assert time.monotonic() < end, "waited in vain"
        time.sleep(0.02)


def alive(pid: int) -> bool:
    """Whether the process is there and not merely waiting for its parent to notice its end."""
    try:
        status = Path(f"/proc/{pid}/stat").read_text()
    except FileNotFoundError:
        return False
    return status.rpartition(")")[2].split()[0] not in "ZX"
