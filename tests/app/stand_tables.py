"""Sessions of several gyros on one stand, drawn with a known truth, as columns and as results in a database."""

from datetime import UTC, datetime

import numpy as np

from app.exchange.si import parameter_lab, parameter_si
from app.services import calibrations, gyros
from app.services.drift.series import SeriesTable
from app.services.drift.stand_columns import _WANTED
from app.services.lab import Work
from app.services.sessions import NewSession, open_session
from solver.estimators.stand_attitude import level_east_signature
from solver.records import PARAMETERS
from solver.units import rad_from_arcsec, rad_from_deg

BEGIN = datetime(2024, 1, 5, 9, tzinfo=UTC)
U_AZIMUTH, U_LEVEL = 31.0, 22.0
"""Arcsec of one session at 0.005 °/h per position."""
TRUE = dict(zip(PARAMETERS, (2063.0, 2040.0, 4.0, -3.0, 1.2, -0.7, 6.0, 1.5), strict=True))
SCATTER = dict(zip(PARAMETERS, (0.25, 0.25, 0.25, 0.25, 0.02, 0.02, 0.005, 0.005), strict=True))
NOISE = dict(zip(PARAMETERS, (0.22, 0.22, 0.22, 0.22, 0.002, 0.002, 0.006, 0.006), strict=True))


def signature() -> dict[str, float]:
    """Change of each parameter per arcsec about east, laboratory units, at 55.7558°."""
    si = np.array([parameter_si(name, TRUE[name]) for name in PARAMETERS])
    per_rad = level_east_signature(si, rad_from_deg(55.7558))
    return {
        name: parameter_lab(name, float(value) * rad_from_arcsec(1.0))
        for name, value in zip(PARAMETERS, per_rad, strict=True)
    }


def sessions(serials: list[str], months: int, seed: int) -> SeriesTable:
    """A session of each gyro each month, each in a start of its own; nothing happens."""
    rng = np.random.default_rng(seed)
    count = len(serials) * months
    gyro = np.tile(np.array(serials, object), months)
    day = np.repeat(np.arange(months) * 30.0, len(serials)) + np.tile(np.arange(len(serials)) * 1.5, months)
    begin = np.datetime64(BEGIN.replace(tzinfo=None), "us")
    columns = {
        "session": np.arange(1, count + 1), "calibration": np.arange(1, count + 1),
        "start": np.repeat(np.arange(1, months + 1), len(serials)),
        "measured_at": begin + (day * 86400e6).astype("timedelta64[us]"),
        "certificate": np.full(count, "C-17", object), "gyro": gyro, "kind": np.full(count, "GVK-6", object),
        "azimuth_arcsec": rng.normal(0.0, U_AZIMUTH, count), "u_azimuth_arcsec": np.full(count, U_AZIMUTH),
        "level_north_arcsec": rng.normal(0.0, U_LEVEL, count), "u_level_north_arcsec": np.full(count, U_LEVEL),
        "attitude_correlation": np.zeros(count), "u_certificate_azimuth_arcsec": np.full(count, 1.0),
        "u_certificate_level_north_arcsec": np.full(count, 1.0),
        "chi2": np.full(count, np.nan), "fit_dof": np.full(count, np.nan),
    }  # fmt: skip
    own = signature()
    for name in PARAMETERS:
        spread = np.hypot(SCATTER[name], NOISE[name])
        columns[f"{name}.value"] = TRUE[name] + rng.normal(0.0, spread, count)
        columns[f"{name}.u_noise"] = np.full(count, NOISE[name])
        columns[f"level_east.{name}"] = np.full(count, own[name])
    assert set(columns) == {*_WANTED, "gyro", "kind"}
    return SeriesTable(columns)


def turned(
    table: SeriesTable, since: int, *, azimuth: float = 0.0, north: float = 0.0, east: float = 0.0
) -> SeriesTable:
    """The same with the base turned, arcsec, from a session on."""
    after = np.arange(len(table)) >= since
    changed = {
        "azimuth_arcsec": table["azimuth_arcsec"] + azimuth * after,
        "level_north_arcsec": table["level_north_arcsec"] + north * after,
    }
    for name, per_arcsec in signature().items():
        changed[f"{name}.value"] = table[f"{name}.value"] + per_arcsec * east * after
    return table.with_columns(changed)


def stored(work: Work, table: SeriesTable, stand: str) -> None:
    """Keep the same as sessions with results."""
    for place in range(len(table)):
        serial = str(table["gyro"][place])
        at = table["measured_at"][place].astype("datetime64[us]").item().replace(tzinfo=UTC)
        if place == list(table["gyro"]).index(serial) and serial != "0417":
            gyros.add_gyro(work, serial, "GVK-6")
        session = open_session(work, NewSession(serial, stand, started_at=at, new_start=True))
        rows = [
            {"method": "least-squares", "parameter": name, "value": float(table[f"{name}.value"][place]),
             "standard_uncertainty": NOISE[name], "coverage_factor": 2.0, "u_noise": NOISE[name]}
            for name in PARAMETERS
        ]  # fmt: skip
        attitude = {
            name: float(table[name][place])
            for name in ("azimuth_arcsec", "u_azimuth_arcsec", "level_north_arcsec", "u_level_north_arcsec",
                         "u_certificate_azimuth_arcsec", "u_certificate_level_north_arcsec")
        } | {"correlation": 0.0, "dof": None, "level_east": signature()}  # fmt: skip
        output = {"result": f'{{"n":{session.id}}}', "input_hash": "0" * 64, "solver_version": "1.0.0",
                  "parameters": rows, "fit": {"chi2": 24.0, "fit_dof": 24}, "attitude": attitude}  # fmt: skip
        calibrations.store(work, session.id, {"method": "least-squares", "inputs": []}, output)
