"""Records of currents for the eye: minimum and maximum per bin, so that no spike is lost."""

import io
from dataclasses import dataclass

import numpy as np
import pyarrow.parquet as pq

from app.errors import NotFound, problem
from app.services.lab import Work
from app.services.sessions import measurement_view
from app.services.views import MeasurementView
from app.store import measurement


@dataclass(frozen=True, slots=True)
class Trace:
    """A stretch of a record, reduced: per bin its first time and each channel's extremes, s and mA.

    With no more samples than bins, minimum and maximum are the samples themselves.
    """

    measurement: MeasurementView
    session: int
    samples: int
    t_s: tuple[float, ...]
    jx_low_ma: tuple[float, ...]
    jx_high_ma: tuple[float, ...]
    jy_low_ma: tuple[float, ...]
    jy_high_ma: tuple[float, ...]


def trace(
    work: Work, measurement_id: int, *, since_s: float = 0.0, until_s: float = np.inf, bins: int = 800
) -> Trace:
    """The record of a measurement between two times, reduced to at most `bins` bins."""
    row = measurement.measurement(work.db, measurement_id)
    if row is None or row.record_digest is None:
        raise NotFound(
            problem("no-record", "This measurement has no record of currents; only its means were given.")
        )
    table = pq.read_table(io.BytesIO(work.files.read(row.record_digest, "parquet")))
    t_s, jx_ma, jy_ma = (table[name].to_numpy() for name in ("t_s", "jx_ma", "jy_ma"))
    first, last = np.searchsorted(t_s, (since_s, until_s))
    edges = np.linspace(first, last, max(1, min(bins, int(last - first))) + 1).astype(np.intp)[:-1]
    if last <= first:
        raise NotFound(problem("empty-stretch", "The record has no sample between these times."))
    lows = [np.minimum.reduceat(column[:last], edges) for column in (jx_ma, jy_ma)]
    highs = [np.maximum.reduceat(column[:last], edges) for column in (jx_ma, jy_ma)]
    return Trace(
        measurement_view(row), row.session_id, int(last - first), tuple(t_s[edges].tolist()),
        tuple(lows[0].tolist()), tuple(highs[0].tolist()), tuple(lows[1].tolist()), tuple(highs[1].tolist()),
    )  # fmt: skip
