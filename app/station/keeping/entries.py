"""What the journal can say: one frozen record per kind of line, to JSON and back.

Lines are facts in the order in which they happened. Nothing else decides how a run goes on (`history` folds
them, `app.station.plan` draws the conclusion), so a station that was killed after any of them goes on where it was.
"""

from dataclasses import dataclass
from datetime import datetime
from typing import Annotated, Any, Final, Literal, NamedTuple, Self

from pydantic import Field, TypeAdapter

from app.station.contracts import Currents, Place
from solver.errors import Message

Verdict = Literal["accepted", "suspicious", "refused"]
Level = Literal["info", "warning", "error"]

_LONGEST: Final = 200
"""Characters of a value in a sentence."""


class Target(NamedTuple):
    """A record that the cycle wants: a position and which measurement of it, 0 the first, 1 the closing one."""

    theta_deg: float
    psi_deg: float
    repeat: int = 0

    @property
    def place(self) -> Place:
        """Where the stand has to be."""
        return Place(self.theta_deg, self.psi_deg)


class Said(NamedTuple):
    """A sentence for people as its template and values, so that it can be shown in their language."""

    code: str
    template: str
    values: dict[str, int | float | str]

    @classmethod
    def of(cls, message: Message) -> Self:
        """A message's sentence."""
        plain = {
            name: value if isinstance(value, int | float) else str(value)[:_LONGEST]
            for name, value in message.values.items()
        }
        return cls(message.code, message.template, plain)

    @property
    def text(self) -> str:
        """In English."""
        return Message(*self).text


class Finding(NamedTuple):
    """What a check found, and how bad it is."""

    said: Said
    verdict: Verdict = "refused"


@dataclass(frozen=True, slots=True)
class Begun:
    """The run begins: of what, and how long each record shall be."""

    run: str
    gyro: str
    stand: str
    started_at: datetime
    samples: int
    rate_hz: float
    certificate: str | None = None
    temperature_c: float | None = None
    kind: Literal["begun"] = "begun"


@dataclass(frozen=True, slots=True)
class Resumed:
    """A program took the run up, for the first time or again."""

    kind: Literal["resumed"] = "resumed"


@dataclass(frozen=True, slots=True)
class Planned:
    """The positions in their order and where they are from (`certificate`, `remembered`, `option`, `sixteen`).

    `turned_arcsec` is the largest rotation that the stand's certificate states; None where none was heard of.
    """

    places: tuple[Place, ...]
    source: str
    gyro_type: str | None = None
    turned_arcsec: float | None = None
    kind: Literal["planned"] = "planned"


@dataclass(frozen=True, slots=True)
class Opened:
    """The service opened the session."""

    session: int
    kind: Literal["opened"] = "opened"


@dataclass(frozen=True, slots=True)
class Warmed:
    """The currents no longer creep."""

    kind: Literal["warmed"] = "warmed"


@dataclass(frozen=True, slots=True)
class Cooled:
    """The gyro may have been without power: whether it is warm is to be seen anew."""

    why: Said
    kind: Literal["cooled"] = "cooled"


@dataclass(frozen=True, slots=True)
class Damaged:
    """The disk does not give back the record of a take: it is worth nothing and is measured anew."""

    attempt: int
    why: Said
    kind: Literal["damaged"] = "damaged"


@dataclass(frozen=True, slots=True)
class Started:
    """The cycle turns to a target, to move there, settle and acquire; `take` counts what was judged at the place."""

    attempt: int
    target: Target
    take: int
    kind: Literal["started"] = "started"


@dataclass(frozen=True, slots=True)
class Acquiring:
    """The ammeter is about to be told to acquire; `label` is how it will be known again.

    `reading` is what it showed just before, which the record must go on from.
    """

    attempt: int
    label: int
    started_at: datetime
    reading: Currents | None = None
    kind: Literal["acquiring"] = "acquiring"


@dataclass(frozen=True, slots=True)
class Abandoned:
    """An attempt was lost or given up; what there is of it is kept."""

    attempt: int
    why: Said
    kind: Literal["abandoned"] = "abandoned"


@dataclass(frozen=True, slots=True)
class Judged:
    """A take and what the checks said: its means, and the SHA-256 of its record file.

    A take that came to no record (the stand stalled) is refused and has neither.
    """

    attempt: int
    verdict: Verdict
    findings: tuple[Finding, ...]
    jx_ma: float | None = None
    jy_ma: float | None = None
    digest: str | None = None
    kind: Literal["judged"] = "judged"


class Doubt(NamedTuple):
    """A target that disagrees with others, and how."""

    target: Target
    said: Said


@dataclass(frozen=True, slots=True)
class Compared:
    """The takes that count, beside each other: `doubted` are measured anew, `refuted` have been and stay wrong.

    A line says the whole of it: what an earlier one refuted and this one does not is good again.
    """

    doubted: tuple[Doubt, ...] = ()
    refuted: tuple[Doubt, ...] = ()
    kind: Literal["compared"] = "compared"


@dataclass(frozen=True, slots=True)
class Noted:
    """Something that a person should know and no other line says."""

    level: Level
    said: Said
    place: Place | None = None
    kind: Literal["noted"] = "noted"


@dataclass(frozen=True, slots=True)
class Commanded:
    """A command was obeyed, or refused; `skip` and `retake` name their target and act by this very line."""

    command: int
    what: Literal["pause", "resume", "skip", "retake", "stop"]
    outcome: Literal["done", "refused"]
    said: Said
    target: Target | None = None
    kind: Literal["commanded"] = "commanded"


@dataclass(frozen=True, slots=True)
class Sent:
    """The service acknowledged a record."""

    attempt: int
    kind: Literal["sent"] = "sent"


@dataclass(frozen=True, slots=True)
class Rejected:
    """The service refuses a record."""

    attempt: int
    why: Said
    kind: Literal["rejected"] = "rejected"


@dataclass(frozen=True, slots=True)
class Queued:
    """The service has the calibration in hand."""

    job: str
    kind: Literal["queued"] = "queued"


@dataclass(frozen=True, slots=True)
class Solved:
    """The calibration's address at the service."""

    result: str
    kind: Literal["solved"] = "solved"


@dataclass(frozen=True, slots=True)
class Unsolved:
    """The calibration gave no result."""

    detail: str
    kind: Literal["unsolved"] = "unsolved"


@dataclass(frozen=True, slots=True)
class Finished:
    """The run is over: why it has no calibration, if it has none or one of fewer positions, and what is in doubt."""

    reasons: tuple[Said, ...]
    kind: Literal["finished"] = "finished"


Entry = (
    Begun | Resumed | Planned | Opened | Warmed | Cooled | Started | Acquiring | Abandoned | Judged | Damaged
    | Compared | Noted | Commanded | Sent | Rejected | Queued | Solved | Unsolved | Finished
)  # fmt: skip

_ENTRY: Final[TypeAdapter[Entry]] = TypeAdapter(Annotated[Entry, Field(discriminator="kind")])
_MOMENT: Final = TypeAdapter(datetime)


def to_json(at: datetime, entry: Entry) -> dict[str, Any]:
    """An entry as it stands in the journal, with the moment when it was written."""
    said: dict[str, Any] = _ENTRY.dump_python(entry, mode="json")
    return {"at": at.isoformat(), "kind": said.pop("kind")} | said


def from_json(said: dict[str, Any]) -> tuple[datetime, Entry]:
    """Read an entry and its moment."""
    at, rest = said["at"], {name: value for name, value in said.items() if name != "at"}
    return _MOMENT.validate_python(at), _ENTRY.validate_python(rest)
