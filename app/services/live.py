"""The live state of a station: its reports come in, its commands go out.

A session has one present run, the one that was first heard of last: a stand's clock plays no part in it.
A report replaces the one before it, and one whose number is not higher changes nothing, so reports may
be sent again and may overtake each other. Events are kept once, by their number in the run. A command is
handed out with every answer until the station says what became of it.
"""

from collections.abc import Sequence
from datetime import UTC, datetime
from typing import Any, Final, cast

from app.errors import Conflict, Invalid, NotFound, problem
from app.exchange.positions import same_angle
from app.services.lab import Work
from app.services.live_views import (
    ENDED,
    CellState,
    CommandKind,
    CommandState,
    CommandView,
    Level,
    Phase,
    Reading,
    Report,
    RunEvent,
    RunView,
    Sentence,
    Spot,
    StationAnswer,
)
from app.services.sessions import find_session
from app.store import station
from app.store.tables import StationCommand, StationEvent, StationRun

MOST_READINGS: Final = 300
"""Reported currents that are kept: five minutes of a report each second."""

MOST_EVENTS: Final = 100
"""Events that are shown unless told otherwise."""

_MOST_COMMANDS: Final = 20
_PLACED: Final = ("skip", "retake")


def report(work: Work, session_id: int, sent: Report) -> StationAnswer:
    """Take a report of a run.

    A report that is not newer than the stored one of its run changes nothing and gets the same answer.

    Raises
    ------
    NotFound
        No such session.
    Conflict
        Another run of the session has been heard of since: this one is not shown any more.
    """
    _lock(work, session_id)
    row = station.current_run(work.db, session_id)
    if row is None or row.run != sent.run:
        if station.is_known(work.db, session_id, sent.run):
            raise _superseded(row)
        row = _begin(work, session_id, sent)
    elif sent.sequence > row.sequence:
        _replace(work, row, sent)
    else:
        return _answer(work, row)
    _note_events(work, row, sent.events)
    _note_answers(work, row, sent)
    work.db.flush()
    return _answer(work, row)


def run(work: Work, session_id: int, events: int = MOST_EVENTS) -> RunView:
    """The present run of a session, with so many of its events.

    Raises
    ------
    NotFound
        No such session, or no station has reported in it.
    """
    found = find(work, session_id, events)
    if found is None:
        raise _unheard(work, session_id)
    return found


def find(work: Work, session_id: int, events: int = MOST_EVENTS) -> RunView | None:
    """The present run of a session, None when no station has reported in it."""
    row = station.current_run(work.db, session_id)
    return None if row is None else _view(work, row, events)


def state_mark(work: Work, session_id: int) -> str:
    """What tells one state of the session's run from the next, empty before the first; cheap to ask for."""
    return "-".join(str(part) for part in station.mark(work.db, session_id) or ())


def command(
    work: Work, session_id: int, kind: CommandKind, theta_deg: float | None, psi_deg: float | None
) -> tuple[CommandView, bool]:
    """Ask the session's station for something.

    Returns
    -------
    tuple
        The command, and whether it is new: what is asked already and not answered is not asked twice.

    Raises
    ------
    NotFound
        No such session, or no station has reported in it.
    Conflict
        The run has ended.
    Invalid
        A position where none belongs, none where one does, or one that the run has not.
    """
    _lock(work, session_id)
    row = station.current_run(work.db, session_id)
    if row is None:
        raise _unheard(work, session_id)
    if row.phase in ENDED:
        raise Conflict(problem("run-ended", "The run of station %(station)s has ended; it takes no command any more.",
                               station=row.station))  # fmt: skip
    place = _place(row, kind, theta_deg, psi_deg)
    wanted = (kind, *place)
    for known in station.open_commands(work.db, row.id):
        if (known.kind, known.theta_deg, known.psi_deg) == wanted:
            return _command(known, ended=False), False
    asked = StationCommand(
        run_id=row.id, kind=kind, theta_deg=place[0], psi_deg=place[1], asked_at=work.now,
        asked_by=work.person.name, message="",
    )  # fmt: skip
    work.db.add(asked)
    work.db.flush()
    return _command(asked, ended=False), True


def _lock(work: Work, session_id: int) -> None:
    if not station.locked(work.db, session_id):
        raise NotFound(problem("unknown-session", "There is no session %(number)d.", number=session_id))


def _unheard(work: Work, session_id: int) -> NotFound:
    find_session(work, session_id)
    return NotFound(
        problem("no-station", "No station has reported in session %(number)d.", number=session_id)
    )


def _superseded(present: StationRun | None) -> Conflict:
    return Conflict(
        problem(
            "run-superseded",
            "Another run, of station %(station)s, reports in this session since %(since)s. Stop one of the two.",
            station=present.station if present else "",
            since=present.started_at.isoformat(timespec="seconds") if present else "",
        )
    )


def _begin(work: Work, session_id: int, sent: Report) -> StationRun:
    row = StationRun(
        session_id=session_id, run=sent.run, started_at=work.now, reported_by=work.person.name,
        **_content(work, sent),
    )  # fmt: skip
    row.readings = _readings([], row)
    work.db.add(row)
    work.db.flush()
    return row


def _replace(work: Work, row: StationRun, sent: Report) -> None:
    stays = _spot(row) == sent.position
    for name, value in _content(work, sent).items():
        setattr(row, name, value)
    row.readings = _readings(row.readings if stays else [], row)


