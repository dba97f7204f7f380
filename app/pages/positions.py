"""The position map of a session: θ down, ψ across, and what comes next."""

from collections.abc import Sequence
from dataclasses import dataclass

from app.i18n import gettext
from app.services.views import MeasurementView, PositionView, SessionDetail

METHOD_DURATION_S = 60.0
METHOD_RATE_HZ = 200.0
_TOLERANCE = 1e-3  # of the measurement rule: 0.1 % on duration and rate


@dataclass(frozen=True, slots=True)
class Cell:
    """One cell of the map: class of its look, and the word in it."""

    number: int
    theta_deg: float
    psi_deg: float
    shape: str
    word: str
    current: bool


@dataclass(frozen=True, slots=True)
class PositionMap:
    """Rows by θ, columns by ψ; None where the certificate has no such position."""

    psi_deg: tuple[float, ...]
    rows: tuple[tuple[float, tuple[Cell | None, ...]], ...]


def next_position(positions: Sequence[PositionView]) -> PositionView | None:
    """The first position that is still to be measured."""
    return next((item for item in positions if _is_open(item)), None)


def last_measured(detail: SessionDetail) -> tuple[PositionView, MeasurementView] | None:
    """The position saved last, as it counts now."""
    saved = [
        (item, item.measurement)
        for item in detail.positions
        if item.measurement is not None and not item.measurement.withdrawn
    ]
    return max(saved, key=lambda pair: pair[1].created_at, default=None)


def below_method(measurement: MeasurementView) -> bool:
    """Whether the measurement is known to be shorter or slower than the method asks."""
    short = measurement.duration_s is not None and measurement.duration_s < METHOD_DURATION_S * (
        1 - _TOLERANCE
    )
    slow = measurement.rate_hz is not None and measurement.rate_hz < METHOD_RATE_HZ * (1 - _TOLERANCE)
    return short or slow


def position_map(detail: SessionDetail) -> PositionMap:
    """The map of a session's certified positions; a repeat stands in its position's cell."""
    coming = next_position(detail.positions) if detail.session.state == "measuring" else None
    cells = {
        (item.theta_deg, item.psi_deg): _cell(item, current=item is coming)
        for item in reversed(detail.positions)
    }
    psi = tuple(sorted({place[1] for place in cells}))
    theta = sorted({place[0] for place in cells})
    return PositionMap(psi, tuple((t, tuple(cells.get((t, p)) for p in psi)) for t in theta))


def _is_open(item: PositionView) -> bool:
    return item.measurement is None or item.measurement.withdrawn


def _cell(item: PositionView, *, current: bool) -> Cell:
    shape, word = _look(item)
    if current:
        shape, word = "running", gettext("next")
    return Cell(item.number, item.theta_deg, item.psi_deg, shape, word, current)


def _look(item: PositionView) -> tuple[str, str]:
    if item.measurement is None:
        return "todo", gettext("to do")
    if item.measurement.withdrawn:
        return "excluded", gettext("withdrawn")
    if below_method(item.measurement):
        return "attention", gettext("below method")
    return "ok", gettext("recorded")
