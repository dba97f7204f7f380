"""Which positions the cycle measures: those asked for, the certificate's, or what is remembered of it."""

import json
from collections.abc import Callable
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from app.errors import Invalid, Problem
from app.station.contracts import Certified, Place
from app.station.keeping import durable
from app.station.keeping.entries import Opened, Planned
from app.station.keeping.spool import Spool
from app.station.sending.client import ServerRefused, Unreachable
from app.station.sending.service import Service
from solver.errors import Message

SIXTEEN: Final = tuple(
    Place(float(theta), float(psi)) for theta in range(0, 360, 90) for psi in range(0, 360, 90)
)
"""The method's positions, for a station that never heard of a certificate."""


@dataclass(frozen=True, slots=True)
class Memory:
    """The certificates' positions as this computer heard of them last, by stand: θ, ψ and how far it is turned."""

    file: Path

    def positions(self, stand: str) -> tuple[Certified, ...]:
        """Positions of a stand; empty when nothing is remembered."""
        kept = self._read().get(stand, ())
        return tuple(
            Certified(Place(*place), turned) for *place, turned in kept if len(place) == len(Place._fields)
        )

    def remember(self, stand: str, positions: tuple[Certified, ...]) -> None:
        """Keep a stand's positions."""
        known = self._read() | {stand: [[*item.place, item.turned_arcsec] for item in positions]}
        durable.make_folders(self.file.parent)
        durable.write_whole(self.file, json.dumps(known, ensure_ascii=False, indent=1).encode())

    def _read(self) -> dict[str, list[list[float]]]:
        if not self.file.exists():
            return {}
        known: dict[str, list[list[float]]] = json.loads(self.file.read_bytes())
        return known


@dataclass(slots=True)
class Preparing:
    """Makes the plan of a new run; `reach` refuses a place that the stand cannot go to."""

    spool: Spool
    service: Callable[[], Service]
    memory: Memory
    reach: Callable[[Place], None]
    asked: tuple[Place, ...] = ()
    gyro_type: str | None = None

    def plan(self) -> None:
        """Write down which positions there are; the session is opened if the service can be reached."""
        begun = self.spool.history.begun
        assert begun is not None
        certified, gyro_type = self._certified()
        if certified:
            self.memory.remember(begun.stand, certified)
        remembered = self.memory.positions(begun.stand)
        choices = {
            "option": self.asked,
            "certificate": tuple(item.place for item in certified),
            "remembered": tuple(item.place for item in remembered),
            "sixteen": SIXTEEN,
        }
        source, places = next((source, places) for source, places in choices.items() if places)
        self._require_reachable(places)
        turned = max((item.turned_arcsec for item in certified or remembered), default=None)
        self.spool.add(Planned(places, source, self.gyro_type or gyro_type, turned))

    def _require_reachable(self, places: tuple[Place, ...]) -> None:
        """Find out before anything moves what the stand cannot do; raises `Invalid` with all of it."""
        beyond: dict[str, Problem] = {}
        for place in places:
            try:
                self.reach(place)
            except Invalid as error:
                beyond |= {item.text: item for item in error.problems}
        if beyond:
            raise Invalid(*beyond.values())

    def _certified(self) -> tuple[tuple[Certified, ...], str | None]:
        """Positions of the session's certificate and the gyro's type; nothing when the service is away."""
        begun = self.spool.history.begun
        assert begun is not None
        try:
            with closing(self.service()) as service:
                session = service.open_session(begun)
                with self.spool.lock:
                    if self.spool.history.session is None:
                        self.spool.add(Opened(session))
                return service.described(session)
        except Unreachable as away:
            self.spool.note("warning", away.problems[0].message)
        except ServerRefused as refused:
            if not self.spool.history.session:
                raise
            self.spool.note("warning", refused.problems[0].message)
        if not self.asked:
            self.spool.note(
                "warning",
                Message("certificate-unheard", "The certificate could not be asked for its positions; they are taken "
                        "as remembered, or as the method's sixteen."),
            )  # fmt: skip
        return (), None
