"""The position map of a run at a stand: what each position is doing, and which can be asked for again."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final

from app.exchange.positions import same_angle
from app.i18n import gettext, marked
from app.services.live_views import CellPhase, CellState, RunView
from app.services.views import PositionView

Place = tuple[float, float]

_LOOKS: Final[Mapping[CellPhase, tuple[str, str]]] = {
    "todo": ("todo", marked("to do")),
    "moving": ("running", marked("moving")),
    "settling": ("running", marked("settling")),
    "warming": ("warming", marked("warming up")),
    "running": ("running", marked("recording")),
    "recorded": ("ok", marked("recorded")),
    "suspicious": ("attention", marked("suspicious")),
    "refused": ("out", marked("refused")),
    "skipped": ("excluded", marked("skipped")),
}
_BUSY: Final = ("running", "settling", "moving", "warming")
_BAD: Final = ("refused", "suspicious")
_TAKEN: Final = ("recorded", "suspicious", "refused", "skipped")


@dataclass(frozen=True, slots=True)
class LiveCell:
    """One cell: class of its look, the word in it, whether the station is there, whether it may be taken again.

    `asked` says that it is asked for again already.
    """

    number: int
    theta_deg: float
    psi_deg: float
    shape: str
    word: str
    current: bool
    again: bool
    asked: bool

    @property
    def place(self) -> str:
        """The position as a form sends it."""
        return f"{self.theta_deg!r}/{self.psi_deg!r}"


@dataclass(frozen=True, slots=True)
class LiveMap:
    """Rows by θ, columns by ψ; None where the run has no such position. `taken` of `total` are recorded."""

    psi_deg: tuple[float, ...]
    rows: tuple[tuple[float, tuple[LiveCell | None, ...]], ...]
    taken: int
    total: int
    current: LiveCell | None


class Numbers:
    """Numbers of positions as the session counts them; a position that is not certified follows after."""

    def __init__(self, positions: Sequence[PositionView]) -> None:
        self._known: dict[Place, int] = {(item.theta_deg, item.psi_deg): item.number for item in positions}

    def of(self, theta_deg: float, psi_deg: float) -> int:
        """The number of a position; a turn further it is the same."""
        place = (theta_deg, psi_deg)
        if place not in self._known:
            same = (number for (theta, psi), number in self._known.items()
                    if same_angle(theta, theta_deg) and same_angle(psi, psi_deg))  # fmt: skip
            self._known[place] = next(same, max(self._known.values(), default=0) + 1)
        return self._known[place]


def live_map(run: RunView, numbers: Numbers) -> LiveMap:
    """The map of a run; all measurements of a position stand in its one cell."""
    by_place: dict[Place, list[CellState]] = {}
    for cell in run.cells:
        given_up = run.ended and cell.state in _BUSY
        kept = cell._replace(state="todo") if given_up else cell
        by_place.setdefault((cell.theta_deg, cell.psi_deg), []).append(kept)
    asked = {(item.theta_deg, item.psi_deg) for item in run.open_commands if item.kind == "retake"}
    here = (run.position.theta_deg, run.position.psi_deg) if run.position and not run.ended else None
    cells = {
        place: _cell(place, states, numbers.of(*place), current=place == here, asked=place in asked)
        for place, states in sorted(by_place.items())
    }
    psi = tuple(sorted({place[1] for place in cells}))
    theta = sorted({place[0] for place in cells})
    taken = sum(
        any(item.state in ("recorded", "suspicious") for item in states) for states in by_place.values()
    )
    return LiveMap(
        psi, tuple((t, tuple(cells.get((t, p)) for p in psi)) for t in theta), taken, len(cells),
        cells.get(here) if here else None,
    )  # fmt: skip


def _cell(place: Place, states: Sequence[CellState], number: int, *, current: bool, asked: bool) -> LiveCell:
    found = [item.state for item in sorted(states, key=lambda item: item.repeat)]
    busy = next((item for item in _BUSY if item in found), None)
    shape, word = _look(found)
    again = busy is None and any(item in _TAKEN for item in found)
    if asked:
        shape, word = "due", gettext("to retake")
    return LiveCell(number, *place, shape, word, current, again and not asked, asked)


def _look(states: Sequence[CellPhase]) -> tuple[str, str]:
    """What stands out of a position's measurements: what goes on, what is wrong, how many are recorded."""
    for notable in (*_BUSY, *_BAD):
        if notable in states:
            return _said(notable)
    recorded = states.count("recorded")
    if 0 < recorded < len(states):
        word = gettext("%(n)d of %(total)d") % {"n": recorded, "total": len(states)}
        return _LOOKS["recorded"][0], word
    return _said(states[0])


def _said(state: CellPhase) -> tuple[str, str]:
    shape, word = _LOOKS[state]
    return shape, gettext(word)
