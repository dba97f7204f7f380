import asyncio
import multiprocessing
import signal
import sqlite3
import threading
import time
from pathlib import Path

import pytest
import structlog
from keeping import Jobs, alive, wait_until
from sqlalchemy.orm import Session

from app.errors import Conflict
from app.jobs.engine import JobEngine, migrate
from app.jobs.tables import DBOS_TABLES


def pids(path: Path) -> list[int]:
    return [int(line) for line in path.read_text().split()] if path.exists() else []


def test_a_job_is_computed_in_a_modest_child(engine: JobEngine, jobs: Jobs) -> None:
    jobs.add(engine, "a", "double", number=21)
    assert jobs.wait("a") == "succeeded"
    output = jobs.output("a")
    assert output["doubled"] == 42
    assert output["pid"] != multiprocessing.current_process().pid
    assert output["threads"] == "1"
    assert output["interrupt_ignored"]
    assert output["niceness"] > 0
    assert jobs.attempts("a") == 1


def test_enqueued_with_the_commit(engine: JobEngine, jobs: Jobs) -> None:
    with Session(jobs.engine) as session:
        jobs.add_within(session, engine, "kept", "double", number=1)
        session.commit()
    with Session(jobs.engine) as session:
        jobs.add_within(session, engine, "dropped", "double", number=1)
        session.rollback()
    assert jobs.wait("kept") == "succeeded"
    assert jobs.rows("SELECT id FROM job") == [("kept",)]
    assert jobs.rows("SELECT workflow_uuid FROM workflow_status") == [("kept",)]


def test_not_begun_before_the_commit(engine: JobEngine, jobs: Jobs) -> None:
    with Session(jobs.engine) as session, session.begin():
        jobs.add_within(session, engine, "a", "double", number=1)
        time.sleep(0.5)  # five looks into the queue
    assert jobs.wait("a") == "succeeded"
    assert jobs.attempts("a") == 1


def test_enqueued_twice_it_is_one_job(engine: JobEngine, jobs: Jobs) -> None:
    with Session(jobs.engine) as session, session.begin():
        jobs.add_within(session, engine, "a", "double", number=1)
        engine.enqueue(session, "a")
    assert jobs.wait("a") == "succeeded"
    with Session(jobs.engine) as session, session.begin():
        engine.enqueue(session, "a")
    jobs.add(engine, "b", "double", number=1)
    assert jobs.wait("b") == "succeeded"
    assert jobs.attempts("a") == 1


def test_the_first_priority_goes_first(jobs: Jobs) -> None:
    engine = JobEngine(jobs.url, jobs, slots=1)
    engine.start(work=False)
    with Session(jobs.engine) as session, session.begin():
        for job_id, priority in (("last", 300), ("first", 1), ("usual", 100)):
            jobs.add_within(session, engine, job_id, "double", number=1, priority=priority)
    engine.stop()
    engine.start()
    for job_id in ("first", "usual", "last"):
        jobs.wait(job_id)
    engine.stop()
    assert jobs.rows("SELECT id FROM job ORDER BY begun_at") == [("first",), ("usual",), ("last",)]


def test_no_more_jobs_than_slots(engine: JobEngine, jobs: Jobs, tmp_path: Path) -> None:
    for number in range(4):
        jobs.add(engine, f"job-{number}", "wait", pids=str(tmp_path / "pids"), seconds=0.5)
    most = 0
    end = time.monotonic() + 30
    while time.monotonic() < end and jobs.rows("SELECT 1 FROM job WHERE state != 'succeeded'"):
        most = max(most, len([pid for pid in pids(tmp_path / "pids") if alive(pid)]))
        time.sleep(0.02)
    assert most == 2
    assert len(pids(tmp_path / "pids")) == 4


