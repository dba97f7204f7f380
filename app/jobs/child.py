"""What runs inside a child process. Imports little: every child carries it."""

import contextlib
import ctypes
import os
import signal
import sys
import threading
import time
import traceback
from collections.abc import Callable
from importlib import import_module
from multiprocessing import connection, forkserver, parent_process
from typing import Any, Final

from app.errors import AppError, problem
from solver.errors import SolverError

Report = Callable[[float, str], None]
Send = Callable[[tuple[Any, ...]], None]

_NICENESS: Final = 5
_PDEATHSIG: Final = 1
_REPORT_EVERY_S: Final = 0.1


def main(pipe: "connection.Connection[Any, Any]", function: str, payload: dict[str, Any]) -> None:
    """Compute and send ``progress``, then one of ``done``, ``failed`` and ``broken``."""
    _die_with_the_service()
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is the service's to handle
    if hasattr(os, "nice"):
        os.nice(_NICENESS)
    with pipe, contextlib.suppress(BrokenPipeError):  # a service that is gone needs no answer
        _answer(pipe.send, function, payload)


def _answer(send: Send, function: str, payload: dict[str, Any]) -> None:
    try:
        send(("done", _load(function)(payload, _reporter(send))))
    except BrokenPipeError:
        raise
    except AppError as error:
        send(("failed", tuple(error.problems)))
    except SolverError as error:
        # A Problem without a place: the solver knows no files.
        message = error.message
        send(("failed", (problem(message.code, message.template, **message.values),)))
    except BaseException as error:
        send(("broken", type(error).__name__, traceback.format_exc()))


def _load(function: str) -> Callable[[dict[str, Any], Report], dict[str, Any]]:
    import_module("app.jobs.preload")  # where there is no child server (spawn), nobody did it before
    module, _, name = function.partition(":")
    loaded: Callable[[dict[str, Any], Report], dict[str, Any]] = getattr(import_module(module), name)
    return loaded


def _reporter(send: Send) -> Report:
    """Pass progress on, a few times a second at most, but every new phase."""
    last_phase: str | None = None
    next_at = 0.0

    def report(fraction: float, phase: str) -> None:
        nonlocal last_phase, next_at
        now = time.monotonic()
        if phase != last_phase or now >= next_at:
            last_phase, next_at = phase, now + _REPORT_EVERY_S
            send(("progress", min(max(float(fraction), 0.0), 1.0), phase))

    return report


def _die_with_the_service() -> None:
    """Leave no orphan when the service is killed.

    A thread waits for the service's end, on every system. On Linux the kernel kills the child with
    the child server as well, even while C code holds the interpreter's lock; the server ends
    when the last copy of its "alive" pipe is closed, so the child gives its copy back.
    """
    parent = parent_process()
    if parent is not None:
        threading.Thread(target=_exit_after, args=(parent.sentinel,), daemon=True).start()
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(_PDEATHSIG, signal.SIGKILL)
        alive = getattr(forkserver._forkserver, "_forkserver_alive_fd", None)
        if alive is not None:
            os.close(alive)


def _exit_after(sentinel: int) -> None:
    connection.wait([sentinel])
    os._exit(1)
