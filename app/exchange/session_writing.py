"""A session as files, for a folder or a ZIP archive: what `session_folder` reads."""

from collections.abc import Mapping, Sequence
from datetime import datetime
from typing import Any, Final, Literal

from app.exchange.certificate import write_certificate_csv
from app.exchange.json_values import dumps
from app.exchange.means import write_means_csv
from app.exchange.parameters import write_truth
from app.exchange.record_files import write_record_csv, write_record_parquet
from app.exchange.record_places import record_name
from app.exchange.rows import CertificateRow, CurrentRecord, Facts, MeansRow
from app.exchange.session_folder import TRUTH
from app.exchange.session_json import FILE_NAME

RecordFormat = Literal["csv", "parquet"]
_CERTIFICATE: Final = "certificate.csv"
_MEANS: Final = "means.csv"


def session_files(
    facts: Facts,
    *,
    records: Sequence[CurrentRecord] = (),
    means: Sequence[MeansRow] = (),
    certificate: Sequence[CertificateRow] = (),
    truth: Mapping[str, float] | None = None,
    record_format: RecordFormat = "csv",
) -> dict[str, bytes]:
    """Write a session as files: `session.json`, a file for each record, certificate, means, truth.

    Parameters
    ----------
    facts
        Its `certificate` is replaced by the file's name when there is a certificate.
    truth
        True parameters in laboratory units, all eight.

    Returns
    -------
    dict
        Contents by name; `archive.save` and `archive.zip_bytes` take it.
    """
    write = write_record_parquet if record_format == "parquet" else write_record_csv
    names = [record_name(row.theta_deg, row.psi_deg, row.repeat, record_format) for row in records]
    files = {name: write(record) for name, record in zip(names, records, strict=True)}
    if certificate:
        files[_CERTIFICATE] = write_certificate_csv(certificate)
    if means:
        files[_MEANS] = write_means_csv(means)
    if truth is not None:
        files[TRUTH] = write_truth(truth)
    files[FILE_NAME] = _description(facts, bool(certificate), names, records)
    return files


def _description(
    facts: Facts, certified: bool, names: Sequence[str], records: Sequence[CurrentRecord]
) -> bytes:
    content: dict[str, Any] = {
        "gyro": facts.gyro,
        "stand": facts.stand,
        "latitude_deg": facts.latitude_deg,
        "certificate": _CERTIFICATE if certified else facts.certificate,
        "started_at": _text(facts.started_at),
        "temperature_c": facts.temperature_c,
        "positions": [
            {"theta_deg": record.theta_deg, "psi_deg": record.psi_deg, "file": name, "repeat": record.repeat}
            for name, record in zip(names, records, strict=True)
        ],
    } | (facts.further or {})
    known = {key: value for key, value in content.items() if value not in (None, [])}
    return (dumps(known, indent=1) + "\n").encode()


def _text(instant: datetime | None) -> str | None:
    return None if instant is None else instant.isoformat()
