"""Time as the station counts it: lab seconds, which simulated instruments can make pass faster than a wall's."""

import time
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import Final

_LEAST_PATIENCE_S: Final = 10.0
"""No deadline is nearer on the wall: at a thousandfold speed a busy computer would miss any other."""
_NAP_S: Final = 0.1


@dataclass(frozen=True, slots=True)
class Clock:
    """A clock that runs `speed` times faster than the wall's (1 for real instruments); `poll_s` in lab seconds."""

    speed: float = 1.0
    poll_s: float = 0.5

    def lab_s(self) -> float:
        """Lab seconds, from any origin."""
        return time.monotonic() * self.speed

    def now(self) -> datetime:
        """The moment on the wall's clock, for what is written down."""
        return datetime.now(UTC)

    def nap(self) -> None:
        """Wait until instruments are to be asked again."""
        time.sleep(min(self.poll_s / self.speed, _NAP_S))

    def deadline(self, lab_s: float) -> "Deadline":
        """A time limit from now on."""
        return Deadline(time.monotonic() + max(lab_s / self.speed, _LEAST_PATIENCE_S))


@dataclass(frozen=True, slots=True)
class Deadline:
    """A moment on the wall's clock, monotonic."""

    at: float

    @property
    def passed(self) -> bool:
        """Whether it lies behind."""
        return time.monotonic() >= self.at
