"""Records of sampled currents: from a file of one position or of many, and their means."""

from collections.abc import Mapping
from datetime import datetime
from decimal import Decimal
from typing import Final

from app.exchange import record_checks, samples
from app.exchange.fields import instant
from app.exchange.formats import open_table
from app.exchange.headers import resolve
from app.exchange.numbers import read_decimal
from app.exchange.problems import Problems
from app.exchange.record_files import write_record_csv, write_record_parquet
from app.exchange.record_places import Place, given, places, position_of, record_name
from app.exchange.rows import CurrentRecord, MeansRow
from solver.errors import Message
from solver.signals.noise import mean_with_uncertainty

__all__ = [
    "Place",
    "means_row",
    "position_of",
    "read_record",
    "record_name",
    "write_record_csv",
    "write_record_parquet",
]

_REQUIRED: Final = ("t", "jx", "jy")
_OPTIONAL: Final = ("theta", "psi", "repeat")


def read_record(
    data: bytes,
    filename: str,
    *,
    theta_deg: float | None = None,
    psi_deg: float | None = None,
    repeat: int | None = None,
) -> tuple[list[CurrentRecord], list[Message]]:
    """Read the currents of one position, or of many from one long file, in any format of `formats`.

    Where the position comes from: the caller; else the columns ``theta_deg`` and ``psi_deg``, of
    which every unbroken run is one measurement; else the file's metadata; else its name.

    Parameters
    ----------
    data, filename
        The whole file, and its name as the user gave it.
    theta_deg, psi_deg, repeat
        The position, when the caller knows it.

    Returns
    -------
    records
        In the file's order; repeats are numbered in order of appearance where nothing says otherwise.
    warnings
        ``gap``, ``channel-stuck``, ``channel-saturated``, ``below-method``, ``position-differs``,
        ``columns-ignored``.

    Raises
    ------
    Invalid
        With every problem found (the first twenty in full), each with file, row and column.
    """
    table = open_table(data, filename)
    problems = Problems(filename)
    columns, warnings = resolve(table.names, _REQUIRED, _OPTIONAL, problems, table.header_line)
    problems.raise_if_any()
    t_s, jx_ma, jy_ma = (samples.samples(table, columns[name], problems) for name in _REQUIRED)
    measurements, differing = places(table, columns, given(theta_deg, psi_deg, repeat), problems)
    problems.raise_if_any()
    started_at, temperature_c = _conditions(table.metadata)
    records = [
        CurrentRecord(
            place.theta_deg, place.psi_deg, t_s[rows], jx_ma[rows], jy_ma[rows],
            repeat=place.repeat or 0, started_at=started_at, temperature_c=temperature_c,
        )
        for rows, place in measurements
    ]  # fmt: skip
    for (rows, _), record in zip(measurements, records, strict=True):
        record_checks.check_time(record.t_s, table.lines[rows], columns["t"].name, problems)
    problems.raise_if_any()
    warnings += differing
    for (rows, _), record in zip(measurements, records, strict=True):
        warnings += record_checks.warnings(record, table.lines[rows], filename)
    return records, warnings


def _conditions(metadata: Mapping[str, str]) -> tuple[datetime | None, float | None]:
    """Start and temperature that our own Parquet files carry beside their columns."""
    started = instant(metadata["started_at"]) if "started_at" in metadata else None
    temperature = read_decimal(metadata.get("temperature_c", ""))
    return (
        started if isinstance(started, datetime) else None,
        float(temperature) if isinstance(temperature, Decimal) else None,
    )


def means_row(record: CurrentRecord) -> MeansRow:
    """Mean currents of a record, with their standard uncertainties, its duration and rate.

    The uncertainty allows for correlated samples (`solver.signals.noise`) and has its degrees of freedom. Both
    are None for a channel that does not change at all, whose noise nobody knows.

    Parameters
    ----------
    record
        At least two samples, finite, in time's order, as `read_record` gives it.
    """
    duration_s, rate_hz = record_checks.duration_and_rate(record.t_s)
    jx = mean_with_uncertainty(record.jx_ma)
    jy = mean_with_uncertainty(record.jy_ma)
    return MeansRow(
        theta_deg=record.theta_deg,
        psi_deg=record.psi_deg,
        jx_ma=jx.value,
        jy_ma=jy.value,
        u_jx_ma=jx.standard_uncertainty or None,
        u_jy_ma=jy.standard_uncertainty or None,
        duration_s=duration_s,
        rate_hz=rate_hz,
        started_at=record.started_at,
        temperature_c=record.temperature_c,
        repeat=record.repeat,
        dof_jx=jx.dof or None,
        dof_jy=jy.dof or None,
    )
