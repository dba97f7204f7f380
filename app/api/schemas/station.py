"""What a stand's program reports, what it is answered, and what people ask of it."""

from datetime import datetime
from typing import Annotated, Any, Final, Self

from pydantic import ConfigDict, Field, model_validator

from app.api.schemas.common import Angle, Id, Incoming, Moment, Name, NotNegative, Number, Outgoing, Text
from app.api.schemas.measuring import Repeat
from app.services.live_views import (
    Answered,
    CellPhase,
    CellState,
    CommandKind,
    CommandState,
    CommandView,
    Level,
    Outcome,
    Phase,
    Report,
    RunEvent,
    RunView,
    Sentence,
    Spot,
)

MOST_CELLS: Final = 1000
MOST_EVENTS: Final = 200
_LAST_NUMBER: Final = 100_000
_LARGEST_WHOLE: Final = 2**53 - 1
"""Above it JSON numbers are no whole numbers any more in many languages."""

Current = Annotated[Number, Field(ge=-1e6, le=1e6)]
Left = Annotated[NotNegative, Field(le=366 * 86_400)]
Whole = Annotated[int, Field(strict=True, ge=0, le=_LARGEST_WHOLE)]
Take = Annotated[int, Field(strict=True, ge=0, lt=10_000, description="0 first attempt, 1 the next.")]
Value = Number | Annotated[int, Field(strict=True)] | Annotated[bool, Field(strict=True)] | Text | None


class Said(Incoming):
    """A sentence; with `template` and `values` it can be shown in the reader's language too."""

    message: Annotated[Text, Field(description="The sentence in English.")]
    template: Annotated[
        Text | None, Field(description="The same with `%(name)s` placeholders, as the catalogue has it.")
    ] = None
    values: Annotated[
        dict[Name, Value] | None, Field(max_length=20, description="What the placeholders stand for.")
    ] = None

    def said(self) -> Sentence:
        """As the services take it."""
        return Sentence(self.message, self.template, self.values)


class RunPosition(Incoming):
    """Where the station is, and what it measures there."""

    theta_deg: Angle
    psi_deg: Angle
    repeat: Repeat = 0
    take: Take = 0


class RunCell(Incoming):
    """How a position of the run stands."""

    theta_deg: Angle
    psi_deg: Angle
    repeat: Repeat = 0
    state: CellPhase


class ReportedEvent(Said):
    """Something that the run met. Its number counts from 1 in the run."""

    number: Annotated[int, Field(strict=True, ge=1, le=_LAST_NUMBER)]
    at: Moment
    level: Level
    code: Name
    theta_deg: Angle | None = None
    psi_deg: Angle | None = None


class CommandAnswer(Said):
    """What became of a command."""

    id: Id
    outcome: Outcome
    message: Text = ""


class StationReport(Incoming):
    """All that a run of a stand's program says at one moment; it replaces the run's report before.

    `sequence` grows with each report of the run. Events are sent again until `events_seen` of an answer
    reaches their number, `done` until the command is not answered any more.
    """

    model_config = ConfigDict(
        json_schema_extra={
            "examples": [
                {
                    "station": "S1-PC",
                    "run": "0b9f3c1e-52f7-4f0c-9a43-1f6d6c1f2a10",
                    "sequence": 412,
                    "sent_at": "2026-03-01T09:41:07.250Z",
                    "phase": "acquiring",
                    "position": {"theta_deg": 90, "psi_deg": 180, "repeat": 0, "take": 1},
                    "jx_ma": 0.004536,
                    "jy_ma": -0.002117,
                    "settled": True,
                    "fraction": 0.42,
                    "left_s": 803.5,
                    "waiting": 1,
                    "cells": [
                        {"theta_deg": 0, "psi_deg": 0, "repeat": 0, "state": "recorded"},
                        {"theta_deg": 90, "psi_deg": 180, "repeat": 0, "state": "running"},
                        {"theta_deg": 0, "psi_deg": 0, "repeat": 1, "state": "todo"},
                    ],
                    "events": [
                        {
                            "number": 7,
                            "at": "2026-03-01T09:39:55Z",
                            "level": "warning",
                            "code": "spike",
                            "message": "The record has a spike of 41 standard deviations; it is measured again.",
                            "theta_deg": 90,
                            "psi_deg": 180,
                        }
                    ],
                    "done": [{"id": 3, "outcome": "done", "message": "The cycle goes on."}],
                }
            ]
        }
    )

    station: Annotated[Name, Field(description="What people call the stand's computer.")]
    run: Annotated[Name, Field(description="Identity of the run, a UUID say; the same after a restart.")]
    sequence: Whole
    sent_at: Annotated[Moment, Field(description="By the station's clock; the age is counted by ours.")]
    phase: Phase
    position: RunPosition | None = None
    jx_ma: Annotated[Current | None, Field(description="Both currents now.")] = None
    jy_ma: Current | None = None
    settled: Annotated[bool, Field(strict=True)] | None = None
    fraction: Annotated[Number | None, Field(ge=0, le=1, description="Of the present record.")] = None
    left_s: Annotated[Left | None, Field(description="To the end of the cycle.")] = None
    waiting: Annotated[Whole, Field(description="Records on the station's disk that are not sent yet.")] = 0
    cells: list[RunCell] = Field(default_factory=list, max_length=MOST_CELLS)
    events: list[ReportedEvent] = Field(default_factory=list, max_length=MOST_EVENTS)
    done: list[CommandAnswer] = Field(default_factory=list, max_length=100)

    def report(self) -> Report:
        """As the services take it."""
        plain = self.model_dump(exclude={"position", "cells", "events", "done"})
        where = self.position
        return Report(
            **plain,
            position=Spot(where.theta_deg, where.psi_deg, where.repeat, where.take) if where else None,
            cells=tuple(CellState(cell.theta_deg, cell.psi_deg, cell.repeat, cell.state) for cell in self.cells),
            events=tuple(
                RunEvent(item.number, item.at, item.level, item.code, item.said(), item.theta_deg, item.psi_deg)
                for item in self.events
            ),
            done=tuple(Answered(item.id, item.outcome, item.said()) for item in self.done),
        )  # fmt: skip


