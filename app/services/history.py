"""A gyro's parameters over time."""

from collections.abc import Iterator
from datetime import datetime

from app.errors import Invalid, problem
from app.exchange.si import PARAMETER_UNITS
from app.services.drift import series
from app.services.drift.series import SeriesTable, aware
from app.services.lab import Work
from app.services.lookup import find_gyro
from app.services.verdicts import judge
from app.services.views import HistoryPoint, HistorySeries
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
    """Each parameter (or the one asked for) over time, every session; of each the newest result counts.

    What came in last is there, whether the gyro's drift has been studied since or not.
    """
    gyro = find_gyro(work, serial)
    if parameter is not None and parameter not in PARAMETERS:
        raise Invalid(problem("unknown-parameter",
                              "There is no parameter “%(name)s”; choose among %(names)s.",
                              column="parameter", name=parameter, names=", ".join(PARAMETERS)))  # fmt: skip
    limits = {item.parameter: (item.low, item.high) for item in gyro.type.limits}
    table = series.current(work, gyro.id, method).between(since, until)
    return tuple(
        _series(table, name, *limits.get(name, (None, None)))
        for name in PARAMETERS
        if parameter in (None, name)
    )


def _series(table: SeriesTable, name: str, low: float | None, high: float | None) -> HistorySeries:
    return HistorySeries(name, PARAMETER_UNITS[name][0], low, high, tuple(_points(table, name, low, high)))


def _points(table: SeriesTable, name: str, low: float | None, high: float | None) -> Iterator[HistoryPoint]:
    heads = [table[column].tolist() for column in ("calibration", "session", "start", "stand", "certificate")]
    parts = [series.known(table[f"{name}.{part}"]) for part in ("value", "u")]
    rows = zip(*heads, *parts, table[f"{name}.k"].tolist(), table["measured_at"], strict=True)
    for calibration, session, start, stand, certificate, value, u, k, at in rows:
        yield HistoryPoint(
            calibration=calibration, session=session, measured_at=aware(at), start=start, stand=stand,
            certificate=certificate, value=value, u=u, k=k, verdict=judge(value, u, low, high, k),
        )  # fmt: skip
