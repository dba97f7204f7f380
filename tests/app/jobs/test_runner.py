import time
from itertools import pairwise
from pathlib import Path

import pytest
import structlog
from keeping import Jobs, wait_until

from app.jobs.engine import JobEngine
from app.jobs.runner import Run, Runs


def test_progress_twice_a_second_and_the_last_is_not_lost(jobs: Jobs, engine: JobEngine) -> None:
    jobs.add(engine, "a", "chatter", seconds=2)
    assert jobs.wait("a") == "succeeded"
    noted = jobs.rows("SELECT at, fraction, phase FROM progress ORDER BY at")
    times = [at for at, _, _ in noted]
    # 2 s of talk and 0.8 s of silence hold 6 periods of 0.5 s; a slow machine makes them fewer.
    assert 3 <= len(noted) <= 7
    # The clock in use is not the one that measures the period: a tenth for the difference.
    assert all(later - earlier > 0.45 for earlier, later in pairwise(times))
    assert [fraction for _, fraction, _ in noted] == sorted(fraction for _, fraction, _ in noted)
    assert noted[-1][1:] == (1.0, "leaving")


def test_progress_that_cannot_be_noted_stops_nothing(
    jobs: Jobs, engine: JobEngine, monkeypatch: pytest.MonkeyPatch
) -> None:
    def broken(job_id: str, fraction: float, phase: str) -> None:
        raise OSError("no database today")

    monkeypatch.setattr(jobs, "progress", broken)
    with structlog.testing.capture_logs() as logged:
        jobs.add(engine, "a", "chatter", seconds=0.1)
        assert jobs.wait("a") == "succeeded"
    assert "job-progress" in {entry["event"] for entry in logged}


def test_a_job_already_over_is_not_computed(jobs: Jobs) -> None:
    Run("unknown", jobs, lambda _: False).execute()
    assert jobs.rows("SELECT * FROM job") == []


def test_the_same_job_runs_once_at_a_time(jobs: Jobs) -> None:
    runs = Runs()
    first, second = Run("a", jobs, lambda _: False), Run("a", jobs, lambda _: False)
    assert runs.enter(first)
    assert not runs.enter(second)
    assert runs.get("a") is first
    assert not runs.wait_until_none(0.01)
    runs.leave(first)
    assert runs.get("a") is None
    assert runs.wait_until_none(0.01)


def test_picked_up_soon(jobs: Jobs, engine: JobEngine, tmp_path: Path) -> None:
    jobs.add(engine, "warm", "double", number=1)
    jobs.wait("warm")
    start = time.monotonic()
    jobs.add(engine, "a", "wait", pids=str(tmp_path / "pids"), seconds=0)
    wait_until(lambda: (tmp_path / "pids").exists())
    # A look every 0.1 s and 0.02 s for the child, measured; ten times as much for a busy machine.
    assert time.monotonic() - start < 1.2
