"""Records on their way to disk, in the plain form that a computing process hands back."""

from dataclasses import asdict
from typing import Any

from app.exchange.records import means_row, write_record_parquet
from app.exchange.rows import CurrentRecord
from app.store.records import RecordFiles


def keep_record(files: RecordFiles, record: CurrentRecord) -> dict[str, Any]:
    """Keep one position's record as Parquet; its means, and what the file holds."""
    row = means_row(record)
    digest = files.put(write_record_parquet(record), "parquet")
    held = {
        "digest": digest,
        "samples": len(record.t_s),
        "duration_s": row.duration_s,
        "rate_hz": row.rate_hz,
    }
    return {"means": asdict(row), "record": held}
