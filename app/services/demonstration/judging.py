"""What the people of the demonstration have said about its gyros: a repair, baselines, an alarm's cause."""

from datetime import datetime, timedelta
from typing import Final

import numpy as np

from app.services import access
from app.services.drift import alarms, baselines, events, series
from app.services.drift.series import aware
from app.services.lab import Person, Work
from app.services.lookup import find_gyro
from simdevice.fleet import DAY, REPAIRED, FleetGyro
from solver.drift.start_means import occasions
from solver.records import PARAMETERS

METROLOGIST: Final = Person("sokolov", "A. Sokolov", "metrologist", frozenset(access.ROLES["metrologist"]))
_TECHNICIAN: Final = Person("petrova", "I. Petrova", "technician", frozenset(access.ROLES["technician"]))


def enter_the_repair(work: Work, now: datetime) -> None:
    """Gyro 0419 was repaired, and somebody wrote it down on the same day."""
    serial, after = REPAIRED
    work.now, work.person = _repaired_at(now), _TECHNICIAN
    note = f"Torquer lead of axis x resoldered, order R-{round(after / DAY)}"
    events.add(work, "repair", work.now, note, gyro=serial)


def freeze_baselines(work: Work, fleet: tuple[FleetGyro, ...], now: datetime) -> None:
    """Each gyro's first starts, of the repaired one those after the repair as well."""
    work.person = METROLOGIST
    for gyro in fleet:
        _freeze(work, gyro.serial, None, "The first sessions of the year")
    _freeze(work, REPAIRED[0], _repaired_at(now), "The first sessions after the repair")


def _freeze(work: Work, serial: str, since: datetime | None, reason: str) -> None:
    table = series.load(work, find_gyro(work, serial).id, "least-squares").between(since, None)
    first = np.flatnonzero(occasions(table["start"]) < baselines.FEWEST)
    work.now = aware(table["measured_at"][first[-1]]) + timedelta(days=1)
    baselines.freeze(work, serial, PARAMETERS, table["calibration"][first].tolist(), reason=reason)


def acknowledge_the_jump(work: Work, now: datetime) -> None:
    """Somebody has looked into the jump of 0423's fixed drift; that of its ωк is left for the next one."""
    work.now, work.person = now, METROLOGIST
    for item in alarms.alarms(work, gyro="0423", state="open"):
        if item.kind == "step" and item.parameter == "w0y":
            alarms.acknowledge(
                work, item.id, "gyro", "Knocked at the transport of that week; seen at goods inward."
            )


def _repaired_at(now: datetime) -> datetime:
    # The fleet's day 0 is a year ago; nobody measured it that afternoon.
    return now - timedelta(days=365) + timedelta(seconds=REPAIRED[1]) - timedelta(hours=1)
