"""Random streams named by what they are for.

A stream's key is (part, what the part is drawn for …) and becomes the spawn key of a
`numpy.random.SeedSequence`. No stream is ever drawn from twice for two purposes, so a new part, a
new position, another order or more workers change no number that was there before.

The numbers of `Part` and the bit generator are part of every simulated record: never renumber.
"""

from enum import IntEnum

import numpy as np


class Part(IntEnum):
    """What a stream is drawn for; the words in brackets are the rest of its key."""

    RATE_WHITE = 1
    """White rate noise of a record (axis, position, repeat)."""
    AMMETER_WHITE = 2
    """White noise of the ammeter in a record (channel, position, repeat)."""
    MEAN_RATE_WHITE = 3
    """White rate noise of a mean drawn without its record (axis, position, repeat)."""
    MEAN_AMMETER_WHITE = 4
    """White ammeter noise of a mean drawn without its record (channel, position, repeat)."""
    CERTIFIED_ANGLES = 5
    """The angles of a drawn certificate (position)."""
    MISALIGNMENT_COMMON = 6
    """The certificate's systematic deviation from the truth ()."""
    MISALIGNMENT = 7
    """The certificate's random deviation from the truth (position)."""
    INDIVIDUAL = 8
    """An individual gyro of a type ()."""
    START = 9
    """The scatter of a gyro's parameters from power-up to power-up (number of the start)."""
    STAND_SEED = 10
    """The seed of a stand made for a scenario ()."""
    SESSION_SEED = 11
    """The seed of one session in a gyro's history (number of the session)."""
    FLEET_SEED = 12
    """The seed of one gyro in a fleet (number of the gyro)."""
    FLICKER = 13
    """Bias instability (axis, number of the process, number of the start, block of knots)."""
    RATE_RANDOM_WALK = 14
    """Rate random walk (axis, 0, number of the start, block of knots)."""
    TURN_ON = 15
    """Turn-on offset of both biases (number of the start)."""
    JITTER = 16
    """The sampling clock's jitter in a record (position, repeat)."""
    MAINS_PHASE = 17
    """Phase of the mains at a record's beginning (position, repeat)."""
    RIPPLE_PHASE = 18
    """Phase of the rotor at a record's beginning (position, repeat)."""
    FAULT = 19
    """Where in a record a fault strikes (kind, position, repeat)."""
    FAULT_PLACE = 20
    """The place that a fault without one strikes (kind, which of this kind)."""
    RATE_WHITE_BEFORE = 21
    """White rate noise just before a record, backwards: what the loop still answers (axis, position, repeat)."""
    LIVE_READING = 22
    """White noise of a reading outside a record (number of the start, tenths of a second since power-up)."""
    LIFE_NOISE = 23
    """White rate noise of all means of one session in a laboratory's life (number of the session)."""
    LIFE_DATES = 24
    """When in its month each gyro of a laboratory is measured ()."""


def _sequence(seed: int, part: Part, key: tuple[int, ...]) -> np.random.SeedSequence:
    if seed < 0:
        raise ValueError(f"The seed is {seed}: give an integer that is not negative.")
    return np.random.SeedSequence(seed, spawn_key=(int(part), *key))


def stream(seed: int, part: Part, *key: int) -> np.random.Generator:
    """The generator of one part.

    Parameters
    ----------
    seed
        Not negative, of any size.
    part
        What the numbers are for.
    *key
        What distinguishes this stream within the part, integers in [0, 2³²).
    """
    return np.random.Generator(np.random.PCG64(_sequence(seed, part, key)))


def derived_seed(seed: int, part: Part, *key: int) -> int:
    """A seed of 64 bits for a thing that has streams of its own; arguments as for `stream`."""
    return int(_sequence(seed, part, key).generate_state(1, np.uint64)[0])
