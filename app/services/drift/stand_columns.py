"""All sessions on one stand as columns: taken from its gyros' own studies, so that nothing is computed twice."""

from collections.abc import Sequence
from typing import Final

import numpy as np

from app.exchange.si import parameter_si
from app.services.drift import series
from app.services.drift.series import ATTITUDE, Column, SeriesTable, seconds
from app.store.fleet import OnStand
from solver.drift.stands.attribution import StandHistory
from solver.records import PARAMETERS, Array
from solver.units import rad_from_arcsec

_HEADS: Final = ("session", "calibration", "start", "measured_at", "certificate")
_WANTED: Final = (
    *_HEADS, "chi2", "fit_dof", *ATTITUDE, *(f"{name}.{part}" for name in PARAMETERS for part in ("value", "u_noise")),
    *(f"level_east.{name}" for name in PARAMETERS),
)  # fmt: skip
_EMPTY: Final[dict[str, str]] = {
    "session": "int64", "calibration": "int64", "start": "int64", "measured_at": "datetime64[us]",
    "certificate": "object", "gyro": "object", "kind": "object",
}  # fmt: skip


def merged(gyros: Sequence[OnStand], stand: str) -> SeriesTable:
    """The sessions on a stand in the order of time: columns of `SeriesTable`, further ``gyro`` and ``kind`` (type)."""
    parts = [_part(gyro, stand) for gyro in gyros]
    names = (*_WANTED, "gyro", "kind")
    columns = {
        name: np.concatenate([part[name] for part in parts])
        if parts
        else np.array([], _EMPTY.get(name, "float64"))
        for name in names
    }
    table = SeriesTable(columns)
    return table.rows(np.lexsort((columns["session"], columns["measured_at"])))


def _part(gyro: OnStand, stand: str) -> dict[str, Column]:
    table = series.decode(gyro.series)
    here = np.flatnonzero(table["stand"] == stand)
    nothing = np.full(len(here), np.nan)
    columns = {name: table[name][here] if name in table else nothing for name in _WANTED}
    for name, text in (("gyro", gyro.serial), ("kind", gyro.kind)):
        columns[name] = np.array([text] * len(here), object)
    return columns


def history(table: SeriesTable) -> StandHistory:
    """The same in SI with labels as numbers, for `solver.drift.stands.attribution`."""
    arcsec = rad_from_arcsec(1.0)
    factors = np.array([parameter_si(name, 1.0) for name in PARAMETERS])

    def columns(*names: str) -> Array:
        return np.stack([np.asarray(table[name], np.float64) for name in names], axis=1)

    return StandHistory(
        time=seconds(table["measured_at"]), gyro=_codes(table["gyro"]), kind=_codes(table["kind"]),
        certificate=_codes(table["certificate"]), start=np.asarray(table["start"], np.int64),
        value=columns(*(f"{name}.value" for name in PARAMETERS)) * factors,
        u=columns(*(f"{name}.u_noise" for name in PARAMETERS)) * factors,
        level_east=columns(*(f"level_east.{name}" for name in PARAMETERS)) * factors / arcsec,
        turn=columns("level_north_arcsec", "azimuth_arcsec") * arcsec,
        u_turn=columns("u_level_north_arcsec", "u_azimuth_arcsec") * arcsec,
        correlation=np.asarray(table["attitude_correlation"], np.float64),
        u_certificate=columns("u_certificate_level_north_arcsec", "u_certificate_azimuth_arcsec") * arcsec,
        chi2=np.asarray(table["chi2"], np.float64), dof=np.asarray(table["fit_dof"], np.float64),
    )  # fmt: skip


def _codes(texts: Column) -> np.ndarray[tuple[int], np.dtype[np.int64]]:
    """Texts as numbers, in the order of the alphabet."""
    found: np.ndarray[tuple[int], np.dtype[np.int64]] = np.unique(texts.astype(str), return_inverse=True)[
        1
    ].ravel()
    return found
