"""Finding sessions: an index by gyro, stand and state, each entry with its count."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

from app.services import sessions
from app.services.lab import Work
from app.services.views import Page, SessionView
from app.store import session_index

KEYS: Final = ("state", "stand", "gyro")


@dataclass(frozen=True, slots=True)
class SessionIndex:
    """Part of the list, how many sessions fit, and the counts of every entry of the index.

    `counts` maps ``gyro``, ``stand`` and ``state`` to their values with the number of sessions that
    would be left by choosing that value with the other choices as they are.
    """

    page: Page[SessionView]
    total: int
    counts: Mapping[str, Mapping[str, int]]


def find(
    work: Work,
    *,
    gyro: str | None = None,
    stand: str | None = None,
    state: str | None = None,
    before: int | None = None,
    limit: int = 50,
) -> SessionIndex:
    """Sessions that fit, the newest first, with the index's counts."""
    chosen = {"state": state, "stand": stand, "gyro": gyro}
    wanted = {key: value for key, value in chosen.items() if value}
    groups = [
        ({"gyro": serial, "stand": name, "state": in_state}, count)
        for serial, name, in_state, count in session_index.counted(work.db)
    ]
    counts: dict[str, dict[str, int]] = {key: {} for key in KEYS}
    total = 0
    for group, count in groups:
        differing = [key for key, value in wanted.items() if group[key] != value]
        if not differing:
            total += count
        for key in KEYS:
            if all(other == key for other in differing):
                counts[key][group[key]] = counts[key].get(group[key], 0) + count
    rows = session_index.found(work.db, wanted, before=before, limit=limit + 1)
    items = sessions.views(work, rows[:limit])
    page = Page(items, str(items[-1].id) if len(rows) > limit else None)
    return SessionIndex(page, total, counts)
