"""A service killed without warning."""

import random
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

import pytest
from keeping import Jobs, alive, wait_until

from app.jobs.engine import JobEngine


@contextmanager
def worker(jobs: Jobs, name: str = "embedded") -> Iterator[subprocess.Popen[str]]:
    """A service in a process of its own, ready to work; killed in the end."""
    with subprocess.Popen(
        [sys.executable, str(Path(__file__).with_name("worker.py")), str(jobs.path), name],
        stdout=subprocess.PIPE,
        text=True,
    ) as process:
        try:
            assert process.stdout is not None
            assert process.stdout.readline() == "ready\n"
            yield process
        finally:
            process.send_signal(signal.SIGKILL)


@pytest.fixture
def store(jobs: Jobs) -> Iterator[JobEngine]:
    """Enqueues, as a service would, without working."""
    engine = JobEngine(jobs.url, jobs, slots=1)
    engine.start(work=False)
    yield engine
    engine.stop()


def pids(path: Path) -> list[int]:
    return [int(line) for line in path.read_text().split()] if path.exists() else []


def test_killed_in_the_middle_nothing_is_lost(store: JobEngine, jobs: Jobs, tmp_path: Path) -> None:
    names = [f"job-{number}" for number in range(4)]
    for name in names:  # two will be running, two waiting
        jobs.add(store, name, "wait", pids=str(tmp_path / "pids"), seconds=1)
    with worker(jobs):
        wait_until(lambda: len(pids(tmp_path / "pids")) == 2)
    interrupted = pids(tmp_path / "pids")
    wait_until(lambda: not any(alive(pid) for pid in interrupted), timeout_s=5)
    assert [jobs.state(name) for name in names].count("running") == 2
    with worker(jobs):
        assert [jobs.wait(name) for name in names] == ["succeeded"] * 4
    assert sorted(jobs.attempts(name) for name in names) == [1, 1, 2, 2]
    assert len(jobs.rows("SELECT * FROM succeeded")) == 4


@pytest.mark.skipif(sys.platform != "linux", reason="only Linux kills a child with its parent")
def test_no_orphan_even_if_it_never_lets_go_of_the_interpreter(
    store: JobEngine, jobs: Jobs, tmp_path: Path
) -> None:
    jobs.add(store, "a", "hold_the_interpreter", pids=str(tmp_path / "pids"))
    with worker(jobs):
        wait_until(lambda: pids(tmp_path / "pids"))
        (pid,) = pids(tmp_path / "pids")
        assert alive(pid)
    wait_until(lambda: not alive(pid), timeout_s=5)


def test_two_workers_share_the_queue_and_leave_each_other_alone(
    store: JobEngine, jobs: Jobs, tmp_path: Path
) -> None:
    names = ["first", *(f"job-{number}" for number in range(5))]
    with worker(jobs, "one"):
        jobs.add(store, "first", "wait", pids=str(tmp_path / "pids"), seconds=6)
        jobs.wait("first", "running")
        with worker(jobs, "two"):  # starts while the other computes, and takes nothing away from it
            for name in names[1:]:
                jobs.add(store, name, "wait", pids=str(tmp_path / "pids"), seconds=0.5)
            assert [jobs.wait(name) for name in names] == ["succeeded"] * 6
            workers = {name for (name,) in jobs.rows("SELECT executor_id FROM workflow_status")}
    assert workers == {"one", "two"}
    assert [jobs.attempts(name) for name in names] == [1] * 6


def test_two_workers_of_one_name_do_not(jobs: Jobs) -> None:
    with worker(jobs):
        second = subprocess.run(
            [sys.executable, str(Path(__file__).with_name("worker.py")), str(jobs.path), "embedded"],
            capture_output=True,
            text=True,
            timeout=60,
            check=False,
        )
    assert second.returncode == 1
    assert "Driftbook is running on" in second.stderr


@pytest.mark.chaos
def test_killed_twelve_times_at_random_moments(store: JobEngine, tmp_path: Path, jobs: Jobs) -> None:
    """Every job ends, each result is stored once; the seed fixes the moments, not what they hit."""
    moments = random.Random(20240711)
    patient = Jobs(jobs.path, max_attempts=10**6)
    names = []
    for round_ in range(12):
        with ExitStack() as running:
            running.enter_context(worker(patient))
            for number in range(2):
                names.append(f"job-{round_}-{number}")
                patient.add(store, names[-1], "wait", pids=str(tmp_path / "pids"), seconds=0.3)
            time.sleep(moments.uniform(0, 1))
    unfinished = "SELECT * FROM workflow_status WHERE status != 'SUCCESS'"
    with worker(patient):
        assert [patient.wait(name, timeout_s=120) for name in names] == ["succeeded"] * 24
        # The engine notes the end of a job after the job's own row says it.
        wait_until(lambda: not patient.rows(unfinished), timeout_s=30)
    patient.close()
    assert len(patient.rows("SELECT * FROM succeeded")) == 24
    assert not patient.rows(unfinished)