def _content(work: Work, sent: Report) -> dict[str, Any]:
    where = sent.position._asdict() if sent.position else dict.fromkeys(Spot._fields)
    return where | {
        "station": sent.station, "sequence": sent.sequence, "sent_at": sent.sent_at, "received_at": work.now,
        "phase": sent.phase, "jx_ma": sent.jx_ma, "jy_ma": sent.jy_ma, "settled": sent.settled,
        "fraction": sent.fraction, "left_s": sent.left_s, "waiting": sent.waiting,
        "cells": [list(cell) for cell in sent.cells],
    }  # fmt: skip


def _readings(before: list[Any], row: StationRun) -> list[Any]:
    """The readings at the present position with the newest one, as they are stored."""
    if row.jx_ma is None or row.jy_ma is None:
        return before
    newest = [row.received_at.timestamp(), row.jx_ma, row.jy_ma, row.settled]
    return [*before, newest][-MOST_READINGS:]


def _note_events(work: Work, row: StationRun, sent: Sequence[RunEvent]) -> None:
    by_number = {item.number: item for item in sent}
    known = station.known_events(work.db, row.id, list(by_number))
    work.db.add_all(
        StationEvent(
            run_id=row.id, number=item.number, at=item.at, level=item.level, code=item.code,
            theta_deg=item.theta_deg, psi_deg=item.psi_deg, **_said(item.said),
        )
        for item in by_number.values()
        if item.number not in known
    )  # fmt: skip


def _note_answers(work: Work, row: StationRun, sent: Report) -> None:
    waiting = {item.id: item for item in station.open_commands(work.db, row.id)}
    for answer in sent.done:
        asked = waiting.pop(answer.id, None)
        if asked is not None:
            asked.answered_at, asked.outcome = work.now, answer.outcome
            for name, value in _said(answer.said).items():
                setattr(asked, name, value)


def _said(sentence: Sentence) -> dict[str, Any]:
    values = None if sentence.values is None else dict(sentence.values)
    return {"message": sentence.message, "template": sentence.template, "values": values}


def _answer(work: Work, row: StationRun) -> StationAnswer:
    waiting = tuple(_command(item, ended=False) for item in station.open_commands(work.db, row.id))
    return StationAnswer(waiting, station.last_event(work.db, row.id), row.sequence)


def _place(
    row: StationRun, kind: CommandKind, theta_deg: float | None, psi_deg: float | None
) -> tuple[float | None, float | None]:
    """The position that a command is about, as the run writes it; of a skip without one it is the present."""
    if kind not in _PLACED:
        if theta_deg is not None or psi_deg is not None:
            raise Invalid(
                problem("whole-run", "This command is about the whole run. Leave the position out.",
                        column="theta_deg" if theta_deg is not None else "psi_deg")
            )  # fmt: skip
        return None, None
    if kind == "skip" and theta_deg is None and psi_deg is None:
        theta_deg, psi_deg = row.theta_deg, row.psi_deg
        if theta_deg is None:
            raise Conflict(
                problem("no-position", "The station is at no position now, so there is none to skip.")
            )
    if theta_deg is None or psi_deg is None:
        raise Invalid(
            problem("no-position-named", "Name the position by both of its angles.",
                    column="theta_deg" if theta_deg is None else "psi_deg")
        )  # fmt: skip
    for cell in _cells(row):
        if same_angle(cell.theta_deg, theta_deg) and same_angle(cell.psi_deg, psi_deg):
            return cell.theta_deg, cell.psi_deg
    raise Invalid(problem("position-not-in-run", "The run has no position θ %(theta)g°, ψ %(psi)g°.",
                          column="theta_deg", theta=theta_deg, psi=psi_deg))  # fmt: skip


def _view(work: Work, row: StationRun, events: int) -> RunView:
    ended = row.phase in ENDED
    commands = station.commands(work.db, row.id, _MOST_COMMANDS)
    return RunView(
        id=row.id, session=row.session_id, station=row.station, run=row.run, started_at=row.started_at,
        reported_by=row.reported_by, sequence=row.sequence, sent_at=row.sent_at, received_at=row.received_at,
        now=work.now, phase=cast(Phase, row.phase), position=_spot(row), jx_ma=row.jx_ma, jy_ma=row.jy_ma,
        settled=row.settled, fraction=row.fraction, left_s=row.left_s, waiting=row.waiting,
        cells=_cells(row),
        readings=tuple(Reading(datetime.fromtimestamp(at, UTC), *rest) for at, *rest in row.readings),
        commands=tuple(_command(item, ended=ended) for item in commands),
        events=tuple(_event(item) for item in station.events(work.db, row.id, events)),
    )  # fmt: skip


def _spot(row: StationRun) -> Spot | None:
    if row.theta_deg is None or row.psi_deg is None or row.repeat is None or row.take is None:
        return None
    return Spot(row.theta_deg, row.psi_deg, row.repeat, row.take)


def _cells(row: StationRun) -> tuple[CellState, ...]:
    return tuple(CellState(*cell) for cell in row.cells)


def _event(row: StationEvent) -> RunEvent:
    said = Sentence(row.message, row.template, row.values)
    return RunEvent(row.number, row.at, cast(Level, row.level), row.code, said, row.theta_deg, row.psi_deg)


def _command(row: StationCommand, *, ended: bool) -> CommandView:
    state = row.outcome or ("lapsed" if ended else "open")
    return CommandView(
        id=row.id, kind=cast(CommandKind, row.kind), theta_deg=row.theta_deg, psi_deg=row.psi_deg,
        asked_at=row.asked_at, asked_by=row.asked_by, answered_at=row.answered_at,
        state=cast(CommandState, state), said=Sentence(row.message, row.template, row.values),
    )  # fmt: skip
