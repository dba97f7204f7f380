"""A type's fleet as its page shows it: dots, sorted rows, pooled scatter, correlations."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any, Final, Literal

from app import plots
from app.figures import DASH, Figure, Measured, decimals_of, figure, measured, plain, significant
from app.i18n import gettext
from app.pages import labels
from app.pages.compare import relation
from app.pages.result_view import limit_text
from app.services.drift.due import STATES
from app.services.drift.fleet_statistics import TOGETHER
from app.services.drift.fleet_views import Correlated, Distribution, Fleet, FleetGyro, Pooled, Standing
from app.services.views import COVERAGE_FACTOR
from solver.records import PARAMETERS

ORDER: Final = ("w0x", "w0y", "wg", "wk", "kx", "ky", "kxy", "kyx")
_STATES: Final[dict[str, Literal["within", "conditional", "beyond"]]] = {
    "fails": "beyond",
    "conditional": "conditional",
}
_VERDICTS: Final = ("fails", "undetermined", "conditional", "no-limit", "conforms", None)
_SOURCES: Final = ("between-sessions", "between-starts", "between-days", TOGETHER)


@dataclass(frozen=True, slots=True)
class Panel:
    """One parameter over the gyros."""

    found: Distribution
    spec: plots.theme.Spec
    middle: str
    scatter: str
    limit: str


@dataclass(frozen=True, slots=True)
class Row:
    """One gyro with one parameter's standing, drift and repeatability."""

    gyro: FleetGyro
    item: Standing | None
    shown: Measured | None
    slope: Figure
    expanded: Figure
    drifts: bool
    scatter: Figure
    standing: str


@dataclass(frozen=True, slots=True)
class Scatter:
    """One parameter's pooled components; a cell is None where the histories tell nothing."""

    parameter: str
    unit: str
    cells: tuple["Cell | None", ...]


@dataclass(frozen=True, slots=True)
class Cell:
    """A standard deviation, its interval in words, p of the joined F-tests, and the decimals."""

    sd: Figure
    interval: str
    p: str
    places: int


def panels(fleet: Fleet) -> Iterator[Panel]:
    """A chart of each parameter, in the order of the pages."""
    found = {item.parameter: item for item in fleet.distributions}
    for name in ORDER:
        yield _panel(fleet, found[name])


def _panel(fleet: Fleet, found: Distribution) -> Panel:
    unit = labels.unit(found.unit)
    marked = {found.nearest, found.drifting, found.scattering}
    points = [
        _point(gyro, gyro.parameters[found.parameter], unit, gyro.serial in marked)
        for gyro in fleet.gyros
        if found.parameter in gyro.parameters and gyro.parameters[found.parameter].value.value is not None
    ]
    limits = [
        plots.DriftLimit(value, "below" if side == "low" else "above", "")
        for side, value in (("low", found.low), ("high", found.high))
        if value is not None
    ]
    described = gettext("%(parameter)s of %(count)d gyros of the type %(type)s") % {
        "parameter": labels.parameter(found.parameter), "count": found.gyros, "type": fleet.type,
    }  # fmt: skip
    decimals = decimals_of(found.sd) if found.sd else None
    middle = DASH if found.mean is None else str(figure(found.mean, 4 if decimals is None else decimals))
    return Panel(
        found, plots.distribution(points, limits, found.quartiles, described), middle,
        significant(found.sd, 2) if found.sd is not None else "", limit_text(found.low, found.high),
    )  # fmt: skip


def _point(gyro: FleetGyro, item: Standing, unit: str, named: bool) -> plots.DistributionPoint:
    value = item.value
    name = gettext("%(gyro)s: %(value)s %(unit)s") % {
        "gyro": gyro.serial, "value": measured(value.value, value.expanded), "unit": unit,
    }  # fmt: skip
    state = _STATES.get(value.verdict, "within")
    label = gyro.serial if named or state == "beyond" else ""
    return plots.DistributionPoint(value.value or 0.0, state, name, label, f"/gyros/{gyro.serial}")


_Key = Callable[[FleetGyro, Standing | None], Any]
SORTS: Final[dict[str, _Key]] = {
    "gyro": lambda gyro, _item: gyro.serial,
    "status": lambda gyro, _item: -_VERDICTS.index(gyro.verdict),
    "due": lambda gyro, _item: (-STATES.index(gyro.due.state), -(gyro.due.days or 0)),
    "alarms": lambda gyro, _item: gyro.alarms,
    "value": lambda _gyro, item: _known(item.value.value if item else None),
    "standing": lambda _gyro, item: _known(item.standing if item else None),
    "drift": lambda _gyro, item: _known(abs(item.slope) if item and item.slope is not None else None),
    "scatter": lambda _gyro, item: _known(item.scatter if item else None),
    "interval": lambda gyro, _item: -_known(gyro.recommended_days, float("inf")),
}
"""By what the gyros can be sorted; descending puts the worst first."""
WORST_FIRST: Final = "-standing"


