"""The end of the cycle: everything sent, the calibration asked for and followed, or the reasons why not."""

from collections.abc import Callable, Iterator
from contextlib import closing
from dataclasses import dataclass
from typing import Final

from app.errors import AppError
from app.station.comparing import means
from app.station.keeping.entries import Finished, Queued, Said, Solved, Target, Unsolved
from app.station.measuring import shown
from app.station.plan import Forward, Solve, Step, missing, next_step
from app.station.sending.client import ServerRefused, Unreachable, result_of
from app.station.sending.forwarding import Forwarder
from app.station.sending.service import Service
from app.station.workplace import Workplace
from solver.errors import Message

_POLL_S: Final = 0.1
_LONGEST_PAUSE_S: Final = 10.0


class NotFinished(AppError):
    """The cycle cannot go on now; the same command takes it up again."""


@dataclass(slots=True)
class Finishing:
    """The last steps of a run."""

    at: Workplace
    forwarder: Forwarder
    service: Callable[[], Service]
    method: str
    leave_out: bool = False

    def forward(self) -> None:
        """Wait until the service has every record, or says that it does not take them.

        Raises
        ------
        NotFinished
            The service answers and takes nothing: somebody has to see to it.
        """
        self.at.live.turn_to("forwarding")
        while isinstance(self._next(), Forward):
            refused = self.forwarder.refused
            if refused is not None:
                raise NotFinished(*refused.problems)
            self.at.rest(_POLL_S)

    def solve(self) -> None:
        """Ask for the calibration, once, and follow it."""
        self.at.live.turn_to("solving")
        pause_s = _POLL_S
        with closing(self.service()) as service:
            while isinstance(self._next(), Solve):
                try:
                    self._further(service)
                    pause_s = _POLL_S
                except Unreachable:
                    pause_s = min(2.0 * pause_s, _LONGEST_PAUSE_S)
                except ServerRefused as refused:
                    raise NotFinished(*refused.problems) from refused
                self.at.rest(pause_s)

    def finish(self) -> None:
        """Write down that nothing is left to do, and what the calibration lacks or leaves in doubt."""
        at = self.at
        if at.history.finished is None:
            at.spool.add(Finished(tuple(Said.of(reason) for reason in self._reasons())))

    def _next(self) -> Step:
        return next_step(self.at.history, leave_out=self.leave_out)

    def _further(self, service: Service) -> None:
        """Ask, or look how the job stands."""
        at, history = self.at, self.at.history
        assert history.session is not None
        if history.job is None:
            at.spool.add(Queued(service.calibrate(history.session, self.method)))
            return
        job = service.job(history.job)
        if job["state"] in ("queued", "running"):
            return
        try:
            at.spool.add(Solved(result_of(job)))
        except ServerRefused as failed:
            at.spool.add(Unsolved(failed.problems[0].text))
            raise

    def _reasons(self) -> Iterator[Message]:
        history = self.at.history
        for target in missing(history):
            why = " ".join(dict.fromkeys(said.text for said in self._why(target)))
            yield Message("position-missing", "%(place)s is not in the session: %(why)s",
                          {"place": named(target), "why": why})  # fmt: skip
        for target in history.targets:
            doubtful = self._doubtful(target)
            if doubtful:
                yield Message("position-suspicious", "%(place)s is suspicious: %(why)s",
                              {"place": named(target), "why": " ".join(doubtful)})  # fmt: skip
        unseen = self.at.judge.unseen(means(history)) if history.result is not None else ()
        if unseen:
            yield Message(
                "position-unseen",
                "Nothing would show it if one of these had been measured in another position: %(places)s. Measure "
                "pairs half a turn of ψ apart, three or more, or further positions.",
                {"places": ", ".join(map(shown, unseen))},
            )

    def _doubtful(self, target: Target) -> tuple[str, ...]:
        """What the checks said of a take that is used all the same."""
        take = self.at.history.usable(target)
        if take is None or take.rejected is not None or take.judged is None:
            return ()
        return tuple(dict.fromkeys(finding.said.text for finding in take.judged.findings))

    def _why(self, target: Target) -> Iterator[Said]:
        standing = self.at.history.standing(target)
        if standing is None or standing.judged is None:
            return
        against = standing.rejected or standing.refuted
        if against is not None:
            yield against
            return
        for finding in standing.judged.findings:
            yield finding.said


def named(target: Target) -> str:
    """A target as people call it."""
    return f"{shown(target.place)} (closing)" if target.repeat else shown(target.place)
