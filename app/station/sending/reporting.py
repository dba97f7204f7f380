"""The live state of the run, told to the service about once a second by a thread of its own; it brings commands back.

Nothing waits for it, and nothing is decided by what it could not tell: events are in the journal and are told
until the service has them.
"""

import threading
from collections.abc import Callable
from contextlib import closing
from datetime import UTC, datetime
from typing import Any, Final

from app.station.contracts import Place
from app.station.controls import Command, Controls
from app.station.keeping.entries import Target
from app.station.keeping.history import Event, History
from app.station.keeping.spool import Spool
from app.station.sending.client import ServerRefused, Unreachable
from app.station.sending.live import Activity, Live, Phase
from app.station.sending.service import Service

INTERVAL_S: Final = 1.0
PATIENCE_S: Final = 5.0
"""A report that takes longer is worth less than the next one."""
_MOST_EVENTS: Final = 100
_MOST_ANSWERS: Final = 100
_STARTS: Final = 1_000_000
_OVERHEAD_S: Final = 30.0
"""Moving and settling of a position, s, before any has been measured."""
_CELLS: Final[dict[Phase, str]] = {
    "moving": "moving", "homing": "moving", "settling": "settling", "warming": "warming", "acquiring": "running",
}  # fmt: skip


class Reporter(threading.Thread):
    """Reports until `stop`; `refused` says why the service takes no reports, if it does not."""

    def __init__(
        self, station: str, spool: Spool, live: Live, controls: Controls, service: Callable[[], Service]
    ) -> None:
        super().__init__(name="reporting", daemon=True)
        self.refused: str | None = None
        self.failed: BaseException | None = None
        self._station, self._spool, self._live, self._controls = station, spool, live, controls
        self._service = service
        self._end = threading.Event()
        self._number = 0
        self._events_seen = 0
        self._answered: set[int] = set()
        """Commands that the service knows the outcome of."""

    def run(self) -> None:
        """Report until told to stop, and once more then."""
        try:
            with closing(self._service()) as service:
                while not self._end.wait(INTERVAL_S):
                    self._report(service)
                self._report(service)
        except BaseException as error:  # the cycle raises it: nothing is lost silently in a thread
            self.failed = error

    def stop(self) -> None:
        """End after a last report."""
        self._end.set()
        self.join()

    def _report(self, service: Service) -> None:
        with self._spool.lock:
            session = self._spool.history.session
            said = self._said(self._spool.history)
        if session is None or said is None:
            return
        try:
            answer = service.report(session, said)
        except Unreachable:  # the forwarder tells of it; here the next report is due in a second
            return
        except ServerRefused as refused:
            self._tell(refused)
            return
        self._heed(answer)

    def _heed(self, answer: dict[str, Any]) -> None:
        commands = [_command(item) for item in answer["commands"]]
        still_asked = {command.id for command in commands}
        with self._spool.lock:
            self._answered |= set(self._spool.history.commands) - still_asked
        self._events_seen = answer["events_seen"]
        self._controls.give(commands)

    def _tell(self, refused: ServerRefused) -> None:
        message = refused.problems[0].message
        if self.refused != message.text:
            self.refused = message.text
            self._spool.note("warning", message)

    def _said(self, history: History) -> dict[str, Any] | None:
        begun, now = history.begun, self._live.now
        if begun is None:
            return None
        self._number += 1
        currents = now.currents
        return {
            "station": self._station,
            "run": begun.run,
            "sequence": history.starts * _STARTS + self._number,
            "sent_at": datetime.now(UTC).isoformat(),
            "phase": now.phase,
            "position": _position(now),
            "jx_ma": currents.jx_ma if currents else None,
            "jy_ma": currents.jy_ma if currents else None,
            "settled": now.settled,
            "fraction": now.fraction,
            "left_s": left_s(history, now),
            "waiting": len(history.to_send()),
            "cells": [_cell(history, target, now) for target in history.targets],
            "events": [_event(item) for item in history.events[self._events_seen :][:_MOST_EVENTS]],
            "done": self._done(history),
        }

    def _done(self, history: History) -> list[dict[str, Any]]:
        told = [
            item
            for item in history.commands.values()
            if item.command > 0 and item.command not in self._answered
        ]
        return [
            {"id": item.command, "outcome": item.outcome, "message": item.said.text,
             "template": item.said.template, "values": item.said.values}
            for item in told[:_MOST_ANSWERS]
        ]  # fmt: skip


def left_s(history: History, now: Activity) -> float | None:
    """Lab seconds to the end of the cycle, as far as anybody can tell."""
    begun = history.begun
    if begun is None or not history.places:
        return None
    duration = begun.samples / begun.rate_hz
    left = sum(history.wanted(target) for target in history.targets) * (duration + _OVERHEAD_S)
    if now.fraction is not None and now.target is not None:
        left -= _OVERHEAD_S + now.fraction * duration
    return max(left, 0.0)


def _position(now: Activity) -> dict[str, Any] | None:
    if now.target is None:
        return None
    return dict(now.target._asdict()) | {"take": now.take}


def _cell(history: History, target: Target, now: Activity) -> dict[str, Any]:
    return dict(target._asdict()) | {"state": _state(history, target, now)}


def _state(history: History, target: Target, now: Activity) -> str:
    if now.target == target and now.phase in _CELLS:
        return _CELLS[now.phase]
    if target in history.skipped:
        return "skipped"
    standing = history.standing(target)
    if standing is None or history.wanted(target):
        return "todo"
    verdict = "refused" if standing.rejected else standing.verdict
    return "recorded" if verdict == "accepted" else str(verdict)


def _event(item: Event) -> dict[str, Any]:
    place = item.place
    return {
        "number": item.number,
        "at": item.at.isoformat(),
        "level": item.level,
        "code": item.said.code,
        "message": item.said.text,
        "template": item.said.template,
        "values": item.said.values,
        "theta_deg": place.theta_deg if place else None,
        "psi_deg": place.psi_deg if place else None,
    }


def _command(said: dict[str, Any]) -> Command:
    theta_deg, psi_deg = said["theta_deg"], said["psi_deg"]
    place = None if theta_deg is None or psi_deg is None else Place(theta_deg, psi_deg)
    return Command(said["id"], said["kind"], place)
