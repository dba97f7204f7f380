"""Gyro 0417 with a year of results, laid into the database, and a study of it that is written by hand.

What pages show is compared with what is written here, not with what some study finds.
"""

import json
import math
from collections.abc import Mapping
from datetime import UTC, date, datetime, timedelta
from typing import Any

import numpy as np

from app.exchange.rows import CertificateRow
from app.services import access, gyros, stands
from app.services.drift import series
from app.services.lab import Lab, Work
from app.services.sessions import NewSession, find_session, open_session
from app.store import drift, equipment
from app.store.tables import Alarm, Baseline, Calibration, CalibrationParameter, DriftStudy, Event
from solver.records import PARAMETERS

DAYS = (375, 354, 333, 305, 284, 254, 228, 207, 179, 158, 137, 116, 95, 74, 53, 32, 4)
"""How many days ago each session was; a repair lies before the tenth."""
REPAIRED = 165
BEFORE = 9
U = {
    "w0x": 0.00105,
    "w0y": 0.00105,
    "wg": 0.00125,
    "wk": 0.0012,
    "kx": 0.22,
    "ky": 0.23,
    "kxy": 0.2,
    "kyx": 0.2,
}
CENTRE = {
    "w0x": 1.4586, "w0y": -0.7843, "wg": 0.8692, "wk": -0.2015, "kx": 2063.3, "ky": 2041.8, "kxy": 3.11, "kyx": -2.74,
}  # fmt: skip
_STEP = {"w0x": 0.0224, "wg": 0.0070}
_LIMITS = {"w0x": (-2.0, 2.0), "w0y": (-0.8, 0.8), "wg": (-2.0, 2.0), "kx": (2000.0, 2100.0)}
_PLACES = [(theta, psi) for theta in (0.0, 90.0, 180.0, 270.0) for psi in (0.0, 90.0, 180.0, 270.0)]


def value(parameter: str, number: int) -> float:
    """Of one session: noise of a fixed pattern; ω0x and ωg step at the repair, ω0y drifts from the eleventh on."""
    noise = U[parameter] * 1.1 * math.sin(2.9 * number + len(parameter) + PARAMETERS.index(parameter))
    step = _STEP.get(parameter, 0.0) * (number >= BEFORE)
    drift = -0.0021 * max(0, number - 10) if parameter == "w0y" else 0.0
    return CENTRE[parameter] + noise + step + drift


def furnish(work: Work, now: datetime) -> list[int]:
    """Register gyro, stand and certificates and lay in the results; their ids, the oldest first."""
    gyros.set_limits(work, "GVK-6", _LIMITS)
    gyros.add_gyro(work, "0417", "GVK-6")
    stands.add_stand(work, "S1", 55.7558)
    rows = [CertificateRow(theta, psi, 6.9, -16.4, 6.6) for theta, psi in _PLACES]
    for number in ("C-16", "C-17"):
        stands.add_certificate(work, "S1", number, date(2019, 1, 1), date(2100, 1, 1), rows)
    return [add_result(work, "0417", number, now - timedelta(days=days)) for number, days in enumerate(DAYS)]


def add_result(work: Work, serial: str, number: int, at: datetime) -> int:
    """Lay in a result with the values of that number of the year; its id."""
    certificate = "C-16" if number < 3 else "C-17"
    session = open_session(work, NewSession(serial, "S1", certificate, new_start=True, started_at=at)).id
    opened = find_session(work, session)
    row = Calibration(
        session_id=session, revision=1, method="least-squares", solver_version="2.0.0", input_hash=f"h{session}",
        certificate_id=opened.certificate_id, inputs=[], result="{}", result_digest="", chi2=24.0,
        fit_dof=24, created_at=at, created_by="irina",
    )  # fmt: skip
    work.db.add(row)
    work.db.flush()
    work.db.add_all(
        CalibrationParameter(
            calibration_id=row.id, method="least-squares", parameter=name, value=value(name, number),
            standard_uncertainty=U[name], coverage_factor=2.0, u_noise=0.6 * U[name],
        )
        for name in PARAMETERS
    )  # fmt: skip
    work.db.flush()
    return row.id


def judge(work: Work, now: datetime, results: list[int]) -> None:
    """Events, baselines and alarms of 0417."""
    gyro = equipment.gyro(work.db, "0417")
    assert gyro is not None
    day = timedelta(days=1)
    work.db.add(
        Event(
            gyro_id=gyro.id,
            happened_at=now - REPAIRED * day,
            kind="repair",
            note="torquer lead resoldered, R-118",
            created_at=now - REPAIRED * day,
            created_by="sokolov",
        )
    )
    for name in PARAMETERS:
        for since, chosen in ((375, results[:6]), (158, results[9:14])):
            work.db.add(_baseline(gyro.id, name, now - (since + 1) * day, chosen, now - 70 * day))
    for kind, severity, first, state, template, values in _ALARMS:
        work.db.add(
            Alarm(
                gyro_id=gyro.id,
                parameter="w0x" if kind == "step" else "w0y",
                method="least-squares",
                kind=kind,
                severity=severity,
                calibration_id=results[first],
                last_calibration_id=results[-1],
                template=template,
                values=values,
                raised_at=now - DAYS[first] * day,
                state=state,
                note="at the repair" * (state != "open"),
                cause=None if state == "open" else "repair",
                acknowledged_by=None if state == "open" else "A. Sokolov",
                acknowledged_at=None if state == "open" else now - 150 * day,
            )
        )
    work.db.flush()


