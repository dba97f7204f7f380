"""A gyro's parameters over time."""

from collections.abc import Mapping, Sequence
from datetime import datetime

from app.errors import Invalid, problem
from app.exchange.si import PARAMETER_UNITS
from app.services.finding import find_gyro
from app.services.lab import Work
from app.services.verdicts import coverage_factor, judge
from app.services.views import HistoryPoint, HistorySeries
from app.store import results
from app.store.tables import Calibration, CalibrationParameter
from solver.records import PARAMETERS


def history(
    work: Work,
    serial: str,
    *,
    parameter: str | None = None,
    since: datetime | None = None,
    until: datetime | None = None,
    method: str = "least-squares",
) -> tuple[HistorySeries, ...]:
    """Each parameter (or the one asked for) over time; of each session the newest result counts."""
    gyro = find_gyro(work, serial)
    if parameter is not None and parameter not in PARAMETERS:
        raise Invalid(problem("unknown-parameter",
                              "There is no parameter “%(name)s”; choose among %(names)s.",
                              column="parameter", name=parameter, names=", ".join(PARAMETERS)))  # fmt: skip
    limits = {item.parameter: (item.low, item.high) for item in gyro.type.limits}
    rows = results.series(work.db, gyro.id, method=method, parameter=parameter, since=since, until=until)
    points: dict[str, list[HistoryPoint]] = {name: [] for name in PARAMETERS if parameter in (None, name)}
    for value, result in rows:
        points[value.parameter].append(_point(value, result, limits))
    return tuple(_series(name, limits.get(name, (None, None)), found) for name, found in points.items())


def _series(
    name: str, limits: tuple[float | None, float | None], points: Sequence[HistoryPoint]
) -> HistorySeries:
    low, high = limits
    return HistorySeries(name, PARAMETER_UNITS[name][0], low, high, tuple(points))


def _point(
    value: CalibrationParameter, result: Calibration, limits: Mapping[str, tuple[float, float]]
) -> HistoryPoint:
    session = result.session
    low, high = limits.get(value.parameter, (None, None))
    return HistoryPoint(
        calibration=result.id, session=session.id, measured_at=session.started_at,
        start=session.start.number, stand=session.stand.name, certificate=session.certificate.number,
        value=value.value, u=value.standard_uncertainty, k=coverage_factor(value),
        verdict=judge(value.value, value.standard_uncertainty, low, high, coverage_factor(value)),
    )  # fmt: skip
