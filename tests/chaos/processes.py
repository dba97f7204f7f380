"""Programs of Driftbook as processes that are killed and started again."""

import os
import signal
import socket
import subprocess
import sys
import time
from pathlib import Path

import httpx


def free_port() -> int:
    """A port that nobody has now; a program that is started again wants the same one."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


class Program:
    """``driftbook …`` as a process; what it says goes to a file."""

    def __init__(self, log: Path, *arguments: object) -> None:
        self._command = [sys.executable, "-m", "app", *map(str, arguments)]
        self._log = log
        self.process: subprocess.Popen[bytes] | None = None

    def start(self) -> None:
        with self._log.open("ab") as log:
            self.process = subprocess.Popen(self._command, stdout=log, stderr=log, start_new_session=True)

    def kill(self) -> None:
        if self.process is not None and self.process.poll() is None:
            os.kill(self.process.pid, signal.SIGKILL)
            self.process.wait()

    @property
    def ended(self) -> int | None:
        """Exit code, if it ended by itself or was killed."""
        return None if self.process is None else self.process.poll()

    @property
    def said(self) -> str:
        """The end of what it said."""
        return self._log.read_text(encoding="utf-8", errors="replace")[-3000:] if self._log.exists() else ""


class Service(Program):
    """``driftbook serve`` on one data folder and port."""

    def __init__(self, data: Path, port: int, log: Path) -> None:
        super().__init__(log, "serve", "--data", data, "--port", port)
        self.url = f"http://127.0.0.1:{port}"

    def wait(self) -> None:
        # `verify`: a client that may meet HTTPS takes 70 ms of a processor to be made.
        with httpx.Client(base_url=self.url, timeout=1, verify=False) as client:
            for _ in range(600):
                try:
                    if client.get("/health/ready").status_code == 200:
                        return
                except httpx.TransportError:
                    pass
                time.sleep(0.1)
        raise AssertionError(f"the service does not come up:\n{self.said}")
