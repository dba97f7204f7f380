"""What the calibrations of all gyros of a type say of the interval of each: asked when it is shown.

A gyro's study knows its own calibrations only. Those of its type come with every gyro's next session; judged when they
are read, all gyros of a type are judged by the same ones.
"""

from app.exchange.json_values import Json
from app.services.drift import intervals
from app.services.lab import Work
from app.store import fleet
from app.store.tables import GyroType
from solver.drift.recalibrating.recalibration import MethodAdvice


def advice(work: Work, kind: GyroType, method: str) -> MethodAdvice | None:
    """By the share of all the type's calibrations that found everything within limits; None without any."""
    limits = {item.parameter: {"low": item.low, "high": item.high} for item in kind.limits}
    return intervals.type_advice(kind.interval_days, fleet.recalibrations(work.db, kind.id, method), limits)


def document_by_type(work: Work, kind: GyroType, method: str, document: Json) -> Json:
    """A gyro's study with the interval judged by its type."""
    interval = document.get("interval")
    if not interval:
        return document
    return {**document, "interval": intervals.by_type(interval, advice(work, kind, method))}
