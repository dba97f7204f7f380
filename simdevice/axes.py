"""The two axes of a stand with fixed positions, as they move: where the case is, and what the encoders say.

Both axes turn at `SLEW_RATE` at the same time and then lock into the index. Movement is a function of
laboratory time: nothing runs between two questions. Angles in rad, times in s of that clock.
"""

from dataclasses import dataclass
from typing import Final

import numpy as np

from simdevice.certificate import Certificate, Position
from simdevice.clock import Clock
from simdevice.faults import WRONG_BY, Kind
from solver.units import deg_from_rad, rad_from_deg

SLEW_RATE: Final = rad_from_deg(30.0)
"""rad/s."""
LOCKING: Final = 1.0
"""Time of a movement besides its turning, s."""
SEEKING: Final = 10.0
"""Time to seek the reference besides turning to it, s."""
LIMIT: Final = rad_from_deg(360.0)
"""Largest angle of either axis and sign, rad."""
TOLERANCE: Final = rad_from_deg(0.01)
"""How far a commanded angle may be from a fixed position, rad; the index takes it there."""
BUTTON_HELD: Final = 10.0
"""How long a fault keeps the button of the emergency stop pressed, s."""

_HALFWAY: Final = (Kind.STALL, Kind.EMERGENCY_STOP)
"""What befalls a movement in its middle; the rest at its end."""

Angles = tuple[float, float]


class NotAllowed(ValueError):
    """The stand refuses in its present state."""


class EmergencyStopped(NotAllowed):
    """The emergency stop is engaged."""


class NoSuchPosition(ValueError):
    """No fixed position is there."""


@dataclass(frozen=True, slots=True)
class _Movement:
    """From where to where, and when; `seeks` tells one that seeks the reference."""

    start: Angles
    target: Angles
    begin: float
    end: float
    seeks: bool
    mishap: Kind | None

    @property
    def middle(self) -> float:
        return (self.begin + self.end) / 2

    def at(self, now: float) -> Angles:
        latest = self.middle if self.mishap in _HALFWAY else self.end
        part = (min(now, latest) - self.begin) / (self.end - self.begin)
        (theta, psi), (to_theta, to_psi) = self.start, self.target
        return theta + part * (to_theta - theta), psi + part * (to_psi - psi)


