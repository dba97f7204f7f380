"""The two axes of a stand with fixed positions, as they move: where the case is, and what the encoders say.

Both axes turn at `SLEW_RATE` at the same time and then lock into the index. Movement is a function of
laboratory time: nothing runs between two questions.
"""

from dataclasses import dataclass
from typing import Final

import numpy as np

from simdevice.certificate import Certificate, Position
from simdevice.clock import Clock
from solver.units import deg_from_rad, rad_from_deg

SLEW_RATE: Final = rad_from_deg(30.0)
"""rad/s."""
LOCKING: Final = 1.0
"""Time of a movement beyond its turning, s."""
SEEKING: Final = 10.0
"""Time to seek the reference, beyond turning to it, s."""
LIMIT: Final = rad_from_deg(360.0)
"""Largest angle of either axis and sign, rad."""
TOLERANCE: Final = rad_from_deg(0.01)
"""How far a commanded angle may be from a fixed position, rad; the index takes it there."""
BUTTON_HELD: Final = 10.0
"""How long the emergency stop stays pressed when a fault pressed it, s."""

Angles = tuple[float, float]


class NotAllowed(ValueError):
    """The stand refuses in its present state."""


class EmergencyStopped(NotAllowed):
    """The emergency stop is engaged."""


class NoSuchPosition(ValueError):
    """No fixed position is there."""


@dataclass(frozen=True, slots=True)
class _Movement:
    """From where to where, s of laboratory time; `mishap` is the kind of fault that befalls it, or empty."""

    start: Angles
    target: Angles
    begin: float
    end: float
    seeks_reference: bool
    mishap: str = ""

    def at(self, now: float) -> Angles:
        part = min(max((now - self.begin) / (self.end - self.begin), 0.0), 1.0)
        if self.mishap in ("stall", "emergency-stop"):
            part = min(part, 0.5)
        (theta, psi), (to_theta, to_psi) = self.start, self.target
        return theta + part * (to_theta - theta), psi + part * (to_psi - psi)


class Axes:
    """State of the axes. Angles in rad, times in s of the laboratory's clock."""

    def __init__(self, certificate: Certificate, clock: Clock) -> None:
        self._places = [
            Position(theta, psi)
            for theta, psi in zip(certificate.theta.tolist(), certificate.psi.tolist(), strict=True)
        ]
        self._clock = clock
        self._movement: _Movement | None = None
        self._rest: Angles = (0.0, 0.0)
        self._slip = 0.0
        self._referenced = False
        self._stopped = False
        self._held_until = -np.inf
        self.movements = 0
        self.last_end = -np.inf
        """When the last movement ended."""

    def nearest(self, theta: float, psi: float) -> Position:
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
    def seeking(self) -> bool:
        """Whether that movement seeks the reference."""
        return self.moving and self._movement is not None and self._movement.seeks_reference

    @property
    def stopped(self) -> bool:
        """Whether the emergency stop is engaged: from its press until it is released and reset."""
        self._advance()
        return self._stopped

    @property
    def held(self) -> bool:
        """Whether the button of the emergency stop is pressed still."""
        return self.stopped and self._clock.now() < self._held_until

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
        return np.inf if movement.mishap == "stall" else max(movement.end - self._clock.now(), 0.0)

    def home(self) -> None:
        """Begin to seek the reference, at 0, 0."""
        self._begin((0.0, 0.0), SEEKING, seeks_reference=True)

    def move(self, theta: float, psi: float, mishap: str = "") -> None:
        """Begin to move to a fixed position; one that goes on is given up for it.

        Raises
        ------
        NotAllowed
            Without a reference, or after an emergency stop.
        """
        if not self.referenced and not self.stopped:
            raise NotAllowed("the axes have no reference: seek it first, AXIS:HOME")
        self._begin((theta, psi), LOCKING, mishap=mishap)

    def stop(self) -> None:
        """Stop at once, wherever that is."""
        self._halt()

    def press(self) -> None:
        """Press the button of the emergency stop; it stays pressed until `release`."""
        self._halt()
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
        if self.held:
            raise NotAllowed("the button is still pressed: release it first")
        self._stopped = False

    def _begin(
        self, target: Angles, extra: float, *, seeks_reference: bool = False, mishap: str = ""
    ) -> None:
        if self.stopped:
            raise EmergencyStopped
        start = self.case() if seeks_reference else self.encoders()
        now = self._clock.now()
        turn = max(abs(to - at) for at, to in zip(start, target, strict=True))
        self._movement = _Movement(
            start, target, now, now + turn / SLEW_RATE + extra, seeks_reference, mishap
        )
        self._slip = 0.0
        self._referenced = self._referenced and not seeks_reference
        self.movements += 1

    def _advance(self) -> None:
        """Take the end of a movement into account, if it has come."""
        movement, now = self._movement, self._clock.now()
        if movement is None or movement.mishap == "stall":
            return
        if movement.mishap == "emergency-stop" and now >= (middle := (movement.begin + movement.end) / 2):
            self._rest, self._movement, self.last_end = movement.at(middle), None, middle
            self._stopped, self._held_until = True, middle + BUTTON_HELD
        elif now >= movement.end:
            self._rest, self._movement, self.last_end = movement.target, None, movement.end
            self._referenced = movement.mishap != "lost-reference"
            self._slip = np.pi / 2 if movement.mishap == "wrong-position" else 0.0

    def _halt(self) -> None:
        self._rest = self.encoders()
        if self._movement is not None:
            self._movement, self.last_end = None, self._clock.now()


def _apart(one: float, other: float) -> float:
    """Angle between two directions, rad."""
    return abs((one - other + np.pi) % (2 * np.pi) - np.pi)
