"""What the cycle asks of the checks."""

from collections.abc import Sequence
from typing import Protocol

from app.exchange.rows import CurrentRecord
from app.station.contracts import Currents
from app.station.entries import Finding, Target
from app.station.history import History


class Stillness(Protocol):
    """Follows readings until they keep still."""

    def add(self, at_s: float, currents: Currents) -> bool:
        """Take a reading in; tell whether the currents are still now."""


class Judge(Protocol):
    """What decides whether a signal, or a record, is good."""

    def settling(self) -> Stillness:
        """After a move."""

    def warming(self) -> Stillness:
        """After power-on."""

    def findings(self, record: CurrentRecord, target: Target, history: History) -> Sequence[Finding]:
        """What is wrong with a record, by itself and beside what was measured before; nothing when it is good."""
