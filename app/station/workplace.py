"""What the steps of the cycle work with, and what they look after whenever they wait."""

import time
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Final, Literal, Protocol

from app.errors import AppError, problem
from app.exchange.positions import same_angle
from app.station.clock import Clock
from app.station.contracts import Ammeter, EmergencyStop, Place, Stand, StandStatus
from app.station.controls import Command, Controls, Kind, StopAsked, TargetLeft
from app.station.judging import Judge
from app.station.keeping.entries import Abandoned, Commanded, Said, Target
from app.station.keeping.history import History
from app.station.keeping.spool import Spool
from app.station.sending.live import Live
from solver.errors import Message

_NAP_S: Final = 0.1
_MOMENT_S: Final = 0.05
"""On the wall's clock; real instruments are not asked more often than that."""
_DONE: Final[dict[Kind, Message]] = {
    "pause": Message("paused", "The cycle pauses after the record that is being measured."),
    "resume": Message("resumed", "The cycle goes on."),
    "skip": Message("skipped", "The operator left this position out."),
    "retake": Message("retaken", "The operator asked for this position to be measured anew."),
    "stop": Message("stop-asked", "The station stops; the same command takes the run up again."),
}

_UNKNOWN: Final = Message("no-such-target", "There is no such position in this cycle.")
_MEASURED: Final = Message(
    "already-measured", "This position has been measured; only one to come can be left out."
)


@dataclass(frozen=True, slots=True)
class Patience:
    """Longest waits, lab seconds."""

    home_s: float = 300.0
    move_s: float = 120.0
    settle_s: float = 600.0
    warm_up_s: float = 4 * 3600.0
    silence_s: float = 30.0
    """Without a new sample while the ammeter acquires."""


class ReleasableStand(Stand, Protocol):
    """A stand whose emergency stop is acknowledged by a command once its button is released."""

    def release(self) -> None:
        """Acknowledge it; only ever at a person's word."""


class Helper(Protocol):
    """A thread that works beside the cycle; `failed` is what ended it against its will."""

    failed: BaseException | None


@dataclass(slots=True)
class Workplace:
    """Instruments, spool, clock, and whoever wants something."""

    spool: Spool
    stand: ReleasableStand
    ammeter: Ammeter
    judge: Judge
    clock: Clock = field(default_factory=Clock)
    controls: Controls = field(default_factory=Controls)
    live: Live = field(default_factory=Live)
    patience: Patience = field(default_factory=Patience)
    helpers: Sequence[Helper] = ()
    at_place_deg: float = 0.01
    """How far the encoders may be from the place commanded."""
    block_samples: int = 2000
    lost: int = 0
    """Acquisitions lost one after the other since this program began."""
    _looked: tuple[float, StandStatus] | None = None

    @property
    def history(self) -> History:
        """What the journal says."""
        return self.spool.history

    def look(self) -> StandStatus:
        """Heed people, and see how the stand stands.

        Raises
        ------
        StopAsked, TargetLeft
            As `heed`.
        EmergencyStop
            It is pressed.
        """
        self.heed()
        status = self.stand.status()
        if status.emergency_stop:
            raise EmergencyStop(
                problem(
                    "emergency-stop", "The stand's emergency stop is pressed. Release it when all is safe."
                )
            )
        self._looked = time.monotonic(), status
        return status

    def watch(self) -> StandStatus:
        """`look`, unless that was a moment ago: between readings of fast simulated instruments."""
        if self._looked is None or time.monotonic() - self._looked[0] > _MOMENT_S:
            return self.look()
        self.heed()
        return self._looked[1]

    def halt(self) -> None:
        """Leave nothing moving: a stand that does not say that it stands is stopped. Raises as its `stop`."""
        try:
            moving = self.stand.status().moving
        except AppError:  # whatever it says, it may move
            moving = True
        if moving:
            self.stand.stop()

    def wait(self) -> None:
        """Let a little time pass until the instruments are asked again."""
        self.clock.nap()

    def rest(self, wall_s: float) -> None:
        """Let time on the wall's clock pass, heeding people; raises as `heed`."""
        deadline = time.monotonic() + wall_s
        self.heed()
        while (left := deadline - time.monotonic()) > 0:
            time.sleep(min(left, _NAP_S))
            self.heed()

    def heed(self) -> None:
        """Obey what was asked since the last time.

        Raises
        ------
        StopAsked
            The cycle shall end here.
        TargetLeft
            The record being measured was skipped or shall be begun anew; its attempt is abandoned.
        """
        for helper in self.helpers:
            if helper.failed is not None:
                raise helper.failed
        while (command := self.controls.take()) is not None:
            if command.id not in self.history.commands:
                self._obey(command)
        if self.controls.stopped_by is not None:
            raise StopAsked(self.controls.stopped_by)

    def _obey(self, command: Command) -> None:
        if command.kind in ("skip", "retake"):
            self._turn_away(command)
            return
        self._answer(command, "done", _DONE[command.kind])
        if command.kind == "stop":
            self.controls.stopped_by = "page"
        else:
            self.live.show(paused=command.kind == "pause")

    def _turn_away(self, command: Command) -> None:
        """Skip a target or ask for it anew; leave it if it is the one at hand."""
        attempt = self.history.open_attempt
        target = self._meant(command.place)
        if target is None:
            self._answer(command, "refused", _UNKNOWN)
            return
        if command.kind == "skip" and not self.history.wanted(target):
            self._answer(command, "refused", _MEASURED)
            return
        said = _DONE[command.kind]
        self._answer(command, "done", said, target)
        if attempt is not None and attempt.target == target:
            self.spool.add(Abandoned(attempt.number, Said.of(said)))
            raise TargetLeft

    def _meant(self, place: Place | None) -> Target | None:
        """The target that a command is about: the one at hand when it is there or no place is named."""
        attempt = self.history.open_attempt
        if attempt is not None and (place is None or same_place(attempt.target.place, place)):
            return attempt.target
        if place is None:
            return None
        return next((target for target in self.history.targets if same_place(target.place, place)), None)

    def _answer(
        self,
        command: Command,
        outcome: Literal["done", "refused"],
        said: Message,
        target: Target | None = None,
    ) -> None:
        self.spool.add(Commanded(command.id, command.kind, outcome, Said.of(said), target))


def same_place(one: Place, other: Place) -> bool:
    """Whether two places are one."""
    return all(same_angle(a, b) for a, b in zip(one, other, strict=True))
