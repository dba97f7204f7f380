"""What child processes compute: plain payloads in, plain outputs out, no database.

Each function has the shape ``fn(payload, report) -> output``; `report` takes a fraction and a
phase. A result's JSON text is made here, once, and kept byte for byte.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from app.errors import Invalid, problem
from app.exchange.items import read_item
from app.exchange.json_values import dumps
from app.exchange.result import ResultMethod, calibration_json, parameters_json
from app.exchange.rows import CertificateRow, CurrentRecord, MeansRow
from app.exchange.si import observations
from app.services.keeping import keep_record
from app.services.simulated import Conditions, simulated_records
from app.store.records import RecordFiles
from solver.calibrate import calibrate as solve
from solver.errors import SolverError
from solver.records import Estimate

Report = Callable[[float, str], None]


def calibrate(payload: Mapping[str, Any], report: Report) -> dict[str, Any]:
    """Solve means against a certificate; see `app.services.calibrations.solver_payload`."""
    report(0.1, "solving")
    means = [MeansRow(**row) for row in payload["means"]]
    certificate = [CertificateRow(**row) for row in payload["certificate"]]
    return solved(means, certificate, payload["latitude_deg"], payload["method"])


def solved(
    means: Sequence[MeansRow],
    certificate: Sequence[CertificateRow],
    latitude_deg: float,
    method: ResultMethod,
) -> dict[str, Any]:
    """A result as it is stored: JSON text, hashes, and the parameters laid out for the history."""
    try:
        calibration = solve(observations(means, certificate, latitude_deg), method)
    except SolverError as error:
        raise Invalid(problem(error.message.code, error.message.template, **error.message.values)) from error
    parameters = []
    for estimate in (calibration.least_squares, calibration.paper):
        if isinstance(estimate, Estimate):
            parameters += _history_rows(estimate)
    return {
        "result": dumps(calibration_json(calibration, method)),
        "input_hash": calibration.input_hash,
        "solver_version": calibration.solver_version,
        "parameters": parameters,
    }


def _history_rows(estimate: Estimate) -> list[dict[str, Any]]:
    written = parameters_json(estimate.values, estimate.standard_uncertainties)
    return [
        {
            "method": estimate.method,
            "parameter": name,
            "value": entry["value"],
            "standard_uncertainty": entry["standard_uncertainty"],
        }
        for name, entry in written.items()
    ]


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
    truth, records = simulated_records(conditions, certificate, payload["latitude_deg"])
    measured = _kept(files, records, report, until=0.9)
    means = [MeansRow(**item["means"]) for item in measured]
    report(0.92, "solving")
    result = solved(means, certificate, payload["latitude_deg"], payload["method"])
    return {"measured": measured, "truth": truth, **result}


def _kept(
    files: RecordFiles, records: Sequence[CurrentRecord], report: Report, until: float
) -> list[dict[str, Any]]:
    kept = []
    for number, record in enumerate(records, start=1):
        kept.append(keep_record(files, record))
        report(until * number / len(records), "storing records")
    return kept
