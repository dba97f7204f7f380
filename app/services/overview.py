"""The first screen: what is open, what was found last."""

from dataclasses import dataclass

from app.services import sessions
from app.services.lab import Work
from app.services.views import SessionDetail, SessionView


@dataclass(frozen=True, slots=True)
class StandNow:
    """What a stand does now: its open session, if any."""

    stand: str
    session: SessionView | None


@dataclass(frozen=True, slots=True)
class Overview:
    """`current` is the open session to go on with; `recent` the latest sessions, open ones first."""

    current: SessionDetail | None
    recent: tuple[SessionView, ...]


_OPEN = ("measuring", "ready", "solving", "failed")


def overview(work: Work, limit: int = 12) -> Overview:
    """The technician's queue: the newest open session in full, and the latest sessions."""
    latest = sessions.sessions(work, limit=limit).items
    waiting = [item for item in latest if item.state in ("measuring", "ready")]
    recent = tuple(sorted(latest, key=lambda item: item.state not in _OPEN))
    return Overview(sessions.detail(work, waiting[0].id) if waiting else None, recent)


def stands_now(work: Work, stand_names: tuple[str, ...]) -> tuple[StandNow, ...]:
    """Each stand with its newest session, if that is still open."""
    found = []
    for name in stand_names:
        newest = sessions.sessions(work, stand=name, limit=1).items
        session = newest[0] if newest and newest[0].state in ("measuring", "ready", "solving") else None
        found.append(StandNow(name, session))
    return tuple(found)