def test_a_foreseen_failure_keeps_its_problems(engine: JobEngine, jobs: Jobs) -> None:
    jobs.add(engine, "app", "refuse")
    jobs.add(engine, "solver", "refuse_as_solver")
    assert jobs.wait("app") == jobs.wait("solver") == "failed"
    assert jobs.problems("app") == [
        ["too-large", "currents.csv, row 3, column jx_ma: 7 is too large."],
        ["too-late", "Too late."],
    ]
    assert jobs.problems("solver") == [["unobservable", "Kx cannot be found."]]
    assert jobs.attempts("app") == 1


def test_a_crash_is_tried_again(engine: JobEngine, jobs: Jobs, tmp_path: Path) -> None:
    jobs.add(engine, "twice", "crash", count=str(tmp_path / "twice"), times=2)
    jobs.add(engine, "always", "crash", count=str(tmp_path / "always"), times=99)
    assert jobs.wait("twice") == "succeeded"
    assert jobs.attempts("twice") == 3
    assert jobs.wait("always") == "failed"
    assert jobs.attempts("always") == 3
    ((code, text),) = jobs.problems("always")
    assert code == "computation-crashed"
    assert "3 times (SIGSEGV)" in text


def test_the_ledger_gives_up_by_itself(jobs: Jobs, tmp_path: Path) -> None:
    strict = Jobs(jobs.path, max_attempts=2)
    engine = JobEngine(strict.url, strict, slots=1)
    engine.start()
    strict.add(engine, "a", "crash", count=str(tmp_path / "count"), times=99)
    assert strict.wait("a") == "failed"
    engine.stop()
    strict.close()
    assert strict.problems("a")[0][0] == "attempts-exhausted"
    assert (tmp_path / "count").read_text() == "2"


def test_cancelled_in_the_queue(jobs: Jobs) -> None:
    engine = JobEngine(jobs.url, jobs, slots=1)
    engine.start(work=False)
    jobs.add(engine, "a", "double", number=1)
    jobs.mark_cancelled("a")
    engine.cancel("a")
    engine.stop()
    engine.start()
    jobs.add(engine, "b", "double", number=1)
    assert jobs.wait("b") == "succeeded"
    engine.stop()
    assert jobs.state("a") == "cancelled"
    assert jobs.attempts("a") == 0


def test_cancelled_while_running(engine: JobEngine, jobs: Jobs, tmp_path: Path) -> None:
    jobs.add(engine, "a", "wait", pids=str(tmp_path / "pids"), seconds=60)
    wait_until(lambda: pids(tmp_path / "pids"))
    (pid,) = pids(tmp_path / "pids")
    assert alive(pid)
    jobs.mark_cancelled("a")
    engine.cancel("a")
    wait_until(lambda: not alive(pid), timeout_s=5)  # 0.1 s, and four more for a busy machine
    jobs.add(engine, "b", "double", number=1)
    assert jobs.wait("b") == "succeeded"
    assert jobs.state("a") == "cancelled"
    assert jobs.attempts("a") == 1


def test_cancelled_by_another_process(engine: JobEngine, jobs: Jobs, tmp_path: Path) -> None:
    jobs.add(engine, "a", "wait", pids=str(tmp_path / "pids"), seconds=60)
    wait_until(lambda: pids(tmp_path / "pids"))
    (pid,) = pids(tmp_path / "pids")
    elsewhere = JobEngine(jobs.url, jobs, slots=1)
    elsewhere.start(work=False)
    jobs.mark_cancelled("a")
    elsewhere.cancel("a")
    wait_until(lambda: not alive(pid), timeout_s=6)  # asked once a second
    elsewhere.stop()
    jobs.add(engine, "b", "double", number=1)
    assert jobs.wait("b") == "succeeded"


def test_too_long_a_computation_is_stopped(engine: JobEngine, jobs: Jobs, tmp_path: Path) -> None:
    jobs.add(engine, "a", "wait", timeout_s=0.5, pids=str(tmp_path / "pids"), seconds=60)
    assert jobs.wait("a") == "failed"
    ((code, text),) = jobs.problems("a")
    assert code == "computation-timeout"
    assert "longer than 0.5 s" in text
    assert not any(alive(pid) for pid in pids(tmp_path / "pids"))


