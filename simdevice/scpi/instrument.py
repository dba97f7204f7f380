"""An instrument that is talked to: messages in, answers out, status kept."""

import logging
import math
from collections.abc import Callable, Generator, Sequence
from typing import Final, Protocol

from simdevice.scpi.errors import ScpiError
from simdevice.scpi.status import OPERATION_COMPLETE, Group, Status
from simdevice.scpi.syntax import Unit, units
from simdevice.scpi.tree import Command, Tree, Whole

_LOG = logging.getLogger(__name__)
_BYTE: Final = Whole(0, 255)
_WORD: Final = Whole(0, 32767)
_SHORTEST_WAIT_S: Final = 0.0005
_LONGEST_WAIT_S: Final = 0.02
"""How long a waiting client sleeps at a time: an operation may end sooner than foreseen, by ABORt."""


class HangUp(Exception):
    """The connection breaks after these bytes."""

    def __init__(self, sent: bytes) -> None:
        super().__init__(f"the connection breaks after {len(sent)} bytes")
        self.sent = sent


class Device(Protocol):
    """What is behind the commands."""

    @property
    def identity(self) -> str:
        """Maker, model, serial number, version: the answer to ``*IDN?``."""

    @property
    def commands(self) -> Sequence[Command]:
        """Besides those that every instrument has."""

    def pending(self) -> float:
        """Seconds of wall clock to the end of what goes on; 0 when nothing does, inf when it will not end."""

    def operation(self) -> int:
        """Bits of STATus:OPERation that are true now."""

    def questionable(self) -> int:
        """Bits of STATus:QUEStionable that are true now."""

    def reset(self) -> None:
        """``*RST``: stop, and take the settings of power-on."""

    def abort(self) -> None:
        """Stop at once."""


def block(contents: bytes) -> bytes:
    """Definite-length arbitrary block response data (IEEE 488.2-1992, 8.7.9): ``#``, digits, length, contents."""
    length = str(len(contents))
    return f"#{len(length)}{length}".encode() + contents


class Instrument:
    """Understands messages for a device.

    Registers and error queue are the instrument's, whoever caused what is in them: a client sees
    another's errors, as on a bench instrument with several sockets.
    """

    def __init__(self, device: Device) -> None:
        self._device = device
        self.status = Status(device.operation, device.questionable)
        self._tree = Tree((*self._common(), *self._required(), *device.commands))
        self._complete_is_awaited = False
        self._message_available = False

    def respond(self, message: bytes) -> Generator[float, None, bytes]:
        """Execute one message.

        Yields
        ------
        float
            Seconds to sleep before going on: ``*WAI`` and ``*OPC?`` wait for what goes on.

        Returns
        -------
        bytes
            The answer with its line feed; empty when nothing was asked.

        Raises
        ------
        HangUp
            When the connection breaks in the middle of the answer.
        """
        answers: list[bytes] = []
        path: tuple[str, ...] = ()
        ended = False
        try:
            for unit in units(message):
                self._latch()
                if ended and unit.is_query:
                    raise ScpiError(-440)
                if unit.words == ("*WAI",) or (unit.words == ("*OPC",) and unit.is_query):
                    yield from self._wait()
                self._message_available = bool(answers)
                path = self._execute(unit, path, answers)
                ended = ended or unit.words == ("*IDN",)
        except ScpiError as error:
            self.status.report(error)
        self._latch()
        return b";".join(answers) + b"\n" if answers else b""

    def refuse(self, error: ScpiError) -> None:
        """Queue an error that was found before a message was whole."""
        self.status.report(error)

    def _execute(self, unit: Unit, path: tuple[str, ...], answers: list[bytes]) -> tuple[str, ...]:
        """One unit; a command error goes up and ends the message, another does not."""
        command, path = self._tree.find(unit, path)
        try:
            answer = command.run(unit.parameters)
        except ScpiError as error:
            if error.is_command_error:
                raise
            self.status.report(error)
        except HangUp as broken:
            raise HangUp(b";".join([*answers, broken.sent])) from None
        except Exception:
            _LOG.exception("%s failed", command.pattern)
            self.status.report(ScpiError(-310, f"{command.pattern} failed: see the simulator's log"))
        else:
            if answer is not None:
                answers.append(answer if isinstance(answer, bytes) else answer.encode("ascii"))
        return path

    def _wait(self) -> Generator[float, None, None]:
        while (left := self._device.pending()) > 0:
            yield min(max(left, _SHORTEST_WAIT_S), _LONGEST_WAIT_S)

    def waits_for_ever(self) -> bool:
        """Whether what goes on will not end by itself."""
        return math.isinf(self._device.pending())

    def _latch(self) -> None:
        """Note what changed since the last command, events of the groups and the end of operations."""
        self.status.operation.latch()
        self.status.questionable.latch()
        if self._complete_is_awaited and self._device.pending() == 0:
            self._complete_is_awaited = False
            self.status.note(OPERATION_COMPLETE)

    # The commands that every instrument has

    def _common(self) -> list[Command]:
        status = self.status
        return [
            Command("*IDN?", lambda: self._device.identity),
            Command("*RST", self._reset),
            Command("*CLS", self._clear),
            Command("*ESE", lambda mask: setattr(status, "event_enable", mask), [_BYTE]),
            Command("*ESE?", lambda: str(status.event_enable)),
            Command("*ESR?", lambda: str(status.read_event())),
            Command("*OPC", self._await_complete),
            Command("*OPC?", lambda: "1"),
            Command("*SRE", lambda mask: setattr(status, "service_enable", mask), [_BYTE]),
            Command("*SRE?", lambda: str(status.service_enable)),
            Command("*STB?", lambda: str(status.byte(message_available=self._message_available))),
            Command("*TST?", lambda: "0"),
            Command("*WAI", lambda: None),
        ]

    def _required(self) -> list[Command]:
        return [
            Command("SYSTem:ERRor[:NEXT]?", lambda: str(self.status.next_error())),
            Command("SYSTem:ERRor:COUNt?", lambda: str(self.status.errors)),
            Command("SYSTem:VERSion?", lambda: "1999.0"),
            *_group_commands("STATus:OPERation", self.status.operation),
            *_group_commands("STATus:QUEStionable", self.status.questionable),
            Command("STATus:PRESet", self.status.preset),
            Command("ABORt", self._device.abort),
        ]

    def _reset(self) -> None:
        self._complete_is_awaited = False
        self._device.reset()

    def _clear(self) -> None:
        self._complete_is_awaited = False
        self.status.clear()

    def _await_complete(self) -> None:
        self._complete_is_awaited = True
        self._latch()


def _group_commands(header: str, group: Group) -> list[Command]:
    def enable(mask: int) -> None:
        group.enable = mask

    reading: list[tuple[str, Callable[[], int]]] = [
        ("[:EVENt]?", group.read_event),
        (":CONDition?", group.condition),
        (":ENABle?", lambda: group.enable),
    ]
    return [
        *(Command(header + tail, lambda read=read: str(read())) for tail, read in reading),
        Command(header + ":ENABle", enable, [_WORD]),
    ]
