"""The only module that speaks VISA: a text sent, a line or a block read; nothing of the VISA library leaves it.

A connection is opened when it is first used, and again after it was lost. After a timeout the next answer
could be the belated one to an earlier question, so such a connection is closed, never used again. One thread
at a time has an instrument: whoever needs several exchanges in a row holds `Instrument.lock`.
"""

import contextlib
import select
import socket
import threading
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Final, TypeVar

from app.errors import problem
from app.station.contracts import InstrumentLost

if TYPE_CHECKING:
    from pyvisa import ResourceManager
    from pyvisa.resources import MessageBasedResource, Resource

_MS_PER_S: Final = 1000.0
_SHOWN: Final = 80
_Got = TypeVar("_Got")
_opening = threading.Lock()


@dataclass(frozen=True, slots=True)
class Connection:
    """How an instrument is reached.

    Attributes
    ----------
    name
        Its table in the station's file, for messages.
    address
        VISA resource: ``TCPIP0::127.0.0.1::5025::SOCKET``.
    write_termination, read_termination
        Ends of a line sent and received; none where the bus tells the end itself.
    timeout_s
        Longest wait for an answer, and for a connection.
    library
        VISA library, ``@py`` for the one that comes with the program.
    attributes
        VISA attributes by name, set after opening.
    """

    name: str
    address: str
    write_termination: str = "\n"
    read_termination: str = "\n"
    timeout_s: float = 5.0
    visa_library: str = "@py"
    attributes: Mapping[str, int | bool] = field(default_factory=dict)


class Unanswered(InstrumentLost):
    """Nothing came within the time allowed, on a connection that is still open."""


class Instrument:
    """One instrument on VISA.

    Attributes
    ----------
    lock
        Held for every exchange; to be held by who must not be interrupted between several.
    """

    def __init__(self, connection: Connection) -> None:
        self.lock = threading.RLock()
        self.connection = connection
        self._resource: MessageBasedResource | None = None

    @property
    def closed(self) -> bool:
        """Whether there is no connection now."""
        return self._resource is None

    def open(self) -> None:
        """Open the connection, unless it is open.

        Raises
        ------
        InstrumentLost
            When it cannot be reached.
        """
        with self.lock:
            if self._resource is None:
                self._resource = self._connected()

    def write(self, text: str) -> None:
        """Send a line.

        Raises
        ------
        InstrumentLost
            When there is no connection, or it broke.
        """
        with self.lock:
            self._attempt(lambda resource: self._send(resource, text), text)

    def ask(self, text: str) -> str:
        """Send a line and read one, without its termination.

        Raises
        ------
        InstrumentLost
            As `write`; `Unanswered` when nothing came in time: then the caller either finds out why at
            once or closes.
        """

        def exchange(resource: "MessageBasedResource") -> str:
            self._send(resource, text)
            return self._line(resource).decode("utf-8", "replace")

        with self.lock:
            return self._attempt(exchange, text)

    def ask_block(self, text: str) -> bytes:
        """Send a line and read the content of a definite-length block (IEEE 488.2, 8.7.9), likewise."""

        def exchange(resource: "MessageBasedResource") -> bytes:
            self._send(resource, text)
            # A termination character within binary data ends nothing.
            resource.read_termination = None
            try:
                return self._block(resource, text)
            finally:
                resource.read_termination = self.connection.read_termination or None

        with self.lock:
            return self._attempt(exchange, text)

    def close(self) -> None:
        """Close the connection, if there is one; the next use opens another."""
        with self.lock:
            resource, self._resource = self._resource, None
            if resource is not None:
                # Whatever a broken connection says on closing, it is gone.
                with contextlib.suppress(Exception):
                    resource.close()

    def _send(self, resource: "MessageBasedResource", text: str) -> None:
        _require_open(resource)
        resource.write_raw((text + self.connection.write_termination).encode())

    def _line(self, resource: "MessageBasedResource") -> bytes:
        """A line without its end. One that is cut short is no answer."""
        end, line = self.connection.read_termination.encode(), b""
        while True:
            _await(resource)
            line += resource.read_raw()
            if _stream_of(resource) is None or line.endswith(end):
                return line.removesuffix(end)

    def _block(self, resource: "MessageBasedResource", text: str) -> bytes:
        head = _exactly(resource, 2)
        if head[:1] != b"#" or not head[1:].isdigit() or head == b"#0":
            raise self._lost_with_garbage(text, head)
        length = _exactly(resource, int(head[1:]))
        if not length.isdigit():
            raise self._lost_with_garbage(text, head + length)
        content = _exactly(resource, int(length))
        end = self.connection.read_termination.encode()
        if _exactly(resource, len(end)) != end:
            raise self._lost_with_garbage(text, b"\xe2\x80\xa6")
        return content

    def _attempt(self, action: Callable[["MessageBasedResource"], _Got], text: str) -> _Got:
        """Do it on the connection, opening it first; every way of breaking becomes `InstrumentLost`."""
        from pyvisa import constants, errors

        self.open()
        try:
            assert self._resource is not None
            return action(self._resource)
        except InstrumentLost:
            self.close()
            raise
        except (errors.Error, OSError) as error:
            late = getattr(error, "error_code", None) == constants.StatusCode.error_timeout
            if late or isinstance(error, TimeoutError):
                raise self._unanswered(text) from error
            self.close()
            raise self._lost(text, error) from error

    def _connected(self) -> "MessageBasedResource":
        connection = self.connection
        try:
            resource = _manager(connection.visa_library).open_resource(
                connection.address, open_timeout=round(connection.timeout_s * _MS_PER_S)
            )
        # pyvisa-py raises a bare Exception for a host that cannot be reached.
        except Exception as error:
            raise self._unreachable(error) from error
        try:
            return self._prepared(resource)
        except Exception as error:
            resource.close()
            raise self._unreachable(error) from error

    def _prepared(self, resource: "Resource") -> "MessageBasedResource":
        from pyvisa import constants
        from pyvisa.resources import MessageBasedResource

        connection = self.connection
        if not isinstance(resource, MessageBasedResource):
            raise TypeError(f"{resource.resource_class} takes no messages")
        resource.timeout = connection.timeout_s * _MS_PER_S
        resource.read_termination = connection.read_termination or None
        if _stream_of(resource) is not None:
            # What came before the other end closed is then given at once, and not at the timeout.
            resource.set_visa_attribute(constants.ResourceAttribute.suppress_end_enabled, False)
        for name, value in connection.attributes.items():
            try:
                resource.set_visa_attribute(getattr(constants, name), value)
            except Exception as error:  # pyvisa-py has exceptions of its own for this
                raise ValueError(f"{name}: {error}") from error
        return resource

    def _values(self, text: str = "") -> dict[str, Any]:
        shown = text if len(text) <= _SHOWN else text[:_SHOWN] + "…"
        return {"name": self.connection.name, "address": self.connection.address, "sent": shown}

    def _unreachable(self, error: Exception) -> InstrumentLost:
        return InstrumentLost(
            problem(
                "instrument-unreachable",
                "[%(name)s] cannot be reached at %(address)s (%(why)s). Check that it is on, its cable and its "
                "address in the station's file.",
                why=_why(error),
                **self._values(),
            )
        )

    def _unanswered(self, text: str) -> Unanswered:
        return Unanswered(
            problem(
                "instrument-silent",
                "[%(name)s] at %(address)s did not answer %(sent)s within %(timeout)g s. Check that it is on, "
                "and its cable.",
                timeout=self.connection.timeout_s,
                **self._values(text),
            )
        )

    def _lost(self, text: str, error: Exception) -> InstrumentLost:
        return InstrumentLost(
            problem(
                "instrument-lost",
                "[%(name)s] at %(address)s: the connection broke at %(sent)s (%(why)s). Check that it is on, and "
                "its cable.",
                why=_why(error),
                **self._values(text),
            )
        )

    def _lost_with_garbage(self, text: str, got: bytes) -> InstrumentLost:
        return InstrumentLost(
            problem(
                "instrument-garbled",
                "[%(name)s] at %(address)s answered %(sent)s by %(got)s, which is no block of data. Check the "
                "command in the station's file, and the cable.",
                got=got.decode("utf-8", "replace"),
                **self._values(text),
            )
        )


