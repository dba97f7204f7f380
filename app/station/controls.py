"""What people ask of a running cycle: by the page, by Ctrl-C, by the operating system."""

import signal
import threading
import time
from collections import deque
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from types import FrameType
from typing import Literal

from app.station.contracts import Place

Kind = Literal["pause", "resume", "skip", "retake", "stop"]


@dataclass(frozen=True, slots=True)
class Command:
    """A command; without a place it is about the record that is being measured.

    The service numbers its commands from 1; one from the keyboard has a negative number.
    """

    id: int
    kind: Kind
    place: Place | None = None


class StopAsked(Exception):
    """The cycle is to end here, and can be taken up again; `why` says who asked."""

    def __init__(self, why: str) -> None:
        super().__init__(why)
        self.why = why


class TargetLeft(Exception):
    """What is being measured is not wanted any more: skipped, or to be begun anew."""


class Controls:
    """Commands on their way to the cycle. A signal only sets an attribute: its handler may interrupt anything."""

    def __init__(self) -> None:
        self._given: deque[Command] = deque()
        self._known: set[int] = set()
        self._lock = threading.Lock()
        self.stopped_by: str | None = None
        """Who asked for the end; a handler of signals sets it."""

    def give(self, commands: Iterable[Command]) -> None:
        """Hand commands over; one that was given before is not given again."""
        with self._lock:
            for command in commands:
                if command.id not in self._known:
                    self._known.add(command.id)
                    self._given.append(command)

    def resume(self) -> None:
        """Go on, says somebody at the keyboard."""
        self.give([Command(-time.time_ns(), "resume")])

    def take(self) -> Command | None:
        """The next command, if there is one."""
        with self._lock:
            return self._given.popleft() if self._given else None

    @contextmanager
    def on_signals(self) -> Iterator[None]:
        """Let Ctrl-C and the system's wish to end the program stop the cycle; a second Ctrl-C ends it at once."""

        def asked(number: int, frame: FrameType | None) -> None:
            if self.stopped_by is not None and number == signal.SIGINT:
                raise KeyboardInterrupt
            self.stopped_by = signal.Signals(number).name

        names = ("SIGINT", "SIGTERM", "SIGBREAK")  # the last is Windows' Ctrl-Break and closing of the window
        numbers = [getattr(signal, name) for name in names if hasattr(signal, name)]
        before = [(number, signal.signal(number, asked)) for number in numbers]
        try:
            yield
        finally:
            for number, handler in before:
                signal.signal(number, handler)
