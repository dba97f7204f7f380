"""The laboratory's clock: seconds since the gyro was powered on, faster than life where that is asked for."""

import time
from collections.abc import Callable
from dataclasses import dataclass, field


@dataclass(frozen=True)
class Clock:
    """Laboratory time is (now − powered_on)·speed.

    Attributes
    ----------
    powered_on
        Moment of power-on, s since 1970. A process that is started again with the same moment
        continues the same power-up.
    speed
        Seconds of laboratory time in one second.
    wall, steady
        Time since 1970, s, asked once; and a time that never jumps, s.
    """

    powered_on: float
    speed: float = 1.0
    wall: Callable[[], float] = time.time
    steady: Callable[[], float] = time.monotonic
    _zero: float = field(init=False)

    def __post_init__(self) -> None:
        if not 0 < self.speed < float("inf"):
            raise ValueError("The speed must be a finite number greater than zero.")
        on_for = self.wall() - self.powered_on
        if on_for < 0:
            raise ValueError("The moment of power-on lies in the future.")
        object.__setattr__(self, "_zero", self.steady() - on_for)

    def now(self) -> float:
        """Laboratory time, s."""
        return (self.steady() - self._zero) * self.speed

    def wall_seconds(self, laboratory_seconds: float) -> float:
        """How long that takes on the wall's clock, s."""
        return laboratory_seconds / self.speed
