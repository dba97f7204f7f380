"""Runs commands of `driftbook` in a process where this project's own code has nothing that only POSIX has.

    python windows_like.py '[["solve", "folder"], …]'

The standard library and other packages have parts of their own for Windows, and keep here what they chose for
this system. The project's code finds neither the modules nor the names of `os`, `signal` and `socket` whose
documentation says “Unix”, and `os.name` tells it that it runs on Windows. Prints one JSON line per command: exit code,
standard output, standard error.
"""

import builtins
import contextlib
import io
import json
import os
import signal
import socket
import sys
from types import ModuleType
from typing import Any

OURS = ("app", "solver", "simdevice")
MODULES = (
    "crypt", "curses", "fcntl", "grp", "nis", "ossaudiodev", "posix", "pty", "pwd", "readline", "resource", "spwd",
    "syslog", "termios", "tty",
)  # fmt: skip
NAMES = {
    os: "fork forkpty wait wait3 wait4 waitid killpg getuid geteuid getgid getegid getgroups getresuid setuid setgid "
    "setsid setpgid getpgid getpgrp getsid getpriority setpriority nice chown lchown fchown chroot mkfifo mknod "
    "statvfs fstatvfs uname sysconf confstr getloadavg sched_yield sched_getaffinity sched_setaffinity openpty ttyname "
    "tcgetpgrp tcsetpgrp ctermid lockf fdatasync sync sendfile pread pwrite posix_fallocate posix_fadvise posix_spawn "
    "posix_spawnp register_at_fork initgroups setgroups WIFEXITED WEXITSTATUS WNOHANG O_DIRECTORY O_NOFOLLOW O_SYNC "
    "O_NONBLOCK O_CLOEXEC O_DSYNC O_NOCTTY",
    signal: "SIGKILL SIGHUP SIGQUIT SIGUSR1 SIGUSR2 SIGALRM SIGCHLD SIGPIPE SIGCONT SIGSTOP SIGTSTP SIGWINCH alarm "
    "setitimer getitimer pause pthread_kill pthread_sigmask sigwait sigpending siginterrupt",
    socket: "AF_UNIX SO_REUSEPORT send_fds recv_fds",
}
INSTEAD = {(os, "name"): "nt"}


def ours(name: object) -> bool:
    return str(name).partition(".")[0] in OURS


class Guarded(ModuleType):
    """A module that hides names from the project's code, and answers it as on Windows."""

    def __getattribute__(self, name: str) -> Any:
        if ours(sys._getframe(1).f_globals.get("__name__")):
            if (self, name) in INSTEAD:
                return INSTEAD[self, name]
            if name in HIDDEN[id(self)]:
                raise AttributeError(f"hidden: {name}", name=name, obj=self)
        return super().__getattribute__(name)


HIDDEN = {id(module): frozenset(names.split()) for module, names in NAMES.items()}


def hide() -> None:
    """From now on; nothing of the project may be loaded yet."""
    imported = builtins.__import__

    def guarded(name: str, *rest: Any, **named: Any) -> ModuleType:
        importing = (rest[0] if rest else named.get("globals")) or {}
        if name.partition(".")[0] in MODULES and ours(importing.get("__name__")):
            raise ModuleNotFoundError(f"No module named {name!r}", name=name)
        return imported(name, *rest, **named)

    builtins.__import__ = guarded
    for module in NAMES:
        module.__class__ = Guarded


def run(arguments: list[str]) -> dict[str, object]:
    from app.cli import main

    sys.argv = ["driftbook", *arguments]
    out, err, code = io.StringIO(), io.StringIO(), 0
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        try:
            main()
        except SystemExit as end:
            code = end.code or 0
    return {"code": code, "out": out.getvalue(), "err": err.getvalue()}


def tried(source: str) -> str:
    """What comes of a line in a module of the project."""
    try:
        exec(source, {"__name__": "app.station.tried"})
    except (ImportError, AttributeError) as error:
        return type(error).__name__
    return "done"


if __name__ == "__main__":
    hide()
    for said in json.loads(sys.argv[1]):
        answer = tried(said) if isinstance(said, str) else run(said)
        sys.stdout.write(json.dumps(answer) + "\n")
