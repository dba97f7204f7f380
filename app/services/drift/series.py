"""A gyro's results over time as columns: from the database, to and from Arrow, grouped, and reduced.

A row is a session. Of its results one counts: by the method, the highest revision from the same input as the
session's highest revision. What a corrected measurement has replaced is gone, and is counted in `revisions`
only; but solving once more by another method hides nothing.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import Any, Final

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from app.services.lab import Work
from app.services.views import COVERAGE_FACTOR
from app.store import drift, drift_series
from app.store.drift_series import ResultRow, ValueRow
from solver.drift.history import History
from solver.records import PARAMETERS, Array

Column = NDArray[Any]

ATTITUDE: Final = (
    "azimuth_arcsec", "u_azimuth_arcsec", "level_north_arcsec", "u_level_north_arcsec", "attitude_correlation",
    "u_certificate_azimuth_arcsec", "u_certificate_level_north_arcsec",
)  # fmt: skip
"""How the stand's base stood according to each session; NaN where the session shows nothing."""
PARTS: Final = ("value", "u", "k", "u_noise")
_EPOCH: Final = np.datetime64(0, "us")
_SECOND: Final = np.timedelta64(1, "s")
_WHOLE: Final = ("calibration", "session", "revision", "start")
_TIMES: Final = ("measured_at", "start_at")
_TEXTS: Final = ("stand", "certificate", "solver_version")
_FLOATS: Final = ("chi2", "fit_dof", "temperature_c", *ATTITUDE)


@dataclass(frozen=True, slots=True)
class SeriesTable:
    """Columns of equal length, one row for each session, in the order of time.

    Attributes
    ----------
    columns
        ``session``, ``calibration``, ``revision``, ``revisions`` (how many results the session has),
        ``start`` (its number) as int; ``measured_at`` and ``start_at`` as datetime64[us] in UTC;
        ``stand``, ``certificate``, ``solver_version`` as str; ``chi2``, ``fit_dof``, ``temperature_c``, those of
        `ATTITUDE`; ``w0x.value``, ``w0x.u``, ``w0x.k``, ``w0x.u_noise`` and so on for each parameter, in
        laboratory units; ``level_east.w0x``, by how much an arcsecond of the base about east changes it;
        further ones that a study adds (``w0x.ewma`` …). NaN where nothing is known.
    """

    columns: Mapping[str, Column]

    def __len__(self) -> int:
        """Number of sessions."""
        return len(self.columns["session"])

    def __getitem__(self, name: str) -> Column:
        """One column."""
        return self.columns[name]

    def __contains__(self, name: str) -> bool:
        """Whether there is such a column."""
        return name in self.columns

    def rows(self, which: slice | NDArray[np.int64] | NDArray[np.bool_]) -> "SeriesTable":
        """Some of the sessions."""
        return SeriesTable({name: column[which] for name, column in self.columns.items()})

    def between(self, since: datetime | None, until: datetime | None) -> "SeriesTable":
        """The sessions of a period, both ends included."""
        times = self.columns["measured_at"]
        first = 0 if since is None else int(np.searchsorted(times, moment(since), "left"))
        last = len(times) if until is None else int(np.searchsorted(times, moment(until), "right"))
        return self.rows(slice(first, last))

    def with_columns(self, further: Mapping[str, Column]) -> "SeriesTable":
        """The same sessions with further columns."""
        return SeriesTable({**self.columns, **further})

    def determined(self, parameter: str) -> NDArray[np.int64]:
        """Places of the sessions that determined the parameter."""
        return np.flatnonzero(np.isfinite(self.columns[f"{parameter}.value"]))

    def broken(self, parameter: str) -> NDArray[np.int64]:
        """Places of the sessions that stand in a pattern that breaks a rule; none before a study."""
        name = f"{parameter}.signals"
        return np.flatnonzero(self.columns[name] != "") if name in self else np.array([], np.int64)

    def noise(self, parameter: str) -> Array:
        """What differs from session to session by the currents' noise; 0 where it is not known."""
        known: Array = np.nan_to_num(self.columns[f"{parameter}.u_noise"], nan=0.0)
        return known

    def history(self, parameter: str) -> History:
        """The parameter for `solver.drift`: its determined values with the noise of their sessions.

        Times are seconds since 1970; rows are those of `determined`.
        """
        here = self.determined(parameter)
        return History.sorted_from(
            seconds(self.columns["measured_at"][here]),
            self.columns[f"{parameter}.value"][here],
            self.noise(parameter)[here],
            self.columns["start"][here],
        )