def _known(value: float | None, otherwise: float = float("-inf")) -> float:
    return otherwise if value is None else value


def rows(fleet: Fleet, parameter: str, sort: str) -> list[Row]:
    """Every gyro in the wanted order, those alike by serial number."""
    key = SORTS.get(sort.removeprefix("-"), SORTS["standing"])
    ordered = sorted(
        fleet.gyros, key=lambda gyro: key(gyro, gyro.parameters.get(parameter)), reverse=sort.startswith("-")
    )
    known = [item for gyro in fleet.gyros if (item := gyro.parameters.get(parameter))]
    slopes = _places([_expanded(item) for item in known])
    largest = max((item.scatter or 0.0 for item in known), default=0.0)
    scatters = min(6, max(0, (decimals_of(largest) or 2) + 1))
    return [_row(gyro, gyro.parameters.get(parameter), slopes, scatters) for gyro in ordered]


def _expanded(item: Standing | None) -> float | None:
    """U of the change per year."""
    return None if item is None or item.u_slope is None else COVERAGE_FACTOR * item.u_slope


def _places(values: Sequence[float | None]) -> int:
    """Decimals that show two digits of the smallest of them."""
    known = [decimals for value in values if value and (decimals := decimals_of(value)) is not None]
    return min(6, max(0, max(known, default=3)))


def _row(gyro: FleetGyro, item: Standing | None, slopes: int, scatters: int) -> Row:
    known = item is not None and item.value.value is not None
    return Row(
        gyro, item, measured(item.value.value, item.value.expanded) if item and known else None,
        figure(item.slope if item else None, slopes, sign=True), figure(_expanded(item), slopes),
        bool(item and item.p_slope is not None and item.p_slope < 0.05),
        figure(item.scatter if item else None, scatters),
        "" if item is None or item.standing is None else f"{plain(round(100 * item.standing))} %",
    )  # fmt: skip


def pooled(fleet: Fleet) -> tuple[tuple[str, ...], list[Scatter]]:
    """The sources that the histories tell of, and a row for each parameter."""
    told = {item.source for found in fleet.pooled.values() for item in found}
    sources = tuple(source for source in _SOURCES if source in told)
    units = {item.parameter: item.unit for item in fleet.distributions}
    return sources, [
        Scatter(name, units[name], tuple(_cell(fleet.pooled[name], source) for source in sources))
        for name in ORDER
        if fleet.pooled.get(name)
    ]


def _cell(found: Sequence[Pooled], source: str) -> Cell | None:
    item = next((item for item in found if item.source == source), None)
    if item is None:
        return None
    places = decimals_of(item.sd)
    places = 4 if places is None else min(6, max(0, places))
    interval = (
        ""
        if item.low is None or item.high is None
        else f"{figure(item.low, places)}–{figure(item.high, places)}"
    )
    return Cell(
        figure(item.sd, places), interval, "" if item.p_value is None else relation(item.p_value), places
    )


def correlation_chart(fleet: Fleet) -> plots.theme.Spec | None:
    """The map of the pairs; None for too few gyros."""
    if not fleet.correlations:
        return None
    place = {name: number for number, name in enumerate(PARAMETERS)}
    marks = [
        plots.CorrelationMark(
            labels.symbol_text(low), labels.symbol_text(high), item.coefficient, item.sure,
            correlated(item), f"#{item.first}-{item.second}",
        )
        for item in fleet.correlations
        for high, low in [sorted((item.first, item.second), key=lambda name: place[name])]
    ]  # fmt: skip
    order = [labels.symbol_text(name) for name in PARAMETERS]
    return plots.correlation_map(
        marks, order, gettext("Correlation of each pair of parameters over the gyros")
    )


def correlated(item: Correlated) -> str:
    """A pair in words."""
    return gettext("%(first)s with %(second)s: r = %(r)s, p %(p)s after Holm") % {
        "first": labels.symbol_text(item.first), "second": labels.symbol_text(item.second),
        "r": figure(item.coefficient, 2, sign=True), "p": relation(item.p_holm),
    }  # fmt: skip
