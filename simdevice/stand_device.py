"""The stand's commands; angles in degrees on the wire.

======================== ======================================================================
``AXIS:HOME``            begin to seek the reference
``AXIS:REFerence?``      1 when the reference is known
``AXIS:POSition θ,ψ``    begin to move to a fixed position; a movement that goes on is given up
``AXIS:POSition?``       what the encoders say
``AXIS:MOVing?``         1 while a movement goes on
``AXIS:LIMit?``          smallest and largest θ, smallest and largest ψ
``SAFety:ESTop?``        1 from the press of the emergency stop until it is released and reset
``SAFety:ESTop:PRESs b`` the hand on the button, for trying it out: ON presses, OFF releases
``SAFety:RESet``         ready again, once the button is released
``ABORt``                stop at once
======================== ======================================================================

A stand that was just switched on stands at 0, 0 and must seek its reference. A fault that presses the
emergency stop keeps its button pressed for 10 s.

STATus:OPERation: 256 moving, 512 seeking the reference. STATus:QUEStionable: 512 no reference,
1024 emergency stop.
"""

from collections.abc import Sequence
from typing import Final

from simdevice.axes import LIMIT, EmergencyStopped, NoSuchPosition, NotAllowed
from simdevice.laboratory import Laboratory
from simdevice.scpi.errors import ScpiError
from simdevice.scpi.tree import Command, Real, Switch
from solver.units import deg_from_rad, rad_from_deg

_MOVING, _SEEKING = 256, 512
_UNREFERENCED, _STOPPED = 512, 1024
_LIMIT_DEG: Final = round(deg_from_rad(LIMIT), 6)
_ANGLE: Final = Real(-_LIMIT_DEG, _LIMIT_DEG, "DEG")


class StandDevice:
    """The stand as an instrument (`simdevice.scpi.instrument.Device`)."""

    def __init__(self, laboratory: Laboratory, identity: str) -> None:
        self._laboratory = laboratory
        self._axes = laboratory.axes
        self.identity = identity

    @property
    def commands(self) -> Sequence[Command]:
        """As the module says."""
        axes = self._axes
        return [
            Command("AXIS:HOME", self._home),
            Command("AXIS:REFerence?", lambda: str(int(axes.referenced))),
            Command("AXIS:POSition", self._move, [_ANGLE, _ANGLE]),
            Command("AXIS:POSition?", lambda: _degrees(axes.encoders())),
            Command("AXIS:MOVing?", lambda: str(int(axes.moving))),
            Command("AXIS:LIMit?", lambda: _degrees((-LIMIT, LIMIT) * 2)),
            Command("SAFety:ESTop?", lambda: str(int(axes.stopped))),
            Command("SAFety:ESTop:PRESs", lambda on: axes.press() if on else axes.release(), [Switch()]),
            Command("SAFety:RESet", self._reset_safety),
        ]

    def pending(self) -> float:
        """Seconds of wall clock to the end of a movement."""
        return self._laboratory.clock.wall_seconds(self._axes.left())

    def operation(self) -> int:
        """See the module."""
        return _MOVING * self._axes.moving | _SEEKING * self._axes.seeking

    def questionable(self) -> int:
        """See the module."""
        return _UNREFERENCED * (not self._axes.referenced) | _STOPPED * self._axes.stopped

    def reset(self) -> None:
        """Stop; reference and emergency stop are no settings and stay."""
        self._axes.stop()

    abort = reset

    def _home(self) -> None:
        try:
            self._laboratory.home()
        except NotAllowed as error:
            raise _refusal(error) from None

    def _move(self, theta_deg: float, psi_deg: float) -> None:
        try:
            self._laboratory.move(rad_from_deg(theta_deg), rad_from_deg(psi_deg))
        except NoSuchPosition as error:
            raise ScpiError(-224, str(error)) from None
        except NotAllowed as error:
            raise _refusal(error) from None

    def _reset_safety(self) -> None:
        try:
            self._axes.reset()
        except NotAllowed as error:
            raise _refusal(error) from None


def _refusal(error: NotAllowed) -> ScpiError:
    if isinstance(error, EmergencyStopped):
        return ScpiError(101, "release the button and send SAFety:RESet", text="Emergency stop")
    return ScpiError(-221, str(error))


def _degrees(angles: Sequence[float]) -> str:
    return ",".join(f"{deg_from_rad(angle) + 0.0:.4f}" for angle in angles)
