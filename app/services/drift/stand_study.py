"""A stand's study: its gyros together, and whose the changes are. Made by the job of `studying`, like a gyro's.

It is computed from the columns of the gyros' own studies by least squares (`stand_columns`): each session
shows azimuth and level about north of the base in its residuals, its parameters show what the gyro did, and all gyros
together what they share. `solver.drift.stands.attribution` judges; here its findings get their days, and those that are
the stand's, or may be, become alarms unless somebody entered an event that explains them.
"""

from collections.abc import Callable, Mapping
from dataclasses import asdict
from typing import Any, Final

from app.exchange.json_values import Json, dumps, finite
from app.services.drift import common_mode, events, following, series, stand_columns, stand_findings
from app.services.drift.series import SeriesTable, iso
from app.services.drift.views import EventView
from app.services.lab import Work
from app.store import fleet
from solver import __version__
from solver.drift.stands.attribution import attribute
from solver.drift.stands.detectability import detectable
from solver.units import arcsec_from_rad

METHOD: Final = following.STAND_METHOD
"""Of the gyros' studies that a stand's is made from, and its own."""
Report = Callable[[float, str], None]


def prepare(work: Work, stand_id: int) -> dict[str, Any]:
    """What the studying process needs: the columns of every session on the stand, and what people entered."""
    stand = fleet.stand_by_id(work.db, stand_id)
    gyros = fleet.series_on(work.db, stand_id, METHOD)
    return {
        "stand": stand.name,
        "check": [gyro.serial for gyro in gyros if gyro.check],
        "events": events.of_stand(work, stand.name),
        "series": series.encode(stand_columns.merged(gyros, stand.name)),
    }


def studied(payload: Mapping[str, Any], report: Report) -> dict[str, Any]:
    """Study the stand; see `gyro_study.studied` for what is returned."""
    report(0.1, "studying")
    table = series.decode(payload["series"])
    document, further = study(table, payload["stand"], payload["check"], payload["events"])
    kept = table.with_columns(further)
    return {
        METHOD: {
            "document": dumps(document), "series": series.encode(_shown(kept)), "solver_version": __version__,
            "findings": [asdict(item) for item in stand_findings.alarms(document)],
            "counting": table["calibration"].tolist(),
        }
    }  # fmt: skip


def study(
    table: SeriesTable, stand: str, check: list[str], happened: tuple[EventView, ...]
) -> tuple[Json, dict[str, Any]]:
    """The document, and the columns of the gyros together."""
    gyros = sorted(set(table["gyro"].tolist()))
    document: Json = {
        "stand": stand, "method": METHOD, "sessions": len(table), "gyros": gyros,
        "check": [serial for serial in check if serial in gyros],
        "from": None, "until": None, "solver_version": __version__, "certificates": [], "findings": [],
        "detectable": None,
    }  # fmt: skip
    if len(table):
        history = stand_columns.history(table)
        document |= {
            "from": iso(table["measured_at"][0]), "until": iso(table["measured_at"][-1]),
            "certificates": list(_certificates(table)),
            "findings": [stand_findings.described(table, item, gyros, happened) for item in attribute(history)],
            "detectable": _detectable(detectable(history)),
        }  # fmt: skip
    return document, common_mode.common_mode(table)


def _certificates(table: SeriesTable) -> Any:
    """Each certificate with the first session by it."""
    before = None
    for place, number in enumerate(table["certificate"].tolist()):
        if number != before:
            yield {
                "certificate": number,
                "session": int(table["session"][place]),
                "at": iso(table["measured_at"][place]),
            }
        before = number


def _detectable(found: Any) -> Json:
    arcsec = {
        f"{axis}_arcsec": finite(float(arcsec_from_rad(getattr(found, axis))))
        for axis in ("azimuth", "level_north", "level_east")
    }
    return {**arcsec, "probability": found.power}


def _shown(table: SeriesTable) -> SeriesTable:
    """What charts and tables show of it."""
    left_out = ("level_east.", "u_certificate_")
    names = [
        name
        for name in table.columns
        if not name.startswith(left_out) and not name.endswith((".value", ".u_noise"))
    ]
    return SeriesTable({name: table[name] for name in names})
