"""The first screen: what is open, what was found last."""

from dataclasses import dataclass
from datetime import timedelta
from typing import Final

from app.services import sessions
from app.services.lab import Work
from app.services.views import SessionDetail, SessionView
from app.store import measurement


@dataclass(frozen=True, slots=True)
class StandNow:
    """What a stand does now: its open session, if any."""

    stand: str
    session: SessionView | None


@dataclass(frozen=True, slots=True)
class Overview:
    """`current` is the session at a stand now; `recent` the latest sessions, open ones first.

    A session that a station measures comes before the newest open one.
    """

    current: SessionDetail | None
    recent: tuple[SessionView, ...]


_UNDER_WAY = ("measuring", "ready", "solving")
_MOST_OPEN = 20
_REVIEWED: Final = timedelta(days=30)
_MOST_RESULTS: Final = 200
_WORST: Final = ("fails", "undetermined", "conditional", "no-limit", "conforms")


def overview(work: Work, limit: int = 12) -> Overview:
    """The technician's queue: the newest open session in full, open sessions, then the latest."""
    unsolved = _unsolved(work)
    latest = sessions.sessions(work, limit=limit).items
    known = {item.id for item in unsolved}
    recent = (*unsolved, *(item for item in latest if item.id not in known))[:limit]
    waiting = [
        *(item for item in unsolved if item.station and item.station.under_way),
        *(item for item in unsolved if item.state in ("measuring", "ready")),
    ]
    return Overview(sessions.detail(work, waiting[0].id) if waiting else None, recent)


def results(work: Work, limit: int) -> tuple[SessionView, ...]:
    """The metrologist's queue: sessions of the last 30 days with a result, the worst first, of those the newest."""
    found = sessions.sessions(work, since=work.now - _REVIEWED, limit=_MOST_RESULTS).items
    solved = sorted((item for item in found if item.result), key=lambda item: item.started_at, reverse=True)
    return tuple(sorted(solved, key=_badness)[:limit])


def _badness(session: SessionView) -> int:
    return _WORST.index(session.result.verdict) if session.result else len(_WORST)


def stands_now(work: Work, stand_names: tuple[str, ...]) -> tuple[StandNow, ...]:
    """Each stand with its newest session that is under way, if there is one; a simulation occupies none."""
    open_ones = {
        item.stand: item
        for item in reversed(_unsolved(work))
        if item.state in _UNDER_WAY and item.origin != "simulation"
    }
    return tuple(StandNow(name, open_ones.get(name)) for name in stand_names)


def _unsolved(work: Work) -> tuple[SessionView, ...]:
    return sessions.views(work, measurement.unsolved(work.db, _MOST_OPEN))
