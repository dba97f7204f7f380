"""The automated cycle (the paper's Fig. 9): check, home, warm up, measure every position, close, send, solve.

What comes next follows from the journal alone (`app.station.plan`); this does it, and goes on after whatever
can be gone on after: an instrument that was lost is waited for, an emergency stop for its release and a person.
"""

from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from datetime import timedelta
from typing import Final

from app.errors import AppError, Problem, problem
from app.station.comparing import compare
from app.station.contracts import EmergencyStop, InstrumentFault, InstrumentLost, Place
from app.station.controls import StopAsked
from app.station.finishing import Finishing, NotFinished
from app.station.keeping.durable import SpoolFailed
from app.station.keeping.entries import Abandoned, Cooled, Said, Warmed
from app.station.keeping.history import LONGEST_BREAK
from app.station.measuring import TakeFailed, go, measure, settle
from app.station.plan import Compare, Finish, Forward, Measure, Prepare, Solve, Step, WarmUp, next_step
from app.station.preparing import Preparing
from app.station.sending.live import Phase
from app.station.workplace import Workplace
from solver.errors import Message

_FIRST_PAUSE_S: Final = 0.2
_COOLED: Final = Message(
    "maybe-cooled",
    "The power may have been away: the stand has lost its reference, or did not answer for long. It is waited until "
    "the gyro is warm.",
)
_LONGEST_PAUSE_S: Final = 10.0
"""Between attempts to reach a lost instrument, on the wall's clock."""


