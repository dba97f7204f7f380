"""The session's time axis: when each record begins, counted from the gyro's power-up.

A session is planned as a row of slots of equal length, one for each place of the certificate, then
the same again for the first repeat, and so on::

    slot  = repeat·n_places + row of the place in the certificate
    begin = first + slot·(move + settle + duration)

The plan holds whatever order, speed or wall clock things really happened in: slow processes of a
record are those of its slot, so a record depends on no other record and on no history.
"""

from dataclasses import dataclass, fields

import numpy as np


@dataclass(frozen=True, slots=True)
class Timetable:
    """When records begin.

    Attributes
    ----------
    first
        The first record's beginning after power-up, s: the time given to warm up.
    move, settle
        Time that the stand takes to move, and then to settle, before each record, s.
    """

    first: float = 3600.0
    move: float = 10.0
    settle: float = 5.0

    def __post_init__(self) -> None:
        for item in fields(self):
            value = getattr(self, item.name)
            if not (np.isfinite(value) and value >= 0):
                raise ValueError(
                    f"The timetable's {item.name} is {value} s: give a finite number that is not negative."
                )

    def begin(self, slot: int, duration: float) -> float:
        """Beginning of a slot's record, s after power-up, for records of `duration` seconds."""
        return self.first + slot * (self.move + self.settle + duration)
