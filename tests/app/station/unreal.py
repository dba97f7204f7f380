"""A stand, an ammeter, a judge and a service that obey at once, for tests of the cycle alone."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path

import numpy as np

from app.errors import Invalid, problem
from app.exchange.rows import CurrentRecord
from app.station.clock import Clock
from app.station.contracts import Acquisition, Block, Certified, Currents, Place, StandStatus
from app.station.controls import Controls
from app.station.cycle import Cycle
from app.station.finishing import Finishing
from app.station.keeping.entries import Begun, Finding, Resumed, Said, Target
from app.station.keeping.history import Attempt, History
from app.station.keeping.spool import Spool
from app.station.preparing import Memory, Preparing
from app.station.sending.client import ServerRefused, Unreachable
from app.station.sending.forwarding import Forwarder
from app.station.workplace import Workplace
from solver.errors import Message

SAMPLES, RATE_HZ, BLOCK = 40, 200.0, 16
PLACES = (Place(0.0, 0.0), Place(0.0, 180.0), Place(90.0, 0.0))


def true_record(place: Place, take: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Depends on the place and the take alone, as the simulated instruments' records do."""
    rng = np.random.default_rng([int(place.theta_deg), int(place.psi_deg), take])
    return np.arange(SAMPLES) / RATE_HZ, *rng.normal(1e-3, 1e-5, (2, SAMPLES))


@dataclass
class UnrealStand:
    homed: bool = False
    place: Place = PLACES[1]
    emergency_stop: bool = False
    moves: list[Place] = field(default_factory=list)
    before_move: Callable[[Place], None] = lambda place: None
    stops: int = 0
    beyond: tuple[Place, ...] = ()

    def reach(self, place: Place) -> None:
        if place in self.beyond:
            raise Invalid(problem("beyond-travel", f"Not to {place.theta_deg:g}/{place.psi_deg:g}."))

    def identify(self) -> str:
        return "stand"

    def home(self) -> None:
        self.homed = True

    def move(self, place: Place) -> None:
        assert self.homed
        self.before_move(place)
        self.moves.append(place)
        self.place = place

    def status(self) -> StandStatus:
        return StandStatus(self.homed, False, self.emergency_stop, self.place)

    def stop(self) -> None:
        self.stops += 1

    def release(self) -> None:
        self.emergency_stop = False


@dataclass
class UnrealAmmeter:
    """Gives samples a few at a time; `forget` is its power cut."""

    stand: UnrealStand
    label: int | None = None
    record: tuple[np.ndarray, ...] | None = None
    ready: int = 0
    starts: list[tuple[Place, int]] = field(default_factory=list)
    before_fetch: Callable[[int], None] = lambda first: None

    def identify(self) -> str:
        return "ammeter"

    def reading(self) -> Currents:
        return Currents(1e-3, 2e-3)

    def start(self, label: int, take: int, samples: int, rate_hz: float) -> None:
        assert (samples, rate_hz) == (SAMPLES, RATE_HZ)
        self.label, self.ready = label, 0
        self.record = true_record(self.stand.place, take)
        self.starts.append((self.stand.place, take))

    def status(self) -> Acquisition:
        if self.record is None:
            return Acquisition(self.label, False, 0, False)
        self.ready = min(SAMPLES, self.ready + 9)
        return Acquisition(self.label, self.ready < SAMPLES, self.ready, False)

    def fetch(self, first: int, most: int) -> Block:
        self.before_fetch(first)
        assert self.record is not None
        t_s, jx_ma, jy_ma = (column[first : min(first + most, self.ready)] for column in self.record)
        return Block(first, t_s, jx_ma, jy_ma)

    def stop(self) -> None:
        self.ready = SAMPLES

    def forget(self) -> None:
        self.label, self.record, self.ready = None, None, 0


class AtOnce:
    def add(self, at_s: float, currents: Currents) -> bool:
        return True


