"""The live page's parts in words and figures: what the run is at, its currents now, its log."""

import statistics
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import timedelta
from typing import Any, Final

from app import figures, plots
from app.i18n import LOCALE, gettext, marked, translate
from app.pages.labels import Mark
from app.pages.live_map import LiveMap, Numbers, live_map
from app.plots import LivePoint
from app.services.live_views import CommandView, Reading, RunEvent, RunView, Sentence
from app.services.views import SessionView
from solver.errors import Message

SCATTER_OF: Final = 20
"""Newest settled readings whose scatter is stated."""

_FEWEST: Final = 5
_PHASES: Final = {
    "checking": Mark("running", marked("Checking the instruments")),
    "homing": Mark("running", marked("Seeking the stand’s reference")),
    "warming": Mark("warming", marked("Waiting for the warm-up")),
    "moving": Mark("running", marked("Moving")),
    "settling": Mark("running", marked("Settling")),
    "acquiring": Mark("running", marked("Recording")),
    "paused": Mark("due", marked("Paused")),
    "forwarding": Mark("running", marked("Sending the records")),
    "solving": Mark("running", marked("Asking for the calibration")),
    "finished": Mark("ok", marked("Finished")),
    "stopped": Mark("excluded", marked("Stopped")),
    "failed": Mark("out", marked("Failed")),
}
_LEVELS: Final = {
    "info": Mark("ok", marked("Note")),
    "warning": Mark("attention", marked("Warning")),
    "error": Mark("out", marked("Error")),
}
_COMMANDS: Final = {
    "pause": marked("Pause"),
    "resume": marked("Resume"),
    "skip": marked("Skip position %(number)d"),
    "retake": marked("Take position %(number)d again"),
    "stop": marked("Stop the run"),
}
_OUTCOMES: Final = {
    "open": Mark("due", marked("waiting for the station")),
    "done": Mark("saved", marked("done")),
    "refused": Mark("attention", marked("refused by the station")),
    "lapsed": Mark("excluded", marked("not answered any more")),
}


@dataclass(frozen=True, slots=True)
class Current:
    """A current now: its figure, and the expanded scatter of the last settled readings if there are enough."""

    key: str
    figure: figures.Measured | None


