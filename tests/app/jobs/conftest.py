"""A database with DBOS's tables, a ledger on it, and an engine that works."""

import shutil
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

# The helpers of this folder, for the tests and for the child processes (which get sys.path from here).
sys.path.insert(0, str(Path(__file__).parent))

from keeping import Jobs

from app.jobs.engine import JobEngine


@pytest.fixture(scope="session")
def prepared(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A database in which an engine once started: it need not be migrated again for every test."""
    jobs = Jobs(tmp_path_factory.mktemp("jobs") / "prepared.sqlite")
    engine = JobEngine(jobs.url, jobs, slots=2, preload=("computations",))
    engine.start()
    engine.stop()
    jobs.close()
    return jobs.path


@pytest.fixture
def jobs(prepared: Path, tmp_path: Path) -> Iterator[Jobs]:
    path = tmp_path / "book.sqlite"
    shutil.copy(prepared, path)
    jobs = Jobs(path)
    yield jobs
    jobs.close()


@pytest.fixture
def engine(jobs: Jobs) -> Iterator[JobEngine]:
    engine = JobEngine(jobs.url, jobs, slots=2)
    engine.start()
    yield engine
    engine.stop(grace_s=0)