def attribute_names() -> frozenset[str]:
    """Names of the VISA attributes that a description may set."""
    from pyvisa import constants

    return frozenset(name for name in dir(constants) if name.startswith("VI_ATTR_"))


def _manager(visa_library: str) -> "ResourceManager":
    """The library's manager; VISA keeps one per library. Importing it takes half a second, so only here."""
    from pyvisa import ResourceManager

    with _opening:
        return ResourceManager(visa_library)


def _exactly(resource: "MessageBasedResource", count: int) -> bytes:
    """Read so many bytes; raises as `_await`."""
    got = bytearray()
    while len(got) < count:
        _await(resource)
        got += resource.read_bytes(count - len(got), break_on_termchar=True)
    return bytes(got)


def _await(resource: "MessageBasedResource") -> None:
    """Wait for more to read; raises `TimeoutError`, or as `_require_open` when the other end has closed."""
    stream = _stream_of(resource)
    if stream is None or _already_here(resource):
        return
    if not select.select([stream], [], [], resource.timeout / _MS_PER_S)[0]:
        raise TimeoutError
    _require_open(resource)


def _require_open(resource: "MessageBasedResource") -> None:
    """Notice that the other end has closed: pyvisa-py would wait for its whole timeout, busily, for an answer.

    Raises
    ------
    ConnectionError
        There is nobody at the other end any more.
    """
    stream = _stream_of(resource)
    if stream is None or not select.select([stream], [], [], 0.0)[0]:
        return
    if not stream.recv(1, socket.MSG_PEEK):
        raise ConnectionAbortedError("closed at the other end")


def _stream_of(resource: "MessageBasedResource") -> socket.socket | None:
    """The connection itself, where it is TCP and pyvisa-py's."""
    stream = getattr(_session_of(resource), "interface", None)
    return stream if isinstance(stream, socket.socket) else None


def _already_here(resource: "MessageBasedResource") -> bool:
    """Whether pyvisa-py has more of the answer than was asked for."""
    return bool(getattr(_session_of(resource), "_pending_buffer", b""))


def _session_of(resource: "MessageBasedResource") -> object:
    return getattr(resource.visalib, "sessions", {}).get(resource.session)


def _why(error: Exception) -> str:
    return (str(error) or type(error).__name__)[: 2 * _SHOWN]
