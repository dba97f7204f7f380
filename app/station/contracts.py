"""What the cycle needs of a stand and an ammeter, whichever they are; laboratory units.

A driver (`stand` and `ammeter` in `app.station.instruments`) answers at once: `home`, `move` and `start`
begin something, whose progress `status` tells. `InstrumentLost` says that an instrument does not answer:
the cycle connects anew and goes on; `InstrumentFault` that it answers, and that something is wrong with it.
"""

from dataclasses import dataclass
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from app.errors import AppError

Array = NDArray[np.float64]


class InstrumentLost(AppError):
    """The connection broke or timed out; what the instrument was doing is unknown."""


class InstrumentFault(AppError):
    """The instrument reports an error, or does not do what it was told."""


class EmergencyStop(AppError):
    """The stand's emergency stop is pressed, or the operator's stop was asked for: nothing may move."""


class Place(NamedTuple):
    """A position of the stand, commanded angles in degrees."""

    theta_deg: float
    psi_deg: float


class Certified(NamedTuple):
    """A position of the stand's certificate, and the largest rotation √(α² + β² + γ²) that it certifies there."""

    place: Place
    turned_arcsec: float


@dataclass(frozen=True, slots=True)
class StandStatus:
    """How the stand stands: referenced to its zero, moving, stopped for safety, and where its encoders are."""

    homed: bool
    moving: bool
    emergency_stop: bool
    place: Place


class Stand(Protocol):
    """A two-axis stand."""

    def identify(self) -> str:
        """Who it says it is; raises `InstrumentFault` when that is not who the description names."""

    def home(self) -> None:
        """Begin to seek the reference."""

    def move(self, place: Place) -> None:
        """Begin to move there; a place outside the limits raises before anything is sent."""

    def status(self) -> StandStatus:
        """How it stands now; raises `InstrumentFault` for an error that it reports."""

    def stop(self) -> None:
        """Stop at once."""


class Currents(NamedTuple):
    """Both currents now, mA."""

    jx_ma: float
    jy_ma: float


@dataclass(frozen=True, slots=True)
class Acquisition:
    """What the ammeter acquires: the label it was started with, whether it goes on, samples ready to fetch.

    `label` is None when nothing was started since power-on, or when the ammeter keeps no label.
    """

    label: int | None
    running: bool
    samples: int
    overload: bool


@dataclass(frozen=True, slots=True, eq=False)
class Block:
    """Samples `first`, `first` + 1, …: time since the acquisition's begin, s, and both currents, mA; (n,) each."""

    first: int
    t_s: Array
    jx_ma: Array
    jy_ma: Array


class Ammeter(Protocol):
    """A two-channel ammeter with a buffer."""

    def identify(self) -> str:
        """Who it says it is; raises `InstrumentFault` when that is not who the description names."""

    def reading(self) -> Currents:
        """Both currents now."""

    def start(self, label: int, take: int, samples: int, rate_hz: float) -> None:
        """Begin to acquire. `label` is new for each start; `take` counts the measurements at this place."""

    def status(self) -> Acquisition:
        """How the acquisition stands; raises `InstrumentFault` for an error that it reports."""

    def fetch(self, first: int, most: int) -> Block:
        """Samples from `first` on, `most` at most; an acquisition's samples may be fetched more than once."""

    def stop(self) -> None:
        """Stop acquiring; what was acquired can still be fetched."""
