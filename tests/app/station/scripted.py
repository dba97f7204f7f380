"""An instrument on TCP that knows a script: what it must be told, byte for byte, and what it answers."""

import contextlib
import socket
import threading
import time
from dataclasses import dataclass
from typing import Self

WAITS_S = 10.0  # a guard against a test that hangs, far longer than any exchange takes


@dataclass(frozen=True)
class Cut:
    """Answer so much, then break the connection."""

    said: bytes = b""


class Peer:
    """Serves one client after the other on a free port while the block lasts; then the script must be at its end.

    Each line of the script is (what it is told, what it answers); `b""` answers nothing.
    """

    def __init__(self, *script: tuple[bytes, bytes | Cut], end: bytes = b"\n") -> None:
        self._left = list(script)
        self._end = end
        self._wrong: list[str] = []
        self._client: socket.socket | None = None
        self._ended = False
        self.clients = 0

    @property
    def address(self) -> str:
        return f"TCPIP0::127.0.0.1::{self._server.getsockname()[1]}::SOCKET"

    def __enter__(self) -> Self:
        self._server = socket.create_server(("127.0.0.1", 0))
        self._server.settimeout(WAITS_S)
        self._thread = threading.Thread(target=self._serve)
        self._thread.start()
        return self

    def __exit__(self, kind: object, *_: object) -> None:
        deadline = time.monotonic() + WAITS_S / 10
        while kind is None and self._left and not self._wrong and time.monotonic() < deadline:
            time.sleep(0.001)  # the last line may still be on its way
        self._ended = True
        with socket.create_connection(self._server.getsockname()):  # wakes who waits for a client
            pass
        client = self._client
        if client is not None:
            with contextlib.suppress(OSError):
                client.shutdown(socket.SHUT_RDWR)
        self._thread.join()
        self._server.close()
        if kind is None:
            assert not self._wrong, self._wrong
            assert not self._left, f"never told: {self._left}"

    def _serve(self) -> None:
        while not self._ended:
            client, _ = self._server.accept()
            with client:
                if self._ended:
                    return
                client.settimeout(WAITS_S)
                self._client = client
                self.clients += 1
                with contextlib.suppress(OSError):
                    self._talk(client)
                self._client = None

    def _talk(self, client: socket.socket) -> None:
        pending = b""
        while got := client.recv(4096):
            pending += got
            while self._end in pending:
                line, pending = pending.split(self._end, 1)
                if not self._answered(client, line):
                    return

    def _answered(self, client: socket.socket, line: bytes) -> bool:
        if not self._left or self._left[0][0] != line:
            self._wrong.append(f"told {line!r} where {self._left[:1]!r} was due")
            return False
        _, answer = self._left.pop(0)
        client.sendall(answer.said if isinstance(answer, Cut) else answer)
        return not isinstance(answer, Cut)
