"""All gyros of a type: where each stands, where it goes, how it repeats, and what they have in common.

Values are those of each gyro's last sound calibration (`due`); drift rates, repeatability and recommended
intervals come from the stored studies, so that the cost does not grow with the length of histories; the intervals
with the advice of all the type's calibrations (`type_intervals`). Of a gyro without results by least squares it is
the study by the method that stands for it (`methods`).
"""

import json
from collections.abc import Mapping, Sequence
from statistics import median_low
from typing import Any, Final

from app.errors import NotFound, problem
from app.services import verdicts
from app.services.drift import due, fleet_statistics, intervals, type_intervals
from app.services.drift.due import Due
from app.services.drift.fleet_views import Fleet, FleetGyro, Standing, TypeInterval
from app.services.drift.methods import main_method
from app.services.lab import Work
from app.services.views import ParameterView
from app.store import equipment
from app.store import fleet as stored
from app.store.fleet import Studied
from app.store.tables import Calibration
from solver.drift.recalibrating.recalibration import MethodAdvice

METHOD: Final = "least-squares"
Document = Mapping[str, Any]


def fleet(work: Work, type_name: str) -> Fleet:
    """Everything about the gyros of a type, by serial number.

    Raises
    ------
    NotFound
        There is no such type.
    """
    kind = equipment.gyro_type(work.db, type_name)
    if kind is None:
        raise NotFound(problem("unknown-type", "There is no type %(name)s.", name=type_name))
    holds = due.due_list(work, type_name=type_name)
    ids = {row.serial: row.gyro_id for row in stored.last_sound(work.db, type_name=type_name)}
    methods = _methods(work, list(ids.values()))
    studies: dict[int, Studied] = {}
    alarms: dict[int, int] = {}
    for method, members in methods.items():
        studies |= {row.gyro_id: row for row in stored.studies_of(work.db, members, method)}
        alarms |= stored.open_alarms(work.db, members, method)
    results = stored.results_of(work.db, [item.calibration for item in holds if item.calibration is not None])
    documents = {key: json.loads(row.document) for key, row in studies.items() if row.document is not None}
    advice = type_intervals.advice(work, kind, METHOD)
    gyros = tuple(
        _gyro(
            item, results.get(item.calibration or 0), documents.get(ids[item.gyro], {}),
            alarms=alarms.get(ids[item.gyro], 0), study=studies.get(ids[item.gyro]), advice=advice,
        )
        for item in sorted(holds, key=lambda item: item.gyro)
    )  # fmt: skip
    return Fleet(
        type=kind.name, method=METHOD, gyros=gyros,
        distributions=fleet_statistics.distributions(gyros),
        pooled=fleet_statistics.pooled(list(documents.values())),
        correlations=fleet_statistics.correlations(gyros),
        interval=_interval(kind.interval_days, gyros), counts=due.counts(holds),
    )  # fmt: skip


def _methods(work: Work, gyro_ids: Sequence[int]) -> dict[str, list[int]]:
    """By the method that stands for them the gyros that have results."""
    known: dict[int, list[str]] = {}
    for gyro_id, method in stored.studied_methods(work.db, gyro_ids):
        known.setdefault(gyro_id, []).append(method)
    found: dict[str, list[int]] = {}
    for gyro_id, methods in known.items():
        found.setdefault(main_method(methods), []).append(gyro_id)
    return found


def _gyro(
    holds: Due, result: Calibration | None, document: Document, *, alarms: int, study: Studied | None,
    advice: MethodAdvice | None,
) -> FleetGyro:  # fmt: skip
    found = verdicts.summary(result) if result else None
    views = found.parameters if found else {}
    interval = intervals.by_type(document.get("interval") or {}, advice)
    return FleetGyro(
        due=holds, verdict=found.verdict if found else None,
        parameters={
            name: standing(view, document.get("parameters", {}).get(name) or {}) for name, view in views.items()
        },
        sessions=document.get("sessions"), recommended_days=interval.get("recommended_days"), alarms=alarms,
        up_to_date=study is None or study.up_to_date,
    )  # fmt: skip


def standing(view: ParameterView, study: Document) -> Standing:
    """One parameter of one gyro, from its value and from what its study found."""
    trend, together = study.get("trend") or {}, study.get("together") or {}
    return Standing(
        value=view, standing=_standing(view),
        slope=trend.get("slope_per_year"), u_slope=trend.get("u_slope_per_year"), p_slope=trend.get("p_value"),
        scatter=together.get("sd"), scatter_dof=together.get("dof"),
        repeatability=study.get("repeatability_verdict"), steps=len(study.get("changes") or ()),
    )  # fmt: skip


def _standing(view: ParameterView) -> float | None:
    if view.value is None or view.low is None or view.high is None:
        return None
    return abs(2.0 * view.value - view.high - view.low) / (view.high - view.low)


def _interval(stated: int | None, gyros: Sequence[FleetGyro]) -> TypeInterval:
    days = {item.serial: item.recommended_days for item in gyros if item.recommended_days is not None}
    if not days:
        return TypeInterval(stated, None, None, None, 0)
    shortest = min(days, key=lambda serial: days[serial])
    holding = [item for item in days.values() if item > 0]
    return TypeInterval(stated, days[shortest], shortest, median_low(holding) if holding else None, len(days))