_ALARMS: tuple[tuple[str, str, int, str, str, dict[str, Any]], ...] = (
    ("beyond-limits", "serious", 13, "open",
     "%(value).4f %(unit)s is below the lower control limit of %(limit).4f %(unit)s.",
     {"value": -0.7899, "limit": -0.7896, "unit": "deg/h"}),
    ("trend", "warning", 14, "open", "%(slope).4f %(unit)s a month.", {"slope": -0.0033, "unit": "deg/h"}),
    ("step", "serious", 9, "acknowledged", "stepped by +%(size).4f %(unit)s.", {"size": 0.0224, "unit": "deg/h"}),
)  # fmt: skip


def _baseline(gyro_id: int, name: str, since: datetime, chosen: list[int], at: datetime) -> Baseline:
    values = [value(name, number) for number in (range(6) if len(chosen) == 6 else range(9, 14))]
    return Baseline(
        gyro_id=gyro_id, parameter=name, method="least-squares", valid_from=since, calibrations=chosen,
        estimator="paule-mandel", centre=float(np.mean(values)), scatter=0.3 * U[name], dof=len(chosen) - 1.0,
        count=len(chosen), within=0.0,
        u_typical=0.6 * U[name], limits="three-sigma", rules={"individuals": ["nelson-1"]},
        reason="After warming up.", frozen_at=at, frozen_by="A. Sokolov",
    )  # fmt: skip


def lay_study(work: Work, now: datetime, further: Mapping[str, Any] | None = None) -> None:
    """The study of 0417, up to date, with charts of the individuals."""
    gyro = equipment.gyro(work.db, "0417")
    assert gyro is not None
    table = series.load(work, gyro.id, "least-squares")
    work.db.add(
        DriftStudy(
            gyro_id=gyro.id,
            method="least-squares",
            changed=1,
            studied=1,
            studied_at=now,
            solver_version="2.0.0",
            document=json.dumps(document(table, now) | (further or {})),
            series=series.encode(table.with_columns(charts(table))),
        )
    )
    work.db.flush()


def charts(table: series.SeriesTable) -> dict[str, series.Column]:
    """Limits of the individuals chart: ±0.004 or 1.8 u·k about each baseline's centre."""
    made: dict[str, series.Column] = {}
    for name in PARAMETERS:
        numbers = np.arange(len(table))
        first = np.mean([value(name, number) for number in range(6)])
        second = np.mean([value(name, number) for number in range(9, 14)])
        centre = np.where(numbers < BEFORE, first, second if name != "w0y" else first)
        width = 3.4 * U[name]
        made |= {f"{name}.individuals_centre": centre, f"{name}.individuals_low": centre - width}
        made |= {f"{name}.individuals_high": centre + width}
        beyond = np.abs(table[f"{name}.value"] - centre) > width
        made[f"{name}.signals"] = np.array(["nelson-1" if item else "" for item in beyond], object)
    return made


def document(table: series.SeriesTable, now: datetime) -> dict[str, Any]:
    """What a study would write."""
    ahead = [now + timedelta(days=10 * step) for step in range(14)]
    parameters = {name: _studied(table, name, ahead) for name in PARAMETERS if len(table)}
    return {
        "gyro": "0417", "method": "least-squares", "sessions": len(table), "solver_version": "2.0.0",
        "from": series.iso(table["measured_at"][0]) if len(table) else None,
        "until": series.iso(table["measured_at"][-1]) if len(table) else None,
        "parameters": parameters,
        "interval": {
            "stated_days": 92, "recommended_days": 61,
            "reason": {"code": "interval-chart", "values": {"days": 61, "wanted": 61},
                       "template": "%(days)d days: the shortest advice is the control chart's, %(wanted)d days."},
            "findings": None,
            "methods": [{"method": "staircase", "days": 92, "interval_of": "recalibration", "reason": {
                            "code": "staircase", "template": "It stays.", "values": {}}},
                        {"method": "control-chart", "days": 61, "interval_of": "recalibration", "reason": {
                            "code": "chart", "values": {"days": 61},
                            "template": "The course leaves its limits after %(days)d days."}}],
        },
    }  # fmt: skip