@dataclass
class Opinionated:
    """A judge that objects to the takes named."""

    objections: dict[tuple[Target, int], Finding] = field(default_factory=dict)
    odd_until: dict[tuple[Place, Place], int] = field(default_factory=dict)
    alone: tuple[Place, ...] = ()

    def settling(self) -> AtOnce:
        return AtOnce()

    warming = settling

    def findings(
        self, record: CurrentRecord, overload: bool, target: Target, history: History
    ) -> Sequence[Finding]:
        take = len(history.takes(target))
        found = self.objections.get((target, take))
        return [found] if found else []

    def odd(
        self, means: Mapping[Place, Currents], history: History
    ) -> list[tuple[Message, tuple[Place, ...]]]:
        """The pairs named, as long as one of them has not been measured so often."""
        return [
            (Message("partner", "They disagree."), pair)
            for pair, takes in self.odd_until.items()
            if set(pair) <= set(means) and min(len(history.takes(Target(*place))) for place in pair) < takes
        ]

    def unseen(self, means: Mapping[Place, Currents]) -> tuple[Place, ...]:
        return self.alone


def objection(code: str) -> Finding:
    return Finding(Said(code, f"There is a {code}.", {}))


@dataclass
class UnrealService:
    """What the service has, and how it answers; many connections share it."""

    sessions: dict[str, int] = field(default_factory=dict)
    records: dict[Target, list[bytes]] = field(default_factory=dict)
    puts: int = 0
    jobs: int = 0
    solved: set[tuple[tuple[Target, bytes], ...]] = field(default_factory=set)
    """Inputs of the results: those computed again from the same records are the same result, as at the service."""
    places: tuple[Place, ...] = PLACES
    trouble: list[Unreachable | ServerRefused] = field(default_factory=list)

    def connect(self) -> "UnrealService":
        return self

    def _answer(self) -> None:
        if self.trouble:
            raise self.trouble.pop(0)

    def open_session(self, begun: Begun) -> int:
        self._answer()
        return self.sessions.setdefault(begun.run, len(self.sessions) + 1)

    def described(self, session: int) -> tuple[tuple[Certified, ...], str]:
        self._answer()
        return tuple(Certified(place, 15.0) for place in self.places), "GVK-6"

    def put_record(self, session: int, attempt: Attempt, content: bytes) -> None:
        self._answer()
        self.puts += 1
        kept = self.records.setdefault(attempt.target, [])
        if not kept or kept[-1] != content:
            kept.append(content)

    def calibrate(self, session: int, method: str) -> str:
        self._answer()
        self.jobs += 1
        self.solved.add(tuple((target, kept[-1]) for target, kept in sorted(self.records.items())))
        return f"job-{self.jobs}"

    def job(self, job: str) -> dict[str, object]:
        self._answer()
        return {"id": job, "state": "succeeded", "result": "/api/v1/calibrations/7", "error": None}

    def close(self) -> None:
        pass


@dataclass
class Room:
    """A station whose instruments and service outlive its program."""

    folder: Path
    stand: UnrealStand = field(default_factory=UnrealStand)
    ammeter: UnrealAmmeter = None
    judge: Opinionated = field(default_factory=Opinionated)
    service: UnrealService = field(default_factory=UnrealService)
    controls: Controls = field(default_factory=Controls)
    options: dict[str, object] = field(default_factory=dict)
    asked: tuple[Place, ...] = ()

    def __post_init__(self) -> None:
        self.ammeter = UnrealAmmeter(self.stand)

    def run(self) -> History:
        """One life of the station's program."""
        with Spool(self.folder) as spool:
            if spool.history.begun is None:
                spool.add(Begun("run-1", "0417", "S1", datetime(2026, 3, 1, 9, tzinfo=UTC), SAMPLES, RATE_HZ))
            spool.add(Resumed())
            forwarder = Forwarder(spool, self.service.connect, first_pause_s=0.001)
            at = Workplace(
                spool, self.stand, self.ammeter, self.judge, Clock(speed=1e6, poll_s=0.0), self.controls,
                helpers=[forwarder], block_samples=BLOCK,
            )  # fmt: skip
            preparing = Preparing(
                spool, self.service.connect, Memory(self.folder / "memory.json"), self.stand.reach, self.asked
            )
            leave_out = bool(self.options.get("leave_out"))
            finishing = Finishing(at, forwarder, self.service.connect, "least-squares", leave_out)
            attended = bool(self.options.get("attended"))
            cycle = Cycle(at, preparing, finishing, attended=attended)
            forwarder.start()
            try:
                cycle.run()
            finally:
                forwarder.stop()
            return spool.history
