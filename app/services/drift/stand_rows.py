"""Every session on a stand as a table: the same for pages and programs."""

from typing import Final

import numpy as np

from app.exchange.written import Cell
from app.services.drift.series import SeriesTable, aware
from solver.records import PARAMETERS

COLUMNS: Final = (
    "measured_at", "session", "calibration", "gyro", "certificate", "azimuth_arcsec", "u_azimuth_arcsec",
    "level_north_arcsec", "u_level_north_arcsec", "level_east_arcsec", "u_level_east_arcsec",
    *(f"z_{name}" for name in PARAMETERS),
)  # fmt: skip


def rows(table: SeriesTable | None) -> list[dict[str, Cell]]:
    """A row for each session, in the order of `COLUMNS`; empty before a study."""
    if table is None:
        return []
    columns = {name: _column(table, name) for name in COLUMNS}
    return [dict(zip(COLUMNS, cells, strict=True)) for cells in zip(*columns.values(), strict=True)]


def _column(table: SeriesTable, name: str) -> list[Cell]:
    if name == "measured_at":
        return [aware(at) for at in table[name]]
    column = table[name.replace("z_", "z.", 1) if name.startswith("z_") else name]
    if np.issubdtype(column.dtype, np.floating):
        return [None if number != number else number for number in column.tolist()]
    return list(column.tolist())
