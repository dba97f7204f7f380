import signal
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest
from keeping import alive, wait_until

from app.jobs.ledger import Task
from app.jobs.process import Crashed, Done, Failed, Halted, Outcome, compute


def run(function: str, keep_going: Callable[[], bool] = lambda: True, **payload: object) -> Outcome:
    return compute(
        Task(f"computations:{function}", payload), on_progress=lambda *_: None, keep_going=keep_going
    )


def test_it_returns() -> None:
    outcome = run("double", number=4)
    assert isinstance(outcome, Done)
    assert outcome.output["doubled"] == 8


def test_every_phase_is_told_and_fractions_stay_in_bounds() -> None:
    heard: list[tuple[float, str]] = []
    task = Task("computations:chatter", {"seconds": 0.3})
    compute(task, on_progress=lambda *report: heard.append(report), keep_going=lambda: True)
    assert {phase for _, phase in heard} == {"talking", "leaving"}
    assert all(0 <= fraction <= 1 for fraction, _ in heard)
    assert len(heard) <= 6  # of thousands: ten a second, the first, and the last phase


def test_halted_at_once(tmp_path: Path) -> None:
    file = tmp_path / "pids"
    start = time.monotonic()
    assert run("wait", lambda: not file.exists(), pids=str(file), seconds=60) == Halted()
    assert time.monotonic() - start < 10
    assert not alive(int(file.read_text()))


@pytest.mark.parametrize("number", [signal.SIGSEGV, signal.SIGKILL, signal.SIGABRT])
def test_its_death_is_told_by_its_signal(tmp_path: Path, number: signal.Signals) -> None:
    assert run("crash", count=str(tmp_path / "count"), times=1, signal=int(number)) == Crashed(-number)


def test_what_is_not_there_is_a_mistake_of_ours() -> None:
    for function in ("nothing_of_the_kind", "double"):  # the second lacks its number
        outcome = run(function)
        assert isinstance(outcome, Failed)
        assert [item.message.code for item in outcome.problems] == ["internal-error"]


def test_the_main_module_is_as_before() -> None:
    before = sys.modules["__main__"].__spec__
    run("double", number=1)
    assert sys.modules["__main__"].__spec__ is before


@pytest.mark.skipif(not Path("/proc/self/fd").exists(), reason="counts open files in /proc")
def test_no_file_stays_open() -> None:
    def open_files() -> int:
        return sum(1 for _ in Path("/proc/self/fd").iterdir())

    run("double", number=1)
    before = open_files()
    for _ in range(5):
        run("double", number=1)
    # The server tells the children's ends a moment later.
    wait_until(lambda: open_files() <= before, timeout_s=5)