@dataclass(frozen=True, slots=True)
class Seen:
    """Everything that the page's parts show, of one moment."""

    run: RunView
    session: SessionView
    map: LiveMap
    numbers: Numbers

    @property
    def mark(self) -> Mark:
        """The one word for how it stands."""
        run = self.run
        if self.failed:
            return Mark("out", gettext("Finished without a calibration"))
        if run.silent:
            return Mark("lost", gettext("No word from the station"))
        if run.phase in ("acquiring", "settling") and run.settled:
            return Mark("ok", gettext("Settled"))
        return phase(run)

    @property
    def refused(self) -> int:
        """Records that the run refused for good."""
        return sum(cell.state == "refused" for cell in self.run.cells)

    @property
    def suspicious(self) -> int:
        """Records that a check objected to, and that are used all the same."""
        return sum(cell.state == "suspicious" for cell in self.run.cells)

    @property
    def failed(self) -> bool:
        """Whether the run came to its end and to no calibration."""
        return self.run.phase == "finished" and bool(self.refused) and self.session.result is None

    @property
    def doing(self) -> str:
        """What goes on besides the one word: the phase, a further measurement, a further attempt."""
        run, said = self.run, []
        if run.position and not run.ended:
            word = phase(run).word
            if self.mark.word != word:
                said.append(word[:1].lower() + word[1:])
            if run.position.repeat:
                said.append(gettext("measured once more"))
            if run.position.take:
                said.append(gettext("attempt %(number)d") % {"number": run.position.take + 1})
        return ", ".join(said)

    @property
    def currents(self) -> tuple[Current, Current]:
        """Both currents now, µA."""
        settled = [item for item in self.run.readings if item.settled][-SCATTER_OF:]
        return (
            Current("jx", _now(self.run.jx_ma, [item.jx_ma for item in settled])),
            Current("jy", _now(self.run.jy_ma, [item.jy_ma for item in settled])),
        )

    @property
    def left(self) -> str:
        """Time to the end of the cycle: ``0:23``, ``12:05``, ``1:02:05``; a dash when it is not known."""
        return figures.DASH if self.run.left_s is None else _clock(self.run.left_s)

    @property
    def ends(self) -> str:
        """When the cycle ends at about."""
        if self.run.left_s is None or self.run.ended:
            return ""
        return figures.clock(self.run.received_at + timedelta(seconds=self.run.left_s))

    @property
    def warning(self) -> RunEvent | None:
        """The newest event that is more than a note."""
        return next((item for item in self.run.events if item.level != "info"), None)

    @property
    def paused(self) -> bool:
        """Whether going on is the next thing to ask for: paused, and nobody has asked for more since."""
        return self.run.phase == "paused"

    def asked(self, kind: str) -> bool:
        """Whether this is asked for and not answered."""
        return any(item.kind == kind for item in self.run.open_commands)

    def number(self, item: RunEvent | CommandView) -> int | None:
        """The number of the position that it is about."""
        if item.theta_deg is None or item.psi_deg is None:
            return None
        return self.numbers.of(item.theta_deg, item.psi_deg)

    def chart(self, axis: str) -> dict[str, Any]:
        """The chart of one channel as a page first gets it."""
        name = gettext("Current %(axis)s since the stand turned here") % {"axis": axis}
        return plots.live(points(self.run.readings, axis), "x" if axis == "x" else "y", name)

    def news(self, axis: str) -> dict[str, Any]:
        """What has to be told to that chart when it stands in a page already."""
        return plots.live_news(points(self.run.readings, axis))


def seen(run: RunView, session: SessionView, numbers: Numbers) -> Seen:
    """The run as the page shows it."""
    return Seen(run, session, live_map(run, numbers), numbers)


def phase(run: RunView) -> Mark:
    """What a run does."""
    mark = _PHASES[run.phase]
    return Mark(mark.shape, gettext(mark.word))


def level(event: RunEvent) -> Mark:
    """How much an event matters."""
    mark = _LEVELS[event.level]
    return Mark(mark.shape, gettext(mark.word))


def command(item: CommandView, number: int | None) -> str:
    """What was asked."""
    text = gettext(_COMMANDS[item.kind])
    return text % {"number": number} if "%(" in text else text


def outcome(item: CommandView) -> Mark:
    """What became of it."""
    mark = _OUTCOMES[item.state]
    return Mark(mark.shape, gettext(mark.word))


def sentence(said: Sentence) -> str:
    """What the station says, in the reader's language where the catalogue has it.

    Only a translation of ours is ever filled in: a template that came by the network could ask for a
    number of a million digits.
    """
    if LOCALE.get() == "en" or said.template is None or gettext(said.template) == said.template:
        return said.message
    if not said.values:
        return said.message if "%(" in said.template else gettext(said.template)
    try:
        return translate(Message("", said.template, dict(said.values)))
    except (KeyError, TypeError, ValueError):
        return said.message


def points(readings: Sequence[Reading], axis: str) -> list[LivePoint]:
    """Readings as a chart draws them: seconds since the first, µA."""
    return [
        LivePoint(
            round((item.at - readings[0].at).total_seconds(), 2),
            1000 * (item.jx_ma if axis == "x" else item.jy_ma), bool(item.settled),
        )
        for item in readings
    ]  # fmt: skip


def _now(value_ma: float | None, settled_ma: Sequence[float]) -> figures.Measured | None:
    if value_ma is None:
        return None
    enough = len(settled_ma) >= _FEWEST
    return figures.measured(1000 * value_ma, 2000 * statistics.stdev(settled_ma) if enough else None)


def _clock(seconds: float) -> str:
    minutes, rest = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02d}:{rest:02d}" if hours else f"{minutes}:{rest:02d}"
