"""What was found of a type's gyros, of a gyro and of a stand, as tables: the same rows for pages and programs."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from typing import Any, Final

from app.exchange.json_values import message_from
from app.exchange.si import PARAMETER_UNITS
from app.exchange.written import Cell
from app.services.drift.fleet_rows import field
from app.services.drift.fleet_views import Distribution, Fleet
from solver.records import PARAMETERS

Document = Mapping[str, Any]
Row = dict[str, Cell]


@dataclass(frozen=True, slots=True)
class Table:
    """Rows that all have the same columns."""

    columns: tuple[str, ...]
    rows: tuple[Row, ...]


_DISTRIBUTION: Final = (
    "parameter", "unit", "low", "high", "gyros", "mean", "sd", "between", "p_normal", "lower_quartile", "median",
    "upper_quartile", "nearest", "farthest", "drifting", "steadiest", "scattering", "repeating",
)  # fmt: skip
_COMPONENT: Final = ("source", "sd", "low", "high", "dof", "gyros", "p_value")
_CORRELATION: Final = ("first", "second", "coefficient", "p_value", "p_holm", "gyros", "sure")
_CHANGE: Final = ("kind", "session", "calibration", "at", "before", "size", "u", "p_value", "event")
_TREND: Final = (
    "model", "since", "sessions", "level", "slope_per_year", "u_slope_per_year", "p_value", "time_constant_days",
    "scatter", "dof",
)  # fmt: skip
_BAND: Final = ("probability", "at", "value", "low", "high")
_INTERVAL: Final = ("method", "days", "interval_of", "reason")
_FINDING: Final = (
    "verdict", "direction", "session", "calibration", "at", "since", "until", "size_arcsec", "u_arcsec",
    "probability", "gyro", "event", "event_kind",
)  # fmt: skip
_TIMES: Final = frozenset({"at", "before", "since", "until", "date", "earliest", "latest"})


def distributions(fleet: Fleet) -> Table:
    """How each parameter lies over the gyros of a type."""
    return _table(_DISTRIBUTION, (_distribution(item) for item in fleet.distributions))


def components(fleet: Fleet) -> Table:
    """Each parameter's components of variance, pooled over the gyros."""
    return _table(
        ("parameter", "unit", *_COMPONENT),
        (
            _of(name) | {part: getattr(item, part) for part in _COMPONENT}
            for name, found in fleet.pooled.items()
            for item in found
        ),
    )


def correlations(fleet: Fleet) -> Table:
    """Each pair of parameters over the gyros."""
    return _table(
        _CORRELATION,
        (
            {part: getattr(item, part) for part in _CORRELATION} | {"sure": int(item.sure)}
            for item in fleet.correlations
        ),
    )


def changes(document: Document) -> Table:
    """A gyro's steps and bends, a bend's size in units a year; `dates` with the probability of each session."""
    return _table(
        ("parameter", "unit", *_CHANGE, "dates"),
        (
            _of(name) | _picked(item, _CHANGE) | {"dates": _dates(item["dates"])}
            for name, entry in document["parameters"].items()
            for item in entry["changes"]
        ),
    )


def trends(document: Document) -> Table:
    """The last stretch of the course of each of a gyro's parameters, and when it leaves the limits."""
    leaving = ("side", "limit", "date", "earliest", "latest")
    return _table(
        ("parameter", "unit", *_TREND, *(f"leaves_{part}" for part in leaving)),
        (
            _of(name)
            | _picked(entry["trend"], _TREND)
            | {
                f"leaves_{part}": _cell(part, (entry["forecast"]["leaves"] or {}).get(part))
                for part in leaving
            }
            for name, entry in document["parameters"].items()
            if entry["trend"] is not None
        ),
    )


def forecasts(document: Document) -> Table:
    """The band that holds the next values of each of a gyro's parameters."""
    return _table(("parameter", "unit", *_BAND), _bands(document["parameters"]))


def intervals(document: Document) -> Table:
    """What each method recommends for a gyro's recalibration, and all of them together (`recommended`)."""
    found = document["interval"]
    told: list[Document] = [*found["methods"]]
    if found["reason"] is not None:
        told.append(
            {"method": "recommended", "days": found["recommended_days"], "interval_of": "recalibration",
             "reason": found["reason"]}
        )  # fmt: skip
    said = (_picked(item, _INTERVAL) | {"reason": message_from(item["reason"]).text} for item in told)
    return _table(_INTERVAL, said)


def findings(document: Document) -> Table:
    """What was found of a stand, with how far each parameter of its gyros was shifted."""
    shifts = [(name, f"{part}shift_{field(name)}") for name in PARAMETERS for part in ("", "u_")]
    return _table(
        (*_FINDING, *(column for _, column in shifts)),
        (
            _picked(item, _FINDING)
            | {
                column: (item["shift"].get(name) or {}).get("u" if column.startswith("u_") else "value")
                for name, column in shifts
            }
            for item in document["findings"]
        ),
    )


OF_TYPE: Final[Mapping[str, Callable[[Fleet], Table]]] = {
    "distributions": distributions, "components": components, "correlations": correlations,
}  # fmt: skip
OF_GYRO: Final[Mapping[str, Callable[[Document], Table]]] = {
    "changes": changes, "trends": trends, "forecasts": forecasts, "intervals": intervals,
}  # fmt: skip
NOTHING: Final[Document] = {
    "parameters": {}, "interval": {"methods": [], "reason": None}, "findings": [],
}  # fmt: skip
"""Stands for a study's document before there is one."""


def _table(columns: Sequence[str], rows: Iterator[Row]) -> Table:
    return Table(tuple(columns), tuple({name: row[name] for name in columns} for row in rows))


def _of(parameter: str) -> Row:
    return {"parameter": parameter, "unit": PARAMETER_UNITS[parameter][0]}


def _distribution(item: Distribution) -> Row:
    low, middle, high = item.quartiles or (None, None, None)
    row: Row = {"lower_quartile": low, "median": middle, "upper_quartile": high}
    return row | {part: getattr(item, part) for part in _DISTRIBUTION if part not in row}


def _bands(parameters: Mapping[str, Document]) -> Iterator[Row]:
    for name, entry in parameters.items():
        band = entry["forecast"] or {"at": []}
        for place, at in enumerate(band["at"]):
            ends = {side: band[side][place] if band[side] else None for side in ("value", "low", "high")}
            yield _of(name) | {"probability": band["probability"], "at": _cell("at", at)} | ends


def _picked(item: Document, names: Sequence[str]) -> Row:
    return {name: _cell(name, item[name]) for name in names if name != "reason"}


def _cell(name: str, value: Any) -> Cell:
    found: Cell = datetime.fromisoformat(value) if name in _TIMES and value is not None else value
    return found


def _dates(dates: Sequence[Document]) -> str:
    return " ".join(f"{item['session']}:{item['probability']:.4g}" for item in dates)
