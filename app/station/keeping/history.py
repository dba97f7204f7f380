"""How a run stands, folded from its journal: which takes there are of each target, what is sent, what was said."""

from dataclasses import dataclass, field, replace
from datetime import datetime, timedelta
from typing import Final

from app.station.contracts import Place
from app.station.keeping.entries import (
    Abandoned,
    Acquiring,
    Begun,
    Commanded,
    Compared,
    Cooled,
    Damaged,
    Entry,
    Finding,
    Finished,
    Judged,
    Level,
    Noted,
    Opened,
    Planned,
    Queued,
    Rejected,
    Resumed,
    Said,
    Sent,
    Solved,
    Started,
    Target,
    Unsolved,
    Verdict,
    Warmed,
)

LONGEST_BREAK: Final = timedelta(minutes=10)
"""Nobody knows what happened to the gyro while the station looked away for longer."""


@dataclass(frozen=True, slots=True)
class Event:
    """What a person should know, numbered from 1 as the journal tells it."""

    number: int
    at: datetime
    level: Level
    said: Said
    place: Place | None


@dataclass(slots=True)
class Attempt:
    """One try to measure a target: open until it is `abandoned` or `judged`."""

    started: Started
    acquiring: Acquiring | None = None
    abandoned: Said | None = None
    judged: Judged | None = None
    refuted: Said | None = None
    sent: bool = False
    rejected: Said | None = None

    @property
    def number(self) -> int:
        """Its number in the run, from 0."""
        return self.started.attempt

    @property
    def target(self) -> Target:
        """What it measures."""
        return self.started.target

    @property
    def open(self) -> bool:
        """Whether the cycle is still at it."""
        return self.abandoned is None and self.judged is None

    @property
    def verdict(self) -> Verdict | None:
        """What it is worth; None while it is not judged."""
        if self.judged is None:
            return None
        return "refused" if self.refuted is not None else self.judged.verdict


