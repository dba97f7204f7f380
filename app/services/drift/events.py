"""What happened to gyros and stands: entered by people, or told by the sessions themselves."""

from collections.abc import Iterator
from datetime import datetime
from typing import Final

import numpy as np

from app.errors import Conflict, Invalid, NotFound, problem
from app.services import access
from app.services.drift import following
from app.services.drift.series import SeriesTable, aware
from app.services.drift.views import EventView
from app.services.lab import Person, Work
from app.services.lookup import find_gyro
from app.services.stands import find_stand
from app.store import drift
from app.store.tables import Event

KINDS: Final = ("repair", "adjustment", "moved", "method", "other")
"""What a person may enter."""
BREAKING: Final = frozenset({"repair", "adjustment", "moved", "method"})
"""Those after which a level may be another one; they explain a step."""
DERIVED: Final = ("certificate", "stand", "solver")
"""What the sessions tell: a certificate, a stand, a solver's version that differs from the session before."""
_LONGEST: Final = 4000


def add(
    work: Work,
    kind: str,
    happened_at: datetime,
    note: str = "",
    *,
    gyro: str | None = None,
    stand: str | None = None,
) -> EventView:
    """Enter what happened to a gyro or to a stand.

    Raises
    ------
    Invalid
        An unknown kind, a time to come, neither a gyro nor a stand or both, a note that is too long.
    NotFound
        An unknown gyro or stand.
    """
    _check(work, kind, happened_at, note)
    if (gyro is None) == (stand is None):
        raise Invalid(problem("event-subject", "An event belongs to a gyro or to a stand, to one of them.",
                              column="gyro"))  # fmt: skip
    row = Event(
        gyro_id=None if gyro is None else find_gyro(work, gyro).id,
        stand_id=None if stand is None else find_stand(work, stand).id,
        happened_at=happened_at, kind=kind, note=note.strip(), created_at=work.now,
        created_by=work.person.name,
    )  # fmt: skip
    work.db.add(row)
    work.db.flush()
    _tell(work, row)
    return _view(row, gyro, stand)


def withdraw(work: Work, event_id: int) -> EventView:
    """Take back an event that was entered in error; it stays to be seen.

    Whoever entered it may, and whoever judges: an event explains steps and ends baselines.

    Raises
    ------
    Forbidden
        Somebody else entered it, and the person's role does not judge.
    NotFound
        There is none of that number.
    Conflict
        It was withdrawn before.
    """
    row = drift.event(work.db, event_id)
    if row is None:
        raise NotFound(problem("unknown-event", "There is no event %(number)d.", number=event_id))
    if row.withdrawn_at is not None:
        raise Conflict(problem("event-withdrawn", "This event was withdrawn already."))
    if not may_withdraw(work.person, _named(work, row)):
        access.require_judge(work.person)
    row.withdrawn_at, row.withdrawn_by = work.now, work.person.name
    _tell(work, row)
    return _named(work, row)


def may_withdraw(person: Person, event: EventView) -> bool:
    """Whether the person may take the event back."""
    return "upload" in person.scopes and (person.name == event.created_by or person.role in access.JUDGES)


def of_gyro(work: Work, serial: str, *, withdrawn: bool = False) -> tuple[EventView, ...]:
    """What people entered for a gyro, and for the stands that it was measured on."""
    row = find_gyro(work, serial)
    stands = {stand.id: stand.name for stand in drift.stands_of(work.db, row.id)}
    found = drift.events(work.db, row.id, list(stands), withdrawn=withdrawn)
    return tuple(
        _view(item, serial if item.gyro_id else None, stands.get(item.stand_id or 0)) for item in found
    )


def of_stand(work: Work, name: str, *, withdrawn: bool = False) -> tuple[EventView, ...]:
    """What people entered for a stand."""
    found = drift.events(work.db, None, [find_stand(work, name).id], withdrawn=withdrawn)
    return tuple(_view(item, None, name) for item in found)


def derived(table: SeriesTable, gyro: str) -> tuple[EventView, ...]:
    """What changed from one session to the next: its stand, its certificate, the solver's version."""
    return tuple(sorted(_changes(table, gyro), key=lambda event: event.at))


def _changes(table: SeriesTable, gyro: str) -> Iterator[EventView]:
    times, sessions = table["measured_at"], table["session"]
    moved = _differs(table, "stand")
    places = {
        "stand": moved,
        "certificate": _differs(table, "certificate") & ~moved,
        "solver": _differs(table, "solver_version"),
    }
    for kind, changes in places.items():
        column = "solver_version" if kind == "solver" else kind
        for place in np.flatnonzero(changes) + 1:
            yield EventView(
                None,
                kind,
                aware(times[place]),
                gyro,
                None,
                str(table[column][place]),
                session=int(sessions[place]),
            )


def _differs(table: SeriesTable, name: str) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
    column = table[name]
    found: np.ndarray[tuple[int], np.dtype[np.bool_]] = column[1:] != column[:-1]
    return found


def _check(work: Work, kind: str, happened_at: datetime, note: str) -> None:
    if kind not in KINDS:
        raise Invalid(problem("unknown-event-kind", "There is no kind of event “%(kind)s”. Choose one of %(kinds)s.",
                              column="kind", kind=kind, kinds=", ".join(KINDS)))  # fmt: skip
    if happened_at > work.now:
        raise Invalid(
            problem("event-to-come", "An event is entered after it happened.", column="happened_at")
        )
    if len(note) > _LONGEST:
        raise Invalid(problem("note-too-long", "A note has at most %(most)d characters.", column="note",
                              most=_LONGEST))  # fmt: skip


def _tell(work: Work, row: Event) -> None:
    if row.gyro_id is not None:
        following.changed(work, row.gyro_id)
    elif row.stand_id is not None:
        following.changed_stand(work, row.stand_id)


def _named(work: Work, row: Event) -> EventView:
    gyro, stand = drift.subject_names(work.db, row.gyro_id, row.stand_id)
    return _view(row, gyro, stand)


def _view(row: Event, gyro: str | None, stand: str | None) -> EventView:
    return EventView(
        row.id, row.kind, row.happened_at, gyro, stand, row.note, row.created_at, row.created_by, None,
        row.withdrawn_at, row.withdrawn_by,
    )  # fmt: skip
