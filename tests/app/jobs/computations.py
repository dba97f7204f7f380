"""What the children of these tests compute; the children import it by its name."""

import os
import signal
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from app.errors import Invalid, problem
from solver.errors import InputError, Message

Report = Callable[[float, str], None]


def double(payload: dict[str, Any], report: Report) -> dict[str, Any]:
    return {
        "doubled": 2 * payload["number"],
        "pid": os.getpid(),
        "threads": os.environ["OPENBLAS_NUM_THREADS"],
        "interrupt_ignored": signal.getsignal(signal.SIGINT) == signal.SIG_IGN,
        "niceness": os.nice(0),
    }


def wait(payload: dict[str, Any], report: Report) -> dict[str, Any]:
    """Write the process's id to a file and be busy for a while without a word."""
    with Path(payload["pids"]).open("a") as file:
        file.write(f"{os.getpid()}\n")
    end = time.monotonic() + payload["seconds"]
    while time.monotonic() < end:
        time.sleep(0.02)
    return {"waited": payload["seconds"]}


def hold_the_interpreter(payload: dict[str, Any], report: Report) -> dict[str, Any]:
    """Like `wait`, in one call of C code that never lets another thread of the process run."""
    Path(payload["pids"]).write_text(f"{os.getpid()}\n")
    return {"sum": sum(range(10**12))}


def chatter(payload: dict[str, Any], report: Report) -> dict[str, Any]:
    end = time.monotonic() + payload["seconds"]
    while (left := end - time.monotonic()) > 0:
        report(1 - left / payload["seconds"], "talking")
    report(1.0, "leaving")
    time.sleep(0.8)
    return {}


def refuse(payload: dict[str, Any], report: Report) -> dict[str, Any]:
    raise Invalid(
        problem("too-large", "%(value)s is too large.", value=7, file="currents.csv", row=3, column="jx_ma"),
        problem("too-late", "Too late."),
    )


def refuse_as_solver(payload: dict[str, Any], report: Report) -> dict[str, Any]:
    raise InputError(Message("unobservable", "%(name)s cannot be found.", {"name": "Kx"}))


def stumble(payload: dict[str, Any], report: Report) -> dict[str, Any]:
    raise ZeroDivisionError("a secret of the implementation")


def return_unpickleable(payload: dict[str, Any], report: Report) -> dict[str, Any]:
    return {"function": lambda: None}


def crash(payload: dict[str, Any], report: Report) -> dict[str, Any]:
    """Die by a signal the first `times` times."""
    count = Path(payload["count"])
    times = int(count.read_text()) + 1 if count.exists() else 1
    count.write_text(str(times))
    if times <= payload["times"]:
        os.kill(os.getpid(), payload.get("signal", signal.SIGSEGV))
    return {"attempt": times}