class Axes:
    """State of the axes, from the power-on of their controller: at 0, 0 and without reference."""

    def __init__(self, certificate: Certificate, clock: Clock) -> None:
        self._places = [
            Position(theta, psi)
            for theta, psi in zip(certificate.theta.tolist(), certificate.psi.tolist(), strict=True)
        ]
        self._clock = clock
        self._movement: _Movement | None = None
        self._rest: Angles = (0.0, 0.0)
        self._at_rest_since = -np.inf
        self._slip = 0.0
        self._referenced = False
        self._stopped = False
        self._held_until = -np.inf
        self.came_from: Angles | None = None
        """Where the case was when the last movement began; None before the first."""

    def fixed_position(self, theta: float, psi: float) -> Position:
        """The fixed position at these angles.

        Raises
        ------
        NoSuchPosition
            When there is none within `TOLERANCE`.
        """
        for place in self._places:
            if _apart(place.theta, theta) <= TOLERANCE and _apart(place.psi, psi) <= TOLERANCE:
                return place
        raise NoSuchPosition(f"no fixed position at {deg_from_rad(theta):g}, {deg_from_rad(psi):g} deg")

    @property
    def referenced(self) -> bool:
        """Whether the encoders' zero is known."""
        self._advance()
        return self._referenced

    @property
    def moving(self) -> bool:
        """Whether a movement goes on, be it stalled."""
        self._advance()
        return self._movement is not None

    @property
    def turning(self) -> bool:
        """Whether the case really turns."""
        self._advance()
        movement = self._movement
        return movement is not None and not (
            movement.mishap is Kind.STALL and self._clock.now() >= movement.middle
        )

    @property
    def seeking(self) -> bool:
        """Whether a movement seeks the reference."""
        self._advance()
        return self._movement is not None and self._movement.seeks

    @property
    def stopped(self) -> bool:
        """Whether the emergency stop is engaged: from its press until it is released and reset."""
        self._advance()
        return self._stopped

    @property
    def slipped(self) -> bool:
        """Whether the case is not where the encoders say."""
        self._advance()
        return self._slip != 0.0

    @property
    def at_rest_since(self) -> float:
        """When the last movement ended; −∞ before the first."""
        self._advance()
        movement = self._movement
        return self._at_rest_since if movement is None else movement.middle  # stalled there

    def encoders(self) -> Angles:
        """What the encoders say."""
        self._advance()
        return self._movement.at(self._clock.now()) if self._movement else self._rest

    def case(self) -> Angles:
        """Where the case is."""
        theta, psi = self.encoders()
        return theta, psi + self._slip

    def left(self) -> float:
        """Time to the end of the movement, s; 0 at rest, inf for one that does not end."""
        self._advance()
        movement = self._movement
        if movement is None:
            return 0.0
        return np.inf if movement.mishap is Kind.STALL else movement.end - self._clock.now()

    def home(self) -> None:
        """Begin to seek the reference, at 0, 0; a movement that goes on is given up for it.

        Raises
        ------
        EmergencyStopped
            While the emergency stop is engaged.
        """
        self._begin((0.0, 0.0), SEEKING, seeks=True)

    def move(self, theta: float, psi: float, mishap: Kind | None = None) -> None:
        """Begin to move; a movement that goes on is given up for it.

        Raises
        ------
        NotAllowed
            Without a reference, or while the emergency stop is engaged.
        """
        if not self.referenced and not self.stopped:
            raise NotAllowed("the axes have no reference: seek it with AXIS:HOME")
        self._begin((theta, psi), LOCKING, mishap=mishap)

    def stop(self) -> None:
        """Stop at once, wherever that is."""
        self._rest = self.encoders()
        if self._movement is not None:
            self._movement, self._at_rest_since = None, self._clock.now()

    def press(self) -> None:
        """Press the button of the emergency stop; it stays pressed until `release`."""
        self.stop()
        self._stopped, self._held_until = True, np.inf

    def release(self) -> None:
        """Let the button go; the stop stays engaged until `reset`."""
        self._held_until = -np.inf

    def reset(self) -> None:
        """Make the stand ready after an emergency stop.

        Raises
        ------
        NotAllowed
            While the button is pressed.
        """
        if self.stopped and self._clock.now() < self._held_until:
            raise NotAllowed("the button of the emergency stop is still pressed")
        self._stopped = False

    def _begin(
        self, target: Angles, extra: float, *, seeks: bool = False, mishap: Kind | None = None
    ) -> None:
        if self.stopped:
            raise EmergencyStopped
        start, now = self.encoders(), self._clock.now()
        turn = max(abs(to - at) for at, to in zip(start, target, strict=True))
        self.came_from, self._slip = self.case(), 0.0
        self._movement = _Movement(start, target, now, now + turn / SLEW_RATE + extra, seeks, mishap)
        self._referenced = self._referenced and not seeks

    def _advance(self) -> None:
        """Take the end of a movement into account, if it has come."""
        movement, now = self._movement, self._clock.now()
        if movement is None or movement.mishap is Kind.STALL:
            return
        ended = movement.middle if movement.mishap is Kind.EMERGENCY_STOP else movement.end
        if now < ended:
            return
        self._rest, self._movement, self._at_rest_since = movement.at(ended), None, ended
        if movement.mishap is Kind.EMERGENCY_STOP:
            self._stopped, self._held_until = True, ended + BUTTON_HELD
            return
        self._referenced = movement.mishap is not Kind.LOST_REFERENCE
        self._slip = WRONG_BY if movement.mishap is Kind.WRONG_POSITION else 0.0


def _apart(one: float, other: float) -> float:
    """Angle between two directions, rad."""
    return abs((one - other + np.pi) % (2 * np.pi) - np.pi)