def seconds(times: Column) -> Array:
    """Seconds since 1970 of times in UTC."""
    found: Array = (times - _EPOCH) / _SECOND
    return found


def moment(at: datetime) -> np.datetime64:
    """An aware time as the columns have it."""
    return np.datetime64(at.astimezone(UTC).replace(tzinfo=None), "us")


def aware(at: np.datetime64) -> datetime:
    """A column's time as an aware one."""
    found: datetime = at.astype("datetime64[us]").item()
    return found.replace(tzinfo=UTC)


def iso(at: np.datetime64) -> str:
    """A column's time as ISO 8601 in UTC."""
    return aware(at).isoformat()


def known(column: Column) -> list[float | None]:
    """Numbers, None for NaN."""
    return [None if number != number else number for number in column.tolist()]


def current(work: Work, gyro_id: int, method: str) -> SeriesTable:
    """A gyro's results by one method as they are now: from the study when it has taken everything in."""
    study = drift.study(work.db, gyro_id, None, method)
    if study is not None and study.studied >= study.changed and study.series is not None:
        return decode(study.series)
    return load(work, gyro_id, method)


def load(work: Work, gyro_id: int, method: str) -> SeriesTable:
    """A gyro's results by one method, in one look at the database."""
    empty = _table([], {}, {})
    return load_all(work, gyro_id).get(method, empty)


def load_all(work: Work, gyro_id: int) -> dict[str, SeriesTable]:
    """A gyro's results by each method that gave one."""
    rows, values = drift_series.result_rows(work.db, gyro_id), drift_series.value_rows(work.db, gyro_id)
    by_method: dict[str, dict[int, dict[str, ValueRow]]] = {}
    for item in values:
        by_method.setdefault(item.method, {}).setdefault(item.calibration, {})[item.parameter] = item
    counts: dict[int, int] = {}
    for row in rows:
        counts[row.session] = counts.get(row.session, 0) + 1
    return {
        method: _table(list(counting(rows, solved)), solved, counts)
        for method, solved in sorted(by_method.items())
    }


def counting(rows: Sequence[ResultRow], solved: Mapping[int, object]) -> Iterable[ResultRow]:
    """Of each session's revisions the one that counts, if any; `solved` has the results by the method."""
    last = {row.session: row for row in rows}
    kept = {
        row.session: row
        for row in rows
        if row.calibration in solved and row.input_hash == last[row.session].input_hash
    }
    return kept.values()


def _table(
    rows: Sequence[ResultRow], values: Mapping[int, Mapping[str, ValueRow]], counts: Mapping[int, int]
) -> SeriesTable:
    columns: dict[str, Column] = {name: _column(rows, name, np.int64) for name in _WHOLE}
    columns["revisions"] = np.array([counts[row.session] for row in rows], np.int64)
    for name in _TIMES:
        columns[name] = np.array([getattr(row, name).replace(tzinfo=None) for row in rows], "datetime64[us]")
    columns |= {name: _column(rows, name, object) for name in _TEXTS}
    columns |= {name: _column(rows, name, np.float64) for name in _FLOATS}
    for parameter in PARAMETERS:
        found = [values[row.calibration].get(parameter) for row in rows]
        for part in PARTS:
            columns[f"{parameter}.{part}"] = np.array(
                [getattr(item, part, None) for item in found], np.float64
            )
        k = columns[f"{parameter}.k"]
        k[np.isnan(k)] = COVERAGE_FACTOR
        columns[f"level_east.{parameter}"] = np.array(
            [(row.level_east or {}).get(parameter) for row in rows], np.float64
        )
    return SeriesTable(columns)


def _column(rows: Sequence[ResultRow], name: str, kind: type) -> Column:
    return np.array([getattr(row, name) for row in rows], kind)


def encode(table: SeriesTable) -> bytes:
    """As an Arrow file, to be kept with the study; limits and centres hardly change, so that it shrinks to a third."""
    arrays = {
        name: pa.array(column).dictionary_encode() if column.dtype == object else pa.array(column)
        for name, column in table.columns.items()
    }
    stream = pa.BufferOutputStream()
    written = pa.table(arrays)
    with pa.ipc.new_file(stream, written.schema, options=pa.ipc.IpcWriteOptions(compression="lz4")) as file:
        file.write_table(written)
    content: bytes = stream.getvalue().to_pybytes()
    return content


def decode(content: bytes) -> SeriesTable:
    """Read back what `encode` wrote."""
    with pa.ipc.open_file(pa.BufferReader(content)) as file:
        read = file.read_all()
    return SeriesTable({name: read[name].to_numpy() for name in read.column_names})
