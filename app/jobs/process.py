"""One computation in a child process that can be stopped at any moment."""

import contextlib
import multiprocessing
import secrets
import sys
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from importlib.machinery import ModuleSpec
from multiprocessing import forkserver
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from typing import Any, Final

import structlog

from app.errors import Problem
from app.jobs import child
from app.jobs.ledger import Task
from app.jobs.problems import internal_error, timed_out

_LOOK_EVERY_S: Final = 0.1
# Without a fork server (Windows) every child starts an interpreter of its own.
_SERVED: Final = "forkserver" in multiprocessing.get_all_start_methods()
_log = structlog.get_logger(__name__)
_starting = threading.Lock()


@dataclass(frozen=True)
class Done:
    """It returned."""

    output: dict[str, Any]


@dataclass(frozen=True)
class Failed:
    """It cannot be computed, for these reasons."""

    problems: Sequence[Problem]


@dataclass(frozen=True)
class Crashed:
    """The process died of itself; a negative code is the signal that killed it."""

    exit_code: int


@dataclass(frozen=True)
class Halted:
    """We stopped it."""


Outcome = Done | Failed | Crashed | Halted


def warm(preload: Sequence[str] = ()) -> None:
    """Start the child server, so that the first job need not wait for its imports.

    The server lives until this process ends. It is asked to start again whenever it is needed, so
    its death costs the jobs running at that moment one attempt.

    Parameters
    ----------
    preload
        Modules every child is born with; they may start no threads.
    """
    if _SERVED:
        multiprocessing.get_context("forkserver").set_forkserver_preload(
            ["app.jobs.preload", "app.jobs.child", *preload]
        )
        forkserver.ensure_running()


def compute(
    task: Task, *, on_progress: Callable[[float, str], None], keep_going: Callable[[], bool]
) -> Outcome:
    """Run the task in a child and wait for its end.

    Parameters
    ----------
    on_progress
        Gets every report of the child's.
    keep_going
        Asked ten times a second; when it says no, the child is killed.
    """
    try:
        process, reader = _start(task)
    except OSError:
        _log.exception("child-not-started")
        return Crashed(1)
    try:
        return _watch(process, reader, task.timeout_s, on_progress, keep_going)
    finally:
        if process.is_alive():
            process.kill()
        process.join()
        process.close()
        reader.close()


def _start(task: Task) -> "tuple[BaseProcess, Connection[Any, Any]]":
    context = multiprocessing.get_context("forkserver") if _SERVED else multiprocessing.get_context("spawn")
    reader, writer = context.Pipe(duplex=False)
    process = context.Process(
        target=child.main, args=(writer, task.function, task.payload), daemon=True, name="driftbook-job"
    )
    try:
        with writer, _main_module_left_alone():
            process.start()
    except BaseException:
        reader.close()
        raise
    return process, reader


def _watch(
    process: BaseProcess,
    reader: "Connection[Any, Any]",
    timeout_s: float,
    on_progress: Callable[[float, str], None],
    keep_going: Callable[[], bool],
) -> Outcome:
    deadline = time.monotonic() + timeout_s
    while keep_going():
        if time.monotonic() > deadline:
            return Failed((timed_out(timeout_s),))
        if not reader.poll(_LOOK_EVERY_S):
            continue
        try:
            kind, *content = reader.recv()
        except (EOFError, OSError):
            process.join()
            return Crashed(process.exitcode or 0)
        if kind == "progress":
            on_progress(*content)
        else:
            return _ended(kind, content)
    return Halted()


def _ended(kind: str, content: list[Any]) -> Outcome:
    if kind == "done":
        return Done(content[0])
    if kind == "failed":
        return Failed(content[0])
    exception, trace = content
    reference = secrets.token_hex(4)
    _log.error("job-broke", reference=reference, exception=exception, traceback=trace)
    return Failed((internal_error(reference),))


@contextlib.contextmanager
def _main_module_left_alone() -> Iterator[None]:
    """Keep multiprocessing from running the program's main script in every child.

    It does so for functions defined there, which a task never names; for the command's script that
    would mean to import the whole service for each job. A main module called ``….__main__`` is
    exempt, so for the moment of the start ours bears such a name.
    """
    main = sys.modules["__main__"]
    with _starting:
        spec, main.__spec__ = main.__spec__, ModuleSpec("driftbook.__main__", None)
        try:
            yield
        finally:
            main.__spec__ = spec