@dataclass(slots=True)
class History:
    """What the journal says."""

    begun: Begun | None = None
    starts: int = 0
    """How often a program took the run up."""
    places: tuple[Place, ...] = ()
    gyro_type: str | None = None
    turned_arcsec: float | None = None
    """Largest rotation that the stand's certificate states, None where none was heard of."""
    session: int | None = None
    warmed: bool = False
    last_at: datetime | None = None
    """When the newest line was written."""
    attempts: list[Attempt] = field(default_factory=list)
    asked_after: dict[Target, int] = field(default_factory=dict)
    """Number of takes that there were of a target when it was last asked for anew."""
    doubted: set[Target] = field(default_factory=set)
    """Targets measured anew because others disagreed; once is enough."""
    compared: bool = True
    """Whether all takes that count have been seen beside each other."""
    skipped: set[Target] = field(default_factory=set)
    events: list[Event] = field(default_factory=list)
    commands: dict[int, Commanded] = field(default_factory=dict)
    job: str | None = None
    result: str | None = None
    finished: Finished | None = None

    def apply(self, at: datetime, entry: Entry) -> None:
        """Take in the next line, written at that moment."""
        self._tell(at, entry)
        match entry:
            case Begun():
                self.begun = entry
            case Resumed():
                self.starts += 1
                if self.last_at is not None and at - self.last_at > LONGEST_BREAK:
                    self.warmed = False
            case Planned():
                self.places, self.gyro_type = entry.places, entry.gyro_type
                self.turned_arcsec = entry.turned_arcsec
            case Opened():
                self.session = entry.session
            case Warmed():
                self.warmed = True
            case Cooled():
                self.warmed = False
            case Damaged():
                self._spoil(self.attempts[entry.attempt], entry.why)
            case Started():
                self.attempts.append(Attempt(entry))
            case Compared():
                self._compare(entry)
            case Commanded():
                self.commands[entry.command] = entry
                self._obey(entry)
            case Queued():
                self.job = entry.job
            case Solved():
                self.result = entry.result
            case Unsolved():
                self.job = None
            case Finished():
                self.finished = entry
            case Noted():
                pass
            case _:
                self.compared = self.compared and not isinstance(entry, Judged)
                _of_attempt(self.attempts[entry.attempt], entry)
        self.last_at = at

    def _tell(self, at: datetime, entry: Entry) -> None:
        """Number what a person should know of a line."""
        if isinstance(entry, Noted):
            self._event(at, entry.level, entry.said, entry.place)
        elif isinstance(entry, Judged):
            place = self.attempts[entry.attempt].target.place
            for finding in entry.findings:
                level: Level = "error" if finding.verdict == "refused" else "warning"
                self._event(at, level, finding.said, place)
        elif isinstance(entry, Compared):
            for level, doubts in (("warning", entry.doubted), ("error", entry.refuted)):
                for doubt in doubts:
                    self._event(at, level, doubt.said, doubt.target.place)
        elif isinstance(entry, Rejected):
            place = self.attempts[entry.attempt].target.place
            self._event(at, "error", entry.why, place)
        elif isinstance(entry, Abandoned):
            place = self.attempts[entry.attempt].target.place
            self._event(at, "warning", entry.why, place)
        elif isinstance(entry, Damaged):
            place = self.attempts[entry.attempt].target.place
            self._event(at, "error", entry.why, place)
        elif isinstance(entry, Cooled):
            self._event(at, "warning", entry.why, None)
        elif isinstance(entry, Finished):
            for reason in entry.reasons:
                self._event(at, "warning" if self.result else "error", reason, None)

    def _event(self, at: datetime, level: Level, said: Said, place: Place | None) -> None:
        self.events.append(Event(len(self.events) + 1, at, level, said, place))

    def _compare(self, entry: Compared) -> None:
        self.compared = True
        for attempt in self.attempts:
            attempt.refuted = None
        for doubt in entry.refuted:
            standing = self.standing(doubt.target)
            if standing is not None:
                standing.refuted = doubt.said
        for doubt in entry.doubted:
            self.doubted.add(doubt.target)
            self._ask_anew(doubt.target)

    def _obey(self, entry: Commanded) -> None:
        if entry.outcome == "refused" or entry.target is None:
            return
        if entry.what == "skip":
            self.skipped.add(entry.target)
            self.compared = False  # what waited for this target's next take waits no longer
        elif entry.what == "retake":
            self._ask_anew(entry.target)

    def _spoil(self, attempt: Attempt, why: Said) -> None:
        """Let a take count for nothing, and want another if it was the one that counted."""
        assert attempt.judged is not None
        attempt.judged = replace(attempt.judged, verdict="refused", findings=(Finding(why),))
        if self.standing(attempt.target) is attempt:
            self._ask_anew(attempt.target)

    def _ask_anew(self, target: Target) -> None:
        """Want further takes; of what is compared with this target (the closing record with the first) too."""
        self.skipped.discard(target)
        self.asked_after[target] = len(self.takes(target))
        self.job = self.result = self.finished = None  # they rest on what is now measured anew
        if self.places and target == self.targets[0]:
            self.asked_after[self.targets[-1]] = len(self.takes(self.targets[-1]))

    @property
    def targets(self) -> tuple[Target, ...]:
        """Every record of the cycle: each position once, and the first again to close."""
        if not self.places:
            return ()
        return *(Target(*place) for place in self.places), Target(*self.places[0], repeat=1)

    @property
    def open_attempt(self) -> Attempt | None:
        """The attempt that goes on, or went on when the station was stopped."""
        return self.attempts[-1] if self.attempts and self.attempts[-1].open else None

    def on_server(self, target: Target) -> bool:
        """Whether the service has any take of a target."""
        return any(item.sent for item in self.takes(target))

    def takes(self, target: Target) -> list[Attempt]:
        """The judged takes of a target, in order."""
        return [item for item in self.attempts if item.judged is not None and item.target == target]

    def takes_at(self, place: Place) -> int:
        """How often a place has been measured, as the first record or the closing one."""
        return sum(item.judged is not None and item.target.place == place for item in self.attempts)

    def standing(self, target: Target) -> Attempt | None:
        """The take that counts: the last one."""
        takes = self.takes(target)
        return takes[-1] if takes else None

    def candidate(self, target: Target) -> Attempt | None:
        """The take that counts, if it is good by itself, whatever the others say."""
        found = self.standing(target)
        judged = found.judged if found is not None else None
        return None if judged is None or judged.verdict == "refused" else found

    def usable(self, target: Target) -> Attempt | None:
        """The take that counts, if it is good, or the last of suspicious ones."""
        found = self.standing(target)
        if found is None or found.verdict == "refused":
            return None
        return found if found.verdict == "accepted" or not self.wanted(target) else None

    def wanted(self, target: Target) -> bool:
        """Whether it is to be measured: never yet, asked for anew, or once more because a check failed."""
        if target in self.skipped:
            return False
        since = [item.judged for item in self.takes(target)[self.asked_after.get(target, 0) :]]
        return not since or (len(since) == 1 and since[0] is not None and since[0].verdict != "accepted")

    def to_send(self) -> list[Attempt]:
        """Takes that count and the service has not answered for, in the order of measuring."""
        usable = {id(self.usable(target)) for target in self.targets}
        return [
            item for item in self.attempts if id(item) in usable and not item.sent and item.rejected is None
        ]


def _of_attempt(attempt: Attempt, entry: Acquiring | Abandoned | Judged | Sent | Rejected) -> None:
    match entry:
        case Acquiring():
            attempt.acquiring = entry
        case Abandoned():
            attempt.abandoned = entry.why
        case Judged():
            attempt.judged = entry
        case Sent():
            attempt.sent = True
        case Rejected():
            attempt.rejected = entry.why
