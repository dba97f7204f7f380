"""A gyro's study as a job makes it: its data out of the database, and in the child process every method's study."""

from collections.abc import Callable, Mapping
from dataclasses import asdict
from typing import Any

from app.exchange.json_values import dumps
from app.services.drift import baselines, events, series, study
from app.services.drift.methods import main_method
from app.services.lab import Work
from app.store import equipment
from solver import __version__

Report = Callable[[float, str], None]


def prepare(work: Work, gyro_id: int) -> dict[str, Any]:
    """What the studying process needs, by method: the series as Arrow, and what it is judged by."""
    gyro = equipment.gyro_by_id(work.db, gyro_id)
    tables = series.load_all(work, gyro_id)
    return {
        "gyro": gyro.serial,
        "interval_days": gyro.type.interval_days,
        "limits": {
            item.parameter: {"low": item.low, "high": item.high, "repeatability": item.repeatability}
            for item in gyro.type.limits
        },
        "events": events.of_gyro(work, gyro.serial),
        "baselines": baselines.of_gyro(work, gyro.serial),
        "series": {method: series.encode(table) for method, table in tables.items()},
    }


def studied(payload: Mapping[str, Any], report: Report) -> dict[str, Any]:
    """Study every method's series.

    The one that stands for the gyro raises its alarms: one finding, one alarm.

    Returns
    -------
    dict
        By method ``document`` (JSON text), ``series`` (Arrow, with the charts' columns), ``solver_version``,
        ``findings`` (as `alarms.Finding`), ``counting`` (ids of the results that count), ``recalibrations`` (what
        was found at the end of intervals).
    """
    made = {}
    heard = main_method(payload["series"])
    for number, (method, content) in enumerate(payload["series"].items()):
        report(number / len(payload["series"]), "studying")
        known = study.Known(
            payload["gyro"], method, payload["limits"], payload["interval_days"], payload["events"],
            tuple(item for item in payload["baselines"] if item.method == method),
        )  # fmt: skip
        found = study.study(series.decode(content), known)
        made[method] = {
            "document": dumps(found.document), "series": series.encode(found.table),
            "solver_version": __version__, "findings": [asdict(item) for item in found.findings if method == heard],
            "counting": found.table["calibration"].tolist(),
            "recalibrations": found.document["interval"]["findings"],
        }  # fmt: skip
    return made