class OpenCommand(Outgoing):
    """What the station is asked to do; answered until it says what became of it."""

    id: int
    kind: CommandKind
    theta_deg: float | None
    psi_deg: float | None


class ReportTaken(Outgoing):
    """What the station is told: open commands, the highest event stored, the highest report taken."""

    model_config = ConfigDict(
        json_schema_extra={
            "examples": [
                {
                    "commands": [{"id": 4, "kind": "retake", "theta_deg": 90, "psi_deg": 180}],
                    "events_seen": 7,
                    "sequence": 412,
                }
            ]
        }
    )

    commands: list[OpenCommand]
    events_seen: int
    sequence: int


class NewCommand(Incoming):
    """What to ask of the station.

    `retake` names a position of the run; `skip` may, and means the present one otherwise; `pause`,
    `resume` and `stop` are about the whole run.
    """

    model_config = ConfigDict(
        json_schema_extra={
            "examples": [{"kind": "pause"}, {"kind": "retake", "theta_deg": 90, "psi_deg": 180}]
        }
    )

    kind: CommandKind
    theta_deg: Angle | None = None
    psi_deg: Angle | None = None


class StationCommand(OpenCommand):
    """A command, and what became of it: `lapsed` when the run ended without an answer."""

    state: CommandState
    message: str
    asked_at: datetime
    asked_by: str
    answered_at: datetime | None

    @model_validator(mode="before")
    @classmethod
    def _of_view(cls, value: Any) -> Any:
        return _with_message(value) if isinstance(value, CommandView) else value


class StationEvent(Outgoing):
    """Something that the run met."""

    number: int
    at: datetime
    level: Level
    code: str
    message: str
    theta_deg: float | None
    psi_deg: float | None

    @model_validator(mode="before")
    @classmethod
    def _of_view(cls, value: Any) -> Any:
        return _with_message(value) if isinstance(value, RunEvent) else value


class SpotNow(Outgoing):
    """Where the station is, and what it measures there."""

    theta_deg: float
    psi_deg: float
    repeat: int
    take: int


class CellNow(Outgoing):
    """How a position of the run stands."""

    theta_deg: float
    psi_deg: float
    repeat: int
    state: CellPhase


class ReadingNow(Outgoing):
    """Both currents as a report told them; `at` is when it came."""

    at: datetime
    jx_ma: float
    jy_ma: float
    settled: bool | None


class StationNow(Outgoing):
    """The present run of a session: its newest report and how old that is.

    `silent` says that the run has not ended and that no report came for five seconds. `readings` are the
    last reported currents at the present position, oldest first; commands and events are the newest first.
    """

    session: int
    station: str
    run: str
    started_at: datetime
    reported_by: str
    sequence: int
    sent_at: datetime
    received_at: datetime
    age_s: float
    silent: bool
    ended: bool
    phase: Phase
    position: SpotNow | None
    jx_ma: float | None
    jy_ma: float | None
    settled: bool | None
    fraction: float | None
    left_s: float | None
    waiting: int
    cells: list[CellNow]
    readings: list[ReadingNow]
    commands: list[StationCommand]
    events: list[StationEvent]

    @classmethod
    def of(cls, view: RunView) -> Self:
        """As it is answered."""
        return cls.model_validate(view)


def _with_message(view: CommandView | RunEvent) -> dict[str, Any]:
    fields: dict[str, Any] = {name: getattr(view, name) for name in view.__slots__}
    return fields | {"message": view.said.message}
