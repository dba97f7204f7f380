"""A gyro with a year of results in control, and jobs of kind follow run by hand."""

import sys
from collections.abc import Callable
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))  # for `laid`: test modules are no package

from laid import TECHNICIAN, drawn, session

from app.services.computing import follow
from app.services.drift import following
from app.services.lab import Lab
from app.services.ledger import JobLedger
from app.store.tables import Job


@pytest.fixture
def history(lab: Lab) -> list[int]:
    """Twelve sessions of 0417 in control; their numbers."""
    with lab.write(TECHNICIAN) as work:
        return [session(work, number, values) for number, values in enumerate(drawn(12))]


@pytest.fixture
def follow_jobs(lab: Lab) -> Callable[[], int]:
    """Runs every queued job of kind follow through the ledger, as the engine would; how many there were."""
    ledger = JobLedger(lab)

    def run() -> int:
        ran = 0
        while waiting := _queued(lab):
            for job_id in waiting:
                task = ledger.begin(job_id)
                assert task is not None
                ledger.succeed(job_id, follow(task.payload, lambda _fraction, _phase: None))
                ran += 1
        return ran

    return run


def _queued(lab: Lab) -> list[str]:
    with lab.read(TECHNICIAN) as work:
        return [row.id for row in work.db.query(Job).filter_by(kind=following.KIND, state="queued")]
