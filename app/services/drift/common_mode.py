"""What all gyros of a stand do together: each session's deviation from its gyro's own course.

Of each gyro and parameter the course is the mean of its sessions, or a line where one is plain (|t| > 4). The standard
deviation σ is that of successive differences, median(|Δ|)/(√2·0.6745), which steps and slow changes leave alone; a
deviation z = (x − course)/σ is drawn in to ±5, so that a gyro that jumps counts no more than it can. A
turn ε of the base about east shows as L·ε in the parameters (`solver.estimators.stand_attitude`); by least squares::

    ε = Σ L·d/σ² / Σ L²/σ²,   u(ε) = 1/√(Σ L²/σ²),   d the deviation from the gyro's mean
"""

from typing import Final

import numpy as np

from app.services.drift.series import Column, SeriesTable, seconds
from solver.records import PARAMETERS, Array

FEWEST: Final = 3
"""Sessions below which a gyro's own course is not known."""
LARGEST: Final = 5.0
_PLAIN: Final = 4.0
_MEDIAN: Final = 0.6744897501960817
"""Of |z| of a normal value: Φ⁻¹(0.75)."""


def common_mode(table: SeriesTable) -> dict[str, Column]:
    """Columns ``z.kx`` …, and ``level_east_arcsec`` with ``u_level_east_arcsec``; NaN where a gyro is too new."""
    count = len(table)
    z = {name: np.full(count, np.nan) for name in PARAMETERS}
    pull, normal = np.zeros(count), np.zeros(count)
    time = seconds(table["measured_at"])
    for gyro in np.unique(table["gyro"].astype(str)):
        mine = np.flatnonzero(table["gyro"] == gyro)
        for name in PARAMETERS:
            value = np.asarray(table[f"{name}.value"][mine], np.float64)
            known = np.isfinite(value)
            here, value = mine[known], value[known]
            sd = _scatter(value)
            if len(value) < FEWEST or not sd > 0.0:
                continue
            z[name][here] = np.clip((value - _course(time[here], value, sd)) / sd, -LARGEST, LARGEST)
            signature = np.nan_to_num(np.asarray(table[f"level_east.{name}"][here], np.float64))
            pull[here] += signature * (value - value.mean()) / sd**2
            normal[here] += signature**2 / sd**2
    with np.errstate(divide="ignore", invalid="ignore"):
        east = np.where(normal > 0.0, pull / normal, np.nan)
        u_east = np.where(normal > 0.0, 1.0 / np.sqrt(normal), np.nan)
    return {
        **{f"z.{name}": column for name, column in z.items()},
        "level_east_arcsec": east,
        "u_level_east_arcsec": u_east,
    }


def _scatter(value: Array) -> float:
    return float(np.median(np.abs(np.diff(value)))) / (2.0**0.5 * _MEDIAN) if len(value) > 1 else 0.0


def _course(time: Array, value: Array, sd: float) -> Array:
    """Mean, or line where its slope is plain."""
    centred = time - time.mean()
    spread = float(centred @ centred)
    if len(value) <= FEWEST or not spread > 0.0:
        return np.full(len(value), value.mean())
    slope = float(centred @ value) / spread
    if abs(slope) * spread**0.5 <= _PLAIN * sd:
        slope = 0.0
    return np.asarray(value.mean() + slope * centred)
