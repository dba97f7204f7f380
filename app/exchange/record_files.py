"""A record of currents as a file: Parquet, the same bytes for the same record, or CSV."""

import io
from typing import Final

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from app.exchange.rows import CurrentRecord
from app.exchange.written import csv_bytes

_COLUMNS: Final = ("t_s", "jx_ma", "jy_ma")


def write_record_parquet(record: CurrentRecord) -> bytes:
    """Write a record as Parquet; position, repeat, start and temperature stand in its metadata.

    Equal records give equal bytes with one version of pyarrow: one thread, one row group, no time
    of writing. Reading gives the same bits of every sample.
    """
    columns = [pa.array(np.ascontiguousarray(getattr(record, name), dtype=np.float64)) for name in _COLUMNS]
    schema = pa.schema([(name, pa.float64()) for name in _COLUMNS], metadata=_metadata(record))
    stream = io.BytesIO()
    pq.write_table(
        pa.Table.from_arrays(columns, schema=schema),
        stream,
        row_group_size=max(1, len(record.t_s)),
        version="2.6",
        compression="zstd",
        compression_level=3,
        use_dictionary=False,
        column_encoding=dict.fromkeys(_COLUMNS, "BYTE_STREAM_SPLIT"),
    )
    return stream.getvalue()


def _metadata(record: CurrentRecord) -> dict[bytes | str, bytes | str]:
    facts: dict[bytes | str, bytes | str] = {
        "theta_deg": repr(float(record.theta_deg)),
        "psi_deg": repr(float(record.psi_deg)),
        "repeat": str(int(record.repeat)),
    }
    if record.started_at is not None:
        facts["started_at"] = record.started_at.isoformat()
    if record.temperature_c is not None:
        facts["temperature_c"] = repr(float(record.temperature_c))
    return facts


def write_record_csv(record: CurrentRecord) -> bytes:
    """Write a record as CSV: reading it gives the same bits of every sample."""
    columns = [getattr(record, name).tolist() for name in _COLUMNS]
    return csv_bytes(_COLUMNS, zip(*columns, strict=True))
