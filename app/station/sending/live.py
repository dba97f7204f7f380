"""What the cycle is doing this very moment, for whoever looks on; nothing is decided by it."""

from dataclasses import dataclass, replace
from typing import Any, Literal

from app.station.contracts import Currents
from app.station.keeping.entries import Target

Phase = Literal[
    "checking", "homing", "warming", "moving", "settling", "acquiring", "paused", "forwarding", "solving",
    "finished", "stopped", "failed",
]  # fmt: skip


@dataclass(frozen=True, slots=True)
class Activity:
    """The moment: phase, which take of what, currents and whether they have settled, part of the record."""

    phase: Phase = "checking"
    target: Target | None = None
    take: int = 0
    currents: Currents | None = None
    settled: bool | None = None
    fraction: float | None = None
    paused: bool = False


class Live:
    """The present activity; one thread writes, any may read."""

    def __init__(self) -> None:
        self.now = Activity()

    def turn_to(self, phase: Phase, target: Target | None = None, take: int = 0) -> None:
        """A new phase begins."""
        self.now = Activity(phase, target, take, paused=self.now.paused)

    def show(self, **changes: Any) -> None:
        """Show more of the same phase."""
        self.now = replace(self.now, **changes)