def _studied(table: series.SeriesTable, name: str, ahead: list[datetime]) -> dict[str, Any]:
    last, u = float(table[f"{name}.value"][-1]), U[name]
    slope = -0.0397 if name == "w0y" else 0.0
    years = [(item - ahead[0]).days / 365.25 for item in ahead]
    times = [series.iso(item) for item in table["measured_at"]]
    step = {
        "kind": "step", "calibration": int(table["calibration"][BEFORE]), "session": int(table["session"][BEFORE]),
        "at": times[BEFORE], "before": times[BEFORE - 1], "size": _STEP.get(name, 0.0), "u": u, "p_value": 1e-6,
        "dates": [{"session": int(table["session"][BEFORE]), "probability": 0.98},
                  {"session": int(table["session"][BEFORE + 1]), "probability": 0.02}], "event": 1,
    }  # fmt: skip
    leaves = {
        "side": "low", "limit": -0.8, "date": ahead[2].isoformat(), "earliest": ahead[1].isoformat(),
        "latest": ahead[5].isoformat(),
    }  # fmt: skip
    parts = (
        ("within-position", 0.5),
        ("between-positions", 0.8),
        ("between-starts", 1.2),
        ("between-days", 0.7),
    )
    return {
        "unit": "deg/h", "status": "beyond-control" if name == "w0y" else "in-control",
        "latest": {"value": last, "u": u, "k": 2.0, "session": 17, "calibration": 17,
                   "at": times[-1], "verdict": "conforms"},
        "changes": [step] if name in _STEP else [],
        "trend": {"model": "linear" if slope else "constant", "since": times[BEFORE], "sessions": 8,
                  "slope_per_year": slope or None, "u_slope_per_year": 0.0023 if slope else None,
                  "p_value": 1e-4 if slope else 0.6,
                  "level": last, "time_constant_days": None, "scatter": u, "dof": 6.0,
                  "tests": [{"model": "linear", "against": "constant", "f": 61.2, "dof": [1.0, 6.0], "p_value": 2e-4}]},
        "forecast": {"probability": 0.95, "at": [item.isoformat() for item in ahead],
                     "value": [last + slope * year for year in years],
                     "low": [last + slope * year - 2 * u * (1 + year) for year in years],
                     "high": [last + slope * year + 2 * u * (1 + year) for year in years],
                     "leaves": leaves if slope else None},
        "components": [{"source": source, "sd": factor * u, "low": 0.6 * factor * u, "high": 1.9 * factor * u,
                        "dof": 9.0,
                        "f": 2.4, "p_value": None if source == "within-position" else 0.031,
                        "confounded_with": ["between-sessions"] if source == "between-starts" else []}
                       for source, factor in parts],
        "together": {"source": "together", "sd": 1.8 * u * (3 if name == "w0y" else 1), "low": u, "high": 6 * u},
        "repeatability_limit": 0.005 if name.startswith("w") else None,
        "repeatability_verdict": ("fails" if name == "w0y" else "conforms") if name.startswith("w") else "no-limit",
    }  # fmt: skip


def studied_laboratory(lab: Lab, now: datetime | None = None) -> list[int]:
    """All of it; the results' ids."""
    at = now or datetime.now(UTC)
    with lab.write(access.SYSTEM) as work:
        results = furnish(work, at)
        judge(work, at, results)
        lay_study(work, at)
    return results


def long_series(table: series.SeriesTable, count: int) -> series.SeriesTable:
    """A studied history of `count` sessions, an hour apart, with weighted averages.

    Sessions are numbered from one; values scatter, every fiftieth of ω0x breaks a rule and lies in the middle.
    """
    drawn = np.random.default_rng(11)
    numbers = np.arange(count)
    last = table["measured_at"][-1]
    made = {name: np.repeat(column[-1:], count) for name, column in table.columns.items()}
    made |= dict.fromkeys(("session", "calibration", "start"), numbers + 1)
    made |= {"measured_at": last - (count - 1 - numbers) * np.timedelta64(1, "h")}
    for name in PARAMETERS:
        made[f"{name}.value"] = CENTRE[name] + drawn.normal(0.0, U[name], count)
        made[f"{name}.ewma"] = CENTRE[name] + drawn.normal(0.0, U[name] / 3.0, count)
        made[f"{name}.signals"] = np.full(count, "", object)
    made["w0x.value"][25::50] = CENTRE["w0x"]
    made["w0x.signals"][25::50] = "nelson-2"
    return series.SeriesTable(made)


def lengthen(work: Work, count: int) -> series.SeriesTable:
    """Give the study of 0417 so many sessions."""
    gyro = equipment.gyro(work.db, "0417")
    assert gyro is not None
    row = drift.study(work.db, gyro.id, None, "least-squares")
    assert row is not None
    assert row.series is not None
    table = long_series(series.decode(row.series), count)
    row.series = series.encode(table)
    return table


def results_of(work: Work) -> list[int]:
    """The results of 0417 that were laid in, the oldest first."""
    gyro = equipment.gyro(work.db, "0417")
    assert gyro is not None
    found: list[int] = series.load(work, gyro.id, "least-squares")["calibration"].tolist()
    return found
