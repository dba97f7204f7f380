"""What a stand's program reports while it runs, and how a run is shown."""

from collections.abc import Mapping
from dataclasses import dataclass
from datetime import datetime, timedelta
from typing import Any, Final, Literal, NamedTuple

Phase = Literal[
    "checking", "homing", "warming", "moving", "settling", "acquiring", "paused", "forwarding", "solving",
    "finished", "stopped", "failed",
]  # fmt: skip
CellPhase = Literal[
    "todo", "moving", "settling", "warming", "running", "recorded", "suspicious", "refused", "skipped"
]
Level = Literal["info", "warning", "error"]
CommandKind = Literal["pause", "resume", "skip", "retake", "stop"]
Outcome = Literal["done", "refused"]
CommandState = Literal["open", "done", "refused", "lapsed"]

ENDED: Final = ("finished", "stopped", "failed")
"""Phases after which a run reports no more."""

SILENT_AFTER: Final = timedelta(seconds=5)
"""A station reports about once a second; after so long without a word something is wrong."""

FORGOTTEN_AFTER: Final = timedelta(hours=1)
"""A run that neither ended nor was heard of for so long asks for nobody's attention any more."""


class Spot(NamedTuple):
    """Where a run is: a position, which measurement of it, and the how-manieth attempt at that."""

    theta_deg: float
    psi_deg: float
    repeat: int
    take: int


class CellState(NamedTuple):
    """How a position of the run stands."""

    theta_deg: float
    psi_deg: float
    repeat: int
    state: CellPhase


class Sentence(NamedTuple):
    """What a station says: in English, and as a template with its values where it can be translated."""

    message: str
    template: str | None = None
    values: Mapping[str, Any] | None = None


@dataclass(frozen=True, slots=True)
class RunEvent:
    """Something that a run met."""

    number: int
    at: datetime
    level: Level
    code: str
    said: Sentence
    theta_deg: float | None = None
    psi_deg: float | None = None


class Answered(NamedTuple):
    """What a run answers to a command."""

    id: int
    outcome: Outcome
    said: Sentence


@dataclass(frozen=True, slots=True)
class Report:
    """All that a run says at one moment; `sequence` grows from one report of a run to its next."""

    station: str
    run: str
    sequence: int
    sent_at: datetime
    phase: Phase
    position: Spot | None = None
    jx_ma: float | None = None
    jy_ma: float | None = None
    settled: bool | None = None
    fraction: float | None = None
    left_s: float | None = None
    waiting: int = 0
    cells: tuple[CellState, ...] = ()
    events: tuple[RunEvent, ...] = ()
    done: tuple[Answered, ...] = ()


class Reading(NamedTuple):
    """Both currents as they were reported, and whether they had settled; `at` is when the report came."""

    at: datetime
    jx_ma: float
    jy_ma: float
    settled: bool | None


@dataclass(frozen=True, slots=True)
class CommandView:
    """What somebody asked a run to do, and what became of it.

    `state` is lapsed when the run ended, or gave way to another, without an answer.
    """

    id: int
    kind: CommandKind
    theta_deg: float | None
    psi_deg: float | None
    asked_at: datetime
    asked_by: str
    answered_at: datetime | None
    state: CommandState
    said: Sentence


@dataclass(frozen=True, slots=True)
class StationAnswer:
    """What a station is told: open commands, the highest event stored and the highest report taken."""

    commands: tuple[CommandView, ...]
    events_seen: int
    sequence: int


@dataclass(frozen=True, slots=True)
class RunBrief:
    """A run in one line of a list."""

    phase: Phase
    settled: bool | None
    left_s: float | None
    received_at: datetime
    now: datetime

    @property
    def ended(self) -> bool:
        """Whether nothing more will come."""
        return self.phase in ENDED

    @property
    def silent(self) -> bool:
        """Whether a report should have come long ago."""
        return not self.ended and self.now - self.received_at > SILENT_AFTER

    @property
    def under_way(self) -> bool:
        """Whether somebody should look: it has not ended, and was heard of not so long ago."""
        return not self.ended and self.now - self.received_at < FORGOTTEN_AFTER


@dataclass(frozen=True, slots=True)
class RunView:
    """The present run of a session: its newest report as of `now`, commands and events (the newest first)."""

    id: int
    session: int
    station: str
    run: str
    started_at: datetime
    reported_by: str
    sequence: int
    sent_at: datetime
    received_at: datetime
    now: datetime
    phase: Phase
    position: Spot | None
    jx_ma: float | None
    jy_ma: float | None
    settled: bool | None
    fraction: float | None
    left_s: float | None
    waiting: int
    cells: tuple[CellState, ...]
    readings: tuple[Reading, ...]
    commands: tuple[CommandView, ...]
    events: tuple[RunEvent, ...]

    @property
    def age_s(self) -> float:
        """Seconds since the newest report."""
        return max(0.0, (self.now - self.received_at).total_seconds())

    @property
    def ended(self) -> bool:
        """Whether nothing more will come."""
        return self.phase in ENDED

    @property
    def silent(self) -> bool:
        """Whether a report should have come long ago."""
        return not self.ended and self.now - self.received_at > SILENT_AFTER

    @property
    def open_commands(self) -> tuple[CommandView, ...]:
        """What the station has not answered."""
        return tuple(item for item in self.commands if item.state == "open")