@dataclass(slots=True)
class Cycle:
    """A run at work.

    Attributes
    ----------
    attended
        Whether a person is near, who may release the emergency stop and let the cycle go on.
    release
        Whether the person who starts the program says that an emergency stop may be acknowledged.
    """

    at: Workplace
    preparing: Preparing
    finishing: Finishing
    attended: bool = False
    release: bool = False

    def run(self) -> None:
        """Go on until nothing is left to do.

        Raises
        ------
        NotFinished
            For a reason that has to be seen to; the run can be taken up again.
        StopAsked
            Somebody wants it to end here; likewise.
        """
        try:
            self._introduce()
            while not isinstance(step := self._next(), Finish):
                self._carefully(step)
            self.finishing.finish()
            self.at.live.turn_to("finished")
        except StopAsked:
            self._halt("stopped")
            raise
        except BaseException as error:
            self._tell(error)
            self._halt("failed")
            raise

    def _next(self) -> Step:
        return next_step(self.at.history, leave_out=self.finishing.leave_out)

    def _introduce(self) -> None:
        """Ask both instruments who they are. A run that has begun waits for them, a new one does not."""
        self.at.live.turn_to("checking")
        if isinstance(self._next(), Forward | Solve | Finish):
            return  # nothing is left to measure
        try:
            self._identify()
            self._heed_power()
        except InstrumentLost as lost:
            if not self.at.history.places:
                raise
            self._find_again(lost)
        if self.release:
            self._release()

    def _identify(self) -> None:
        self.at.stand.identify()
        self.at.ammeter.identify()

    def _carefully(self, step: Step) -> None:
        try:
            self._rest_while_paused()
            self._do(step)
        except InstrumentLost as lost:
            self._find_again(lost)
        except EmergencyStop as pressed:
            self._stand_still(pressed)
        except (TakeFailed, InstrumentFault) as failed:
            raise NotFinished(*failed.problems) from failed

    def _do(self, step: Step) -> None:
        match step:
            case Prepare():
                self.preparing.plan()
            case WarmUp():
                self._persist(self._warm_up)
            case Measure():
                measure(self.at, step.target)
            case Compare():
                compare(self.at)
            case Forward():
                self.finishing.forward()
            case Solve():
                self.finishing.solve()

    def _persist(self, action: Callable[[], None]) -> None:
        """Do what serves no single record; a failure is told, and it is tried once more before a person is."""
        try:
            action()
        except (TakeFailed, InstrumentFault) as failed:
            self.at.spool.note("error", failed.problems[0].message)
            action()

    def _warm_up(self) -> None:
        """Wait at the first position until the currents no longer creep."""
        at = self.at
        go(at, Place(*at.history.places[0]))
        settle(at)
        at.live.turn_to("warming")
        still, deadline = at.judge.warming(), at.clock.deadline(at.patience.warm_up_s)
        while True:
            at.watch()
            currents = at.ammeter.reading()
            warm = still.add(at.clock.lab_s(), currents)
            at.live.show(currents=currents, settled=warm is True)
            if warm:
                break
            if deadline.passed:
                raise TakeFailed(_not_warm(at.patience.warm_up_s / 60.0, creeping=warm is False))
            at.wait()
        at.spool.add(Warmed())

    def _rest_while_paused(self) -> None:
        self.at.heed()
        if not self.at.live.now.paused:
            return
        self.at.live.turn_to("paused")
        while self.at.live.now.paused:
            self.at.rest(_FIRST_PAUSE_S)

    def _find_again(self, lost: InstrumentLost) -> None:
        """Wait until both instruments answer; what is to be done then follows from how they stand."""
        at = self.at
        at.spool.note("warning", lost.problems[0].message)
        pause_s, since = _FIRST_PAUSE_S, at.clock.now()
        while True:
            at.rest(pause_s)
            try:
                self._identify()
                self._heed_power(away=at.clock.now() - since)
            except InstrumentLost:
                pause_s = min(2.0 * pause_s, _LONGEST_PAUSE_S)
            else:
                at.spool.note("info", Message("instruments-back", "Both instruments answer again."))
                return

    def _heed_power(self, away: timedelta = timedelta(0)) -> None:
        """Let the gyro warm up anew if it may have been without power: a stand loses its reference then."""
        at = self.at
        if at.history.warmed and (away > LONGEST_BREAK or self._lost_reference()):
            at.spool.add(Cooled(Said.of(_COOLED)))

    def _lost_reference(self) -> bool:
        try:
            return not self.at.stand.status().homed
        except InstrumentFault as fault:  # it reports an error of its own: nothing is sure
            self.at.spool.note("warning", fault.problems[0].message)
            return True

    def _stand_still(self, pressed: EmergencyStop) -> None:
        """An emergency stop: give the record up, and go on only when a person is there and says so.

        `resume` (from the page or the keyboard) is that person's word that all is safe; the stop itself has to
        be released at the stand before it.
        """
        at, message = self.at, pressed.problems[0].message
        attempt = at.history.open_attempt
        if attempt is not None and attempt.acquiring is not None:
            at.spool.add(Abandoned(attempt.number, Said.of(message)))
        if not self.attended:
            raise NotFinished(*pressed.problems) from pressed
        at.spool.note("error", message)
        at.live.turn_to("paused")
        at.live.show(paused=True)
        while at.live.now.paused:
            at.rest(_FIRST_PAUSE_S)
        self._release()

    def _release(self) -> None:
        """Acknowledge an emergency stop at a person's word; one that is still pressed is met again."""
        try:
            if self.at.stand.status().emergency_stop:
                self.at.stand.release()
        except InstrumentFault as refused:
            self.at.spool.note("error", refused.problems[0].message)
        except InstrumentLost as lost:
            self._find_again(lost)

    def _halt(self, phase: Phase) -> None:
        """Leave nothing moving; a stand that cannot be told is not moved by us either."""
        self.at.live.turn_to(phase)
        try:
            self.at.halt()
        except AppError as error:
            self._tell(error)

    def _tell(self, error: BaseException) -> None:
        """Let the log name what ended the cycle."""
        with suppress(SpoolFailed):  # that is why the cycle ends
            for item in error.problems if isinstance(error, AppError) else ():
                self.at.spool.note("error", item.message)


def _not_warm(minutes: float, *, creeping: bool) -> Problem:
    """Why the gyro is not known to be warm: it is seen to creep, or nothing is seen for noise."""
    if creeping:
        return problem(
            "not-warm",
            "The currents still creep after %(minutes).0f minutes. Look at the gyro's heating and start "
            "the same command again.",
            minutes=minutes,
        )
    return problem(
        "warmth-unknown",
        "After %(minutes).0f minutes the currents are still too noisy to tell whether they creep. Look for vibration "
        "or a loose plug; if this noise is the gyro's own, give [warm_up] in the station's file a longer window_s or "
        "a larger limit_na_per_s.",
        minutes=minutes,
    )
