"""When each gyro of the demonstration is measured, and in which of its starts."""

import random
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from datetime import datetime, timedelta
from typing import Final

from simdevice.fleet import DAY, FleetGyro

DAYS: Final = (1, 1, 1, 2, 1, 1, -2, 1, 1, 1, 1)
"""How many sessions a gyro has on each of its days in the year; −2: two, each in a start of its own."""
SESSIONS: Final = sum(map(abs, DAYS))
"""Sessions of each gyro over the year."""
FORGOTTEN: Final = "D-034"
"""The gyro that is not brought to the stand any more when three quarters of the year are over."""


@dataclass(frozen=True, slots=True)
class Visit:
    """One session of one gyro: when, in which start, its number, and whether its records are kept."""

    gyro: FleetGyro
    at: datetime
    time: float
    start: int
    number: int
    last: bool


def visits(fleet: Sequence[FleetGyro], now: datetime, seed: int) -> Iterator[Visit]:
    """Every session of the year that ends now, in the order of time."""
    shuffle = random.Random(seed)
    found: list[Visit] = []
    for place, gyro in enumerate(fleet):
        found += _of_gyro(gyro, place / len(fleet), now, shuffle)
    yield from sorted(found, key=lambda visit: visit.at)


def _of_gyro(gyro: FleetGyro, phase: float, now: datetime, shuffle: random.Random) -> Iterator[Visit]:
    year = 270 if gyro.serial == FORGOTTEN else 360
    start, number = 0, 0
    for place, count in enumerate(DAYS):
        day = round(4 + (place + phase) * year / len(DAYS))
        at = now - timedelta(days=365 - day, hours=now.hour - 7 - shuffle.randrange(4),
                             minutes=shuffle.randrange(60))  # fmt: skip
        start += 1
        for again in range(abs(count)):
            start += again > 0 and count < 0
            later = timedelta(hours=2 * again)
            yield Visit(gyro, at + later, (day + again / 12) * DAY, start, number, number == SESSIONS - 1)
            number += 1
