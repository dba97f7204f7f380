"""Status of an instrument: error queue and registers.

IEEE 488.2-1992, chapter 11: the standard event status register (ESR) collects what happened, the
status byte (STB) sums up. SCPI 1999.0, volume 1, chapter 9 adds the error queue, and two groups of
registers, OPERation and QUEStionable, each with a condition (now), an event register (what became
true since it was read) and an enable mask.
"""

from collections import deque
from collections.abc import Callable
from typing import Final

from simdevice.scpi.errors import NO_ERROR, ScpiError

OPERATION_COMPLETE: Final = 1
POWER_ON: Final = 128
QUEUE_LENGTH: Final = 20

_ERROR_AVAILABLE, _QUESTIONABLE, _MESSAGE_AVAILABLE = 4, 8, 16
_EVENT_SUMMARY, _MASTER_SUMMARY, _OPERATION = 32, 64, 128


class Group:
    """One of SCPI's groups; `condition` is asked for the present bits."""

    def __init__(self, condition: Callable[[], int]) -> None:
        self.condition = condition
        self.enable = 0
        self._event = 0
        self._last = 0

    def latch(self) -> None:
        """Note what has become true since the last time."""
        now = self.condition()
        self._event |= now & ~self._last
        self._last = now

    def read_event(self) -> int:
        """The event register; reading it clears it."""
        self.latch()
        event, self._event = self._event, 0
        return event

    def clear(self) -> None:
        """Forget events."""
        self.latch()
        self._event = 0

    @property
    def summary(self) -> bool:
        """Whether an enabled event is noted."""
        self.latch()
        return bool(self._event & self.enable)


class Status:
    """Registers and error queue of one instrument, shared by all who talk to it."""

    def __init__(self, operation: Callable[[], int], questionable: Callable[[], int]) -> None:
        self.operation, self.questionable = Group(operation), Group(questionable)
        self.event_enable = 0
        self._event = POWER_ON
        self._service_enable = 0
        self._errors: deque[ScpiError] = deque()

    def report(self, error: ScpiError) -> None:
        """Queue an error; one too many takes the last one's place as −350."""
        self._event |= error.event_bit
        if len(self._errors) < QUEUE_LENGTH:
            self._errors.append(error)
            return
        overflow = ScpiError(-350)
        self._errors[-1] = overflow
        self._event |= overflow.event_bit

    def note(self, event_bit: int) -> None:
        """Set a bit of the standard event status register."""
        self._event |= event_bit

    def next_error(self) -> ScpiError:
        """The oldest error, taken out of the queue; error 0 when there is none."""
        return self._errors.popleft() if self._errors else NO_ERROR

    @property
    def errors(self) -> int:
        """Length of the queue."""
        return len(self._errors)

    def read_event(self) -> int:
        """The standard event status register; reading it clears it."""
        event, self._event = self._event, 0
        return event

    @property
    def service_enable(self) -> int:
        """Bits of the status byte that ask for service; bit 6 is the request itself and is never among them."""
        return self._service_enable

    @service_enable.setter
    def service_enable(self, mask: int) -> None:
        self._service_enable = mask & ~_MASTER_SUMMARY

    def byte(self, *, message_available: bool) -> int:
        """The status byte with the master summary in bit 6."""
        summaries = (
            _ERROR_AVAILABLE * bool(self._errors)
            | _QUESTIONABLE * self.questionable.summary
            | _MESSAGE_AVAILABLE * message_available
            | _EVENT_SUMMARY * bool(self._event & self.event_enable)
            | _OPERATION * self.operation.summary
        )
        return summaries | _MASTER_SUMMARY * bool(summaries & self._service_enable)

    def clear(self) -> None:
        """``*CLS``: events and errors; masks stay."""
        self._event = 0
        self._errors.clear()
        self.operation.clear()
        self.questionable.clear()

    def preset(self) -> None:
        """``STATus:PRESet``: nothing of the groups is reported upwards."""
        self.operation.enable = self.questionable.enable = 0
