"""What child processes compute: plain payloads in, plain outputs out, no database.

Each function has the shape ``fn(payload, report) -> output``; `report` takes a fraction and a
phase. A result's JSON text is made once, in `app.services.solving`, and kept byte for byte.
"""

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from app.exchange.items import read_item
from app.exchange.rows import CertificateRow, CurrentRecord, MeansRow
from app.services.drift import studying
from app.services.keeping import keep_record
from app.services.simulated import Conditions, simulated_records
from app.services.solving import Report, Stated, solved
from app.store.records import RecordFiles


def calibrate(payload: Mapping[str, Any], report: Report) -> dict[str, Any]:
    """Solve means against a certificate; see `app.services.calibrations.prepare`."""
    report(0.1, "solving")
    means = [MeansRow(**row) for row in payload["means"]]
    certificate = [CertificateRow(**row) for row in payload["certificate"]]
    stated = Stated(**payload["stated"])
    return solved(means, certificate, payload["latitude_deg"], payload["method"], stated, report)


def import_records(payload: Mapping[str, Any], report: Report) -> dict[str, Any]:
    """Read an uploaded session or file, keep each position's record, give the means."""
    files = RecordFiles(Path(payload["records"]))
    report(0.02, "reading")
    source = files.read(payload["source"], payload["suffix"])
    item = read_item(source, payload["name"])
    typed = [{"means": asdict(row), "record": None} for row in item.measured()[len(item.records) :]]
    return {"measured": _kept(files, item.records, report, until=1.0) + typed}


def simulate(payload: Mapping[str, Any], report: Report) -> dict[str, Any]:
    """Simulate a session with its records, then solve it; see `app.services.simulations`."""
    files = RecordFiles(Path(payload["records"]))
    certificate = [CertificateRow(**row) for row in payload["certificate"]]
    conditions = Conditions(**payload["conditions"])
    report(0.02, "simulating")
    stated = Stated(**payload["stated"])
    truth, records = simulated_records(conditions, certificate, payload["latitude_deg"], stated.uncertainties)
    measured = _kept(files, records, report, until=0.9)
    means = [MeansRow(**item["means"]) for item in measured]
    report(0.92, "solving")
    result = solved(means, certificate, payload["latitude_deg"], payload["method"], stated)
    return {"measured": measured, "truth": truth, **result}


def follow(payload: Mapping[str, Any], report: Report) -> dict[str, Any]:
    """Study a gyro's or a stand's drift; see `app.services.drift.studying`."""
    return studying.studied(payload, report)


def _kept(
    files: RecordFiles, records: Sequence[CurrentRecord], report: Report, until: float
) -> list[dict[str, Any]]:
    kept = []
    for number, record in enumerate(records, start=1):
        kept.append(keep_record(files, record))
        report(until * number / len(records), "keeping")
    return kept