def test_what_was_running_at_the_stop_is_taken_up_again(jobs: Jobs, tmp_path: Path) -> None:
    engine = JobEngine(jobs.url, jobs, slots=1)
    engine.start()
    jobs.add(engine, "a", "wait", pids=str(tmp_path / "pids"), seconds=1.5)
    wait_until(lambda: pids(tmp_path / "pids"))
    engine.stop(grace_s=0)
    (first,) = pids(tmp_path / "pids")
    assert not alive(first)
    assert jobs.state("a") == "running"
    engine.start()
    assert jobs.wait("a") == "succeeded"
    engine.stop()
    assert jobs.attempts("a") == 2


def test_the_stop_waits_for_short_jobs(jobs: Jobs, tmp_path: Path) -> None:
    engine = JobEngine(jobs.url, jobs, slots=1)
    engine.start()
    jobs.add(engine, "a", "wait", pids=str(tmp_path / "pids"), seconds=1)
    jobs.add(engine, "later", "double", number=1)
    wait_until(lambda: pids(tmp_path / "pids"))
    engine.stop(grace_s=20)
    assert jobs.state("a") == "succeeded"
    assert jobs.state("later") == "queued"
    assert jobs.rows("SELECT status FROM workflow_status ORDER BY workflow_uuid") == [
        ("SUCCESS",),
        ("ENQUEUED",),
    ]


def test_nothing_is_left_after_the_stop(jobs: Jobs, tmp_path: Path) -> None:
    threads = set(threading.enumerate())
    engine = JobEngine(jobs.url, jobs, slots=2)
    engine.start()
    jobs.add(engine, "a", "wait", pids=str(tmp_path / "pids"), seconds=60)
    jobs.add(engine, "b", "double", number=1)
    jobs.wait("b")
    wait_until(lambda: pids(tmp_path / "pids"))
    engine.stop(grace_s=0)
    wait_until(lambda: set(threading.enumerate()) <= threads, timeout_s=5)
    assert not multiprocessing.active_children()
    assert not any(alive(pid) for pid in pids(tmp_path / "pids"))
    engine.stop()  # and stopping twice is no mistake


def test_it_starts_and_stops_quickly(jobs: Jobs) -> None:
    engine = JobEngine(jobs.url, jobs, slots=1)
    start = time.monotonic()
    engine.start()
    started = time.monotonic()
    engine.stop()
    # Measured 0.1 s each on an idle machine; the tests share theirs.
    assert started - start < 2
    assert time.monotonic() - started < 3


def test_one_worker_of_a_name_on_a_database(engine: JobEngine, jobs: Jobs) -> None:
    with pytest.raises(RuntimeError, match="in this process"):
        JobEngine(jobs.url, jobs, slots=1, executor_id="other").start()
    jobs.add(engine, "a", "double", number=1)
    assert jobs.wait("a") == "succeeded"


def test_not_started_in_an_event_loop(jobs: Jobs) -> None:
    engine = JobEngine(jobs.url, jobs, slots=1)

    async def start_wrongly() -> None:
        engine.start()

    async def start_rightly() -> None:
        await asyncio.to_thread(engine.start)
        await asyncio.to_thread(engine.stop)

    with pytest.raises(RuntimeError, match="to_thread"):
        asyncio.run(start_wrongly())
    asyncio.run(start_rightly())


def test_not_used_before_the_start(jobs: Jobs) -> None:
    engine = JobEngine(jobs.url, jobs, slots=1)
    with pytest.raises(RuntimeError, match="not started"):
        engine.cancel("a")


