"""A simulated session as files: what `driftbook simulate` writes."""

import json
from collections.abc import Sequence
from typing import Any, Final

from app.exchange.json_values import dumps
from app.exchange.record_places import record_name
from app.exchange.rows import CurrentRecord, Facts
from app.exchange.session_folder import TRUTH
from app.exchange.session_json import FILE_NAME
from app.exchange.session_writing import RecordFormat, session_files
from app.services.simulated import certificate_lab, common_lab, records_lab, truth_values
from simdevice.bench import SimulatedSession
from simdevice.faults import Kind

UNCERTAINTIES: Final = "uncertainties.json"
"""What the certificate's angles have in common, for `driftbook solve --uncertainties`."""


def simulated_files(session: SimulatedSession, facts: Facts, record_format: RecordFormat) -> dict[str, bytes]:
    """Contents by name: records, certificate, `session.json`, `truth.json` and what is uncertain.

    `facts.further` says what was simulated and stands in `truth.json` too. An interrupted record is a
    file that ends in the middle of a line (CSV) or of its bytes.
    """
    records = records_lab(session.positions)
    files = session_files(
        facts,
        records=records,
        certificate=certificate_lab(session.certificate),
        truth=truth_values(session.truth),
        record_format=record_format,
    )
    files[FILE_NAME] = _text(_with_temperatures(json.loads(files[FILE_NAME]), records))
    files[TRUTH] = _text(json.loads(files[TRUTH]) | (facts.further or {}))
    for record, item in zip(records, session.positions, strict=True):
        if Kind.INTERRUPTED in item.faults:
            name = record_name(record.theta_deg, record.psi_deg, record.repeat, record_format)
            files[name] = cut_short(files[name], record_format)
    common = {key: value for key, value in common_lab(session.certificate)._asdict().items() if value}
    if common:
        files[UNCERTAINTIES] = _text(common)
    return files


def _with_temperatures(description: dict[str, Any], records: Sequence[CurrentRecord]) -> dict[str, Any]:
    """`session.json` with each record's temperature, which a CSV file has no place for."""
    for entry, record in zip(description.get("positions", []), records, strict=True):
        if record.temperature_c is not None:
            entry["temperature_c"] = record.temperature_c
    return description


def cut_short(data: bytes, record_format: RecordFormat) -> bytes:
    """A file whose writing was interrupted: without the second half of its last line, or of its bytes."""
    if record_format == "parquet":
        return data[: len(data) // 2]
    start = data.rstrip(b"\r\n").rfind(b"\n") + 1
    return data[: start + len(data[start:].rstrip(b"\r\n")) // 2]


def _text(content: object) -> bytes:
    return (dumps(content, indent=1) + "\n").encode()
