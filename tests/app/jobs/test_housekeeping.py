from collections.abc import Iterator
from datetime import timedelta

import pytest
import structlog
from dbos import DBOSClient
from keeping import Jobs, wait_until

from app.jobs.database import make_engine
from app.jobs.engine import JobEngine
from app.jobs.housekeeping import Housekeeper

HOUR_MS = 3_600_000


@pytest.fixture
def queued(jobs: Jobs) -> Jobs:
    """Three jobs in the queue and nobody working."""
    engine = JobEngine(jobs.url, jobs, slots=1)
    engine.start(work=False)
    for name in ("a", "b", "c"):
        jobs.add(engine, name, "double", number=1)
    engine.stop()
    return jobs


@pytest.fixture
def client(queued: Jobs) -> Iterator[DBOSClient]:
    engine = make_engine(queued.url)
    client = DBOSClient(system_database_engine=engine, application_name="driftbook")
    yield client
    client.destroy()
    engine.dispose()


def keeper(client: DBOSClient, jobs: Jobs, every_s: float = 60) -> Housekeeper:
    return Housekeeper(
        client,
        jobs,
        queue="driftbook-jobs",
        executor_id="embedded",
        is_running=lambda job_id: job_id == "b",
        every_s=every_s,
        keep=timedelta(hours=1),
    )


@pytest.fixture
def housekeeper(client: DBOSClient, queued: Jobs) -> Housekeeper:
    return keeper(client, queued)


def flows(jobs: Jobs) -> dict[str, str]:
    return dict(jobs.rows("SELECT workflow_uuid, status FROM workflow_status"))


def make(jobs: Jobs, name: str, status: str, age_ms: int, executor: str = "embedded") -> None:
    jobs.rows(
        "UPDATE workflow_status SET status = ?, executor_id = ?, updated_at = created_at - ?, "
        "completed_at = created_at - ? WHERE workflow_uuid = ? RETURNING 1",
        *(status, executor, age_ms, age_ms, name),
    )


def test_old_rows_go_and_new_ones_stay(housekeeper: Housekeeper, queued: Jobs) -> None:
    make(queued, "a", "SUCCESS", 2 * HOUR_MS)
    make(queued, "b", "SUCCESS", HOUR_MS // 2)
    housekeeper.delete_old()
    assert flows(queued) == {"b": "SUCCESS", "c": "ENQUEUED"}
    assert queued.rows("SELECT workflow_uuid FROM workflow_input ORDER BY 1") == [("b",), ("c",)]


def test_what_nobody_works_on_is_queued_again(housekeeper: Housekeeper, queued: Jobs) -> None:
    make(queued, "a", "PENDING", HOUR_MS)
    make(queued, "b", "PENDING", HOUR_MS)  # it runs, see the fixture
    make(queued, "c", "PENDING", HOUR_MS, executor="another")
    housekeeper.requeue_stranded()
    assert flows(queued) == {"a": "ENQUEUED", "b": "PENDING", "c": "PENDING"}


def test_what_was_just_taken_is_not(housekeeper: Housekeeper, queued: Jobs) -> None:
    make(queued, "a", "PENDING", 0)
    housekeeper.requeue_stranded()
    assert flows(queued)["a"] == "PENDING"


def test_what_dbos_gave_up_fails(housekeeper: Housekeeper, queued: Jobs) -> None:
    make(queued, "a", "MAX_RECOVERY_ATTEMPTS_EXCEEDED", 0)
    housekeeper.fail_given_up()
    assert queued.problems("a")[0][0] == "attempts-exhausted"
    assert flows(queued) == {"b": "ENQUEUED", "c": "ENQUEUED"}


def test_round_after_round(client: DBOSClient, queued: Jobs) -> None:
    housekeeper = keeper(client, queued, every_s=0.2)
    housekeeper.start()
    for name in ("a", "c"):
        make(queued, name, "PENDING", HOUR_MS)
        wait_until(lambda name=name: flows(queued)[name] == "ENQUEUED")
    make(queued, "b", "SUCCESS", 2 * HOUR_MS)
    wait_until(lambda: "b" not in flows(queued))
    housekeeper.stop()


def test_trouble_ends_no_round(client: DBOSClient, queued: Jobs, monkeypatch: pytest.MonkeyPatch) -> None:
    def away() -> None:
        raise OSError("no database today")

    housekeeper = keeper(client, queued, every_s=0.05)
    monkeypatch.setattr(away, "__name__", "fail_given_up")
    monkeypatch.setattr(housekeeper, "fail_given_up", away)
    make(queued, "a", "SUCCESS", 2 * HOUR_MS)
    with structlog.testing.capture_logs() as logged:
        housekeeper.start()
        wait_until(lambda: "a" not in flows(queued) and len(logged) > 1)
        housekeeper.stop()
    assert {entry["event"] for entry in logged} == {"jobs-housekeeping"}
