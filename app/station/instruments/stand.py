"""The driver of any two-axis stand that a station's file describes."""

from app.errors import Invalid, problem
from app.station.contracts import EmergencyStop, InstrumentFault, Place, StandStatus
from app.station.instruments.description import StandDescription, Travel
from app.station.instruments.dialogue import Answers, Dialogue
from solver.units import ARCSEC_PER_DEG, rad_from_deg

_TURN_DEG = 360.0


def apart_deg(first: Place, second: Place) -> float:
    """The larger of the angles, deg, between two places' θ and ψ; 359° and 1° are 2° apart."""
    return max(abs(_turn(one, other)) for one, other in zip(first, second, strict=True))


def check_travel(description: StandDescription, place: Place) -> None:
    """Refuse a place that the stand cannot go to.

    Raises
    ------
    Invalid
        When no angle that equals θ or ψ lies within the description's travel.
    """
    _within(place.theta_deg, description.theta, "θ")
    _within(place.psi_deg, description.psi, "ψ")


class DescribedStand:
    """A stand behind a dialogue; implements `app.station.contracts.Stand`.

    Angles a whole turn apart are equal: a place is approached by the equal angle that lies within the
    stand's travel, and the encoders are told as the equal nearest to the place commanded.
    """

    def __init__(self, description: StandDescription) -> None:
        self._description = description
        self._dialogue = Dialogue(
            description.connection, description.identify, description.identity, description.errors
        )
        self._commanded: Place | None = None
        self._before: Place | None = None

    def identify(self) -> str:
        """Who it says it is; raises `InstrumentFault` when that is not who the description names."""
        return self._dialogue.identify()

    def home(self) -> None:
        """Begin to seek the reference; raises `EmergencyStop` when that is pressed, and sends nothing."""
        with self._dialogue.lock:
            self._refuse_while_stopped()
            self._commanded = self._before = None
            self._dialogue.perform(self._description.home)

    def move(self, place: Place) -> None:
        """Begin to move there.

        Raises
        ------
        Invalid
            Beyond the travel of the description; nothing was sent.
        EmergencyStop
            When that is pressed; nothing was sent.
        """
        theta = _within(place.theta_deg, self._description.theta, "θ")
        psi = _within(place.psi_deg, self._description.psi, "ψ")
        with self._dialogue.lock:
            self._refuse_while_stopped()
            self._commanded, self._before = place, None
            self._dialogue.perform(self._description.move, _in_units(theta=theta, psi=psi))

    def status(self) -> StandStatus:
        """How it stands now.

        Raises
        ------
        InstrumentFault
            For an error that it reports; while the emergency stop is pressed its flag says all.
        """
        with self._dialogue.lock:
            status, errors = self._status()
            if errors and not status.emergency_stop:
                raise self._dialogue.fault(errors, self._description.status.exchanges[-1].send)
            return status

    def stop(self) -> None:
        """Stop at once."""
        self._dialogue.perform(self._description.stop)

    def release(self) -> None:
        """Acknowledge an emergency stop that a person has released; never done by itself.

        Raises
        ------
        InstrumentFault
            Also when the description knows no such command.
        """
        if self._description.release is None:
            raise InstrumentFault(
                problem(
                    "no-release",
                    "The station's file has no command “release”. Release the emergency stop at the stand itself.",
                )
            )
        self._dialogue.perform(self._description.release)

    def close(self) -> None:
        """Close the connection; the next command opens another."""
        self._dialogue.close()

    def _status(self) -> tuple[StandStatus, list[str]]:
        answers = self._dialogue.ask(self._description.status)
        told = Place(answers.number("theta"), answers.number("psi"))
        status = StandStatus(
            homed=answers.flag("homed"),
            moving=self._moving(answers, told),
            emergency_stop=answers.flag("emergency_stop"),
            place=_near(told, self._commanded) if self._commanded else told,
        )
        return status, self._dialogue.reported()

    def _moving(self, answers: Answers, now: Place) -> bool:
        """As told; a stand that does not tell it moves as long as its encoders change between two looks."""
        if "moving" in answers.values:
            return answers.flag("moving")
        before, self._before = self._before, now
        return before is None or apart_deg(before, now) > self._description.rest_deg

    def _refuse_while_stopped(self) -> None:
        status, errors = self._status()
        if status.emergency_stop:
            raise EmergencyStop(
                problem(
                    "emergency-stop",
                    "The stand's emergency stop is pressed; nothing moves. Make sure that nobody is in danger, "
                    "release it at the stand, then go on.",
                )
            )
        if errors:
            raise self._dialogue.fault(errors, self._description.status.exchanges[-1].send)


def _turn(angle: float, other: float) -> float:
    """The turn from `other` to `angle`, deg, at most half a turn either way."""
    return (angle - other + _TURN_DEG / 2) % _TURN_DEG - _TURN_DEG / 2


def _near(told: Place, commanded: Place) -> Place:
    return Place(*(want + _turn(angle, want) for angle, want in zip(told, commanded, strict=True)))


def _within(angle: float, travel: Travel, axis: str) -> float:
    """The angle itself, or the equal one that lies within the travel."""
    for turns in (0, -1, 1):
        if travel.smallest_deg <= angle + turns * _TURN_DEG <= travel.largest_deg:
            return angle + turns * _TURN_DEG
    raise Invalid(
        problem(
            "beyond-travel",
            "The stand cannot go to %(axis)s = %(angle)g°: it travels from %(smallest)g° to %(largest)g°. Give "
            "--positions without it, or correct the limits in the station's file.",
            axis=axis,
            angle=angle,
            smallest=travel.smallest_deg,
            largest=travel.largest_deg,
        )
    )


def _in_units(**angles: float) -> dict[str, float]:
    """Each angle under its name with the unit: ``theta_deg``, ``theta_arcsec``, ``theta_rad``."""
    values = {}
    for name, angle in angles.items():
        values[f"{name}_deg"] = angle
        values[f"{name}_arcsec"] = angle * ARCSEC_PER_DEG
        values[f"{name}_rad"] = rad_from_deg(angle)
    return values