def test_a_mistake_of_ours_gets_a_number_and_its_traceback_is_logged(engine: JobEngine, jobs: Jobs) -> None:
    with structlog.testing.capture_logs() as logged:
        jobs.add(engine, "a", "stumble")
        jobs.add(engine, "b", "return_unpickleable")
        assert jobs.wait("a") == jobs.wait("b") == "failed"
    ((code, text),) = jobs.problems("a")
    assert code == "internal-error"
    assert "ZeroDivisionError" not in text
    assert "secret" not in text
    (entry,) = [entry for entry in logged if entry.get("exception") == "ZeroDivisionError"]
    assert entry["reference"] in text
    assert "a secret of the implementation" in entry["traceback"]
    assert jobs.problems("b")[0][0] == "internal-error"


def test_nothing_to_warn_of_in_an_ordinary_day(engine: JobEngine, jobs: Jobs, tmp_path: Path) -> None:
    with structlog.testing.capture_logs() as logged:
        jobs.add(engine, "a", "double", number=1)
        jobs.add(engine, "b", "wait", pids=str(tmp_path / "pids"), seconds=60)
        wait_until(lambda: pids(tmp_path / "pids"))
        jobs.mark_cancelled("b")
        engine.cancel("b")
        jobs.wait("a")
        engine.stop()
    assert logged == []


def test_the_first_start_makes_the_tables_that_alembic_must_leave_alone(tmp_path: Path) -> None:
    jobs = Jobs(tmp_path / "new.sqlite")
    ours = {name for (name,) in jobs.rows("SELECT name FROM sqlite_master WHERE type = 'table'")}
    engine = JobEngine(jobs.url, jobs, slots=1)
    engine.start()
    jobs.add(engine, "a", "double", number=1)
    assert jobs.wait("a") == "succeeded"
    engine.stop()
    tables = {name for (name,) in jobs.rows("SELECT name FROM sqlite_master WHERE type = 'table'")}
    jobs.close()
    assert tables - ours == DBOS_TABLES


def test_enqueuing_for_a_worker_to_come(tmp_path: Path) -> None:
    jobs = Jobs(tmp_path / "new.sqlite")
    migrate(jobs.url)
    engine = JobEngine(jobs.url, jobs, slots=1)
    engine.start(work=False)
    jobs.add(engine, "a", "double", number=1)
    engine.stop()
    engine.start()
    assert jobs.wait("a") == "succeeded"
    engine.stop()
    jobs.close()


def test_a_ledger_in_trouble_costs_no_job(jobs: Jobs, monkeypatch: pytest.MonkeyPatch) -> None:
    """Its exception leaves the job to be taken up again, here by the next start."""
    engine = JobEngine(jobs.url, jobs, slots=1)
    engine.start()
    with monkeypatch.context() as patch, structlog.testing.capture_logs() as logged:

        def locked(job_id: str, output: object) -> None:
            raise sqlite3.OperationalError("database is locked")

        patch.setattr(jobs, "succeed", locked)
        jobs.add(engine, "a", "double", number=1)
        wait_until(lambda: any(entry["event"] == "job-left" for entry in logged))
        engine.stop()
    assert jobs.state("a") == "running"
    engine.start()
    assert jobs.wait("a") == "succeeded"
    engine.stop()
    assert jobs.attempts("a") == 2


def test_sigterm_to_a_child_is_a_crash_like_another(engine: JobEngine, jobs: Jobs, tmp_path: Path) -> None:
    jobs.add(engine, "a", "crash", count=str(tmp_path / "count"), times=9, signal=int(signal.SIGKILL))
    assert jobs.wait("a") == "failed"
    assert jobs.problems("a")[0][0] == "computation-killed"


def test_the_second_service_on_a_database_is_refused(engine: JobEngine, jobs: Jobs) -> None:
    second = JobEngine(jobs.url, jobs, slots=1)
    engine._working.release()  # as if it were another process
    try:
        with pytest.raises(Conflict, match=r"running on .*book\.sqlite already"):
            second.start()
    finally:
        assert engine._working.acquire(blocking=False)
