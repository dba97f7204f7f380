"""What the cycle asks of the checks, and the answer for a laboratory's thresholds and a type's expectations."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Final, Protocol

import numpy as np

from app.exchange.rows import CurrentRecord
from app.station.contracts import Currents, Place
from app.station.judgement import checks, control, partners
from app.station.judgement.checks import Take
from app.station.judgement.expectations import Expectations, Thresholds
from app.station.judgement.samples import limit_of_noise
from app.station.judgement.settling import RestRule, RestWatch
from app.station.keeping.entries import Finding, Said, Target, Verdict
from app.station.keeping.history import History
from solver.errors import Message

_NA_PER_MA: Final = 1e6
_WRONG_BY: Final = frozenset({"drifting"})
"""Warnings that make a result wrong, where others make it uncertain: no calibration rests on them."""


class Stillness(Protocol):
    """Follows readings until they keep still."""

    def add(self, at_s: float, currents: Currents) -> bool | None:
        """Take a reading in; tell whether the currents are still now, None as long as nobody can tell."""


class Judge(Protocol):
    """What decides whether a signal, a record, or a session's records together are good."""

    def settling(self) -> Stillness:
        """After a move."""

    def warming(self) -> Stillness:
        """After power-on."""

    def findings(
        self, record: CurrentRecord, overload: bool, target: Target, history: History
    ) -> Sequence[Finding]:
        """What is wrong with a record; nothing when it is good."""

    def odd(
        self, means: Mapping[Place, Currents], history: History
    ) -> Iterable[tuple[Message, tuple[Place, ...]]]:
        """Places whose currents do not fit the others', and how."""

    def unseen(self, means: Mapping[Place, Currents]) -> tuple[Place, ...]:
        """Places of which nothing would show that they were measured in another position."""


@dataclass(frozen=True, slots=True)
class _Watch:
    watch: RestWatch

    def add(self, at_s: float, currents: Currents) -> bool | None:
        return self.watch.add(at_s, *currents).settled


@dataclass(frozen=True, slots=True)
class Rules:
    """A `Judge` by rules.

    Attributes
    ----------
    rest, warm
        When the currents have settled after a move, and when the gyro is warm.
    thresholds
        Of the laboratory.
    types
        What is expected of each type of gyro.
    largest_ma
        End of the ammeter's range.
    """

    rest: RestRule
    warm: RestRule
    thresholds: Thresholds
    types: Mapping[str, Expectations]
    largest_ma: float = np.inf

    def settling(self) -> Stillness:
        """As the protocol says."""
        return _Watch(RestWatch(self.rest))

    def warming(self) -> Stillness:
        """As the protocol says."""
        return _Watch(RestWatch(self.warm))

    def findings(
        self, record: CurrentRecord, overload: bool, target: Target, history: History
    ) -> Sequence[Finding]:
        """By itself, beside the reading before it, and beside the first record when it is the closing one."""
        take = Take(record.t_s, record.jx_ma, record.jy_ma, overload)
        expected = self._expected(history)
        found = [
            _finding(item)
            for item in checks.judged(take, self.thresholds, expected, largest_ma=self.largest_ma)
        ]
        found += self._beside_reading(take, history)
        if target.repeat and not any(item.verdict == "refused" for item in found):
            found += self._closing(record, target, history)
        return found

    def _beside_reading(self, take: Take, history: History) -> list[Finding]:
        """Whether the record goes on from what the ammeter showed when it was begun.

        A single reading has the noise of a sample, and may still have moved as far as a current at rest does in
        one window. What is further off was read with another unit, or from another channel.
        """
        attempt = history.open_attempt
        acquiring = attempt.acquiring if attempt is not None else None
        if acquiring is None or acquiring.reading is None or take.overload:
            return []
        moved_ma = self.rest.limit_na_per_s * self.rest.window_s / _NA_PER_MA
        found = []
        for name, values, reading in zip(
            ("Jx", "Jy"), (take.jx_ma, take.jy_ma), acquiring.reading, strict=True
        ):
            median = float(np.median(values))
            if abs(median - reading) > limit_of_noise(values, self.thresholds.false_alarm / 2.0) + moved_ma:
                message = Message(
                    "reading",
                    "%(channel)s is %(mean).4g mA in the record and was %(reading).4g mA in the reading just before. "
                    "Compare units and order of channels of `reading` and `fetch` in the station's file; if they "
                    "are right, measure again.",
                    {"channel": name, "mean": median, "reading": reading},
                )
                found.append(Finding(Said.of(message), "refused"))
        return found

    def odd(
        self, means: Mapping[Place, Currents], history: History
    ) -> Iterable[tuple[Message, tuple[Place, ...]]]:
        """Pairs of partners whose sum is not that of the others."""
        for pair in partners.odd_pairs(means, self._partners_na(history)):
            yield pair.message, pair.places

    def unseen(self, means: Mapping[Place, Currents]) -> tuple[Place, ...]:
        """As the protocol says."""
        return control.unseen(means)

    def _partners_na(self, history: History) -> float:
        """What sums of partners may differ by: what matters, and what the certified angles do of themselves."""
        expected = self._expected(history)
        matters = expected.partner_na or self.thresholds.partner_na
        if history.turned_arcsec is None or not expected.scale_deg_per_h_per_ma:
            return matters
        return matters + partners.by_angles_na(
            history.turned_arcsec, expected.scale_deg_per_h_per_ma, expected.g_drift_deg_per_h
        )

    def _expected(self, history: History) -> Expectations:
        return self.types.get(history.gyro_type or "", Expectations())

    def _closing(self, record: CurrentRecord, target: Target, history: History) -> list[Finding]:
        """Whether the session ends as it began: what changed meanwhile is in every other position too."""
        first = history.usable(Target(target.theta_deg, target.psi_deg))
        if first is None or first.judged is None or first.judged.jx_ma is None or first.judged.jy_ma is None:
            return []
        allowed = self._expected(history).drift_na or self.thresholds.drift_na
        changes = (record.jx_ma.mean() - first.judged.jx_ma, record.jy_ma.mean() - first.judged.jy_ma)
        change = max((float(change) * _NA_PER_MA for change in changes), key=abs)
        if abs(change) <= allowed:
            return []
        message = Message(
            "closing",
            "The first position measured again at the end differs by %(change).0f nA, more than %(allowed).0f nA: "
            "gyro, stand or ammeter changed during the session. Let them warm up and measure all of it again.",
            {"change": change, "allowed": allowed},
        )
        return [Finding(Said.of(message), "refused")]


def _finding(found: checks.Finding) -> Finding:
    """A check's objection, and what the take is worth by it.

    A warning about something that another take cannot change concerns the gyro, not the take.
    """
    verdict: Verdict = "suspicious" if found.again else "accepted"
    if found.level == "error" or found.code in _WRONG_BY:
        verdict = "refused"
    return Finding(Said.of(found.message), verdict)
