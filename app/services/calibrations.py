"""Calibrations: asking for one, keeping its result for ever, showing it."""

import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from typing import Any, Final, get_args

from app.errors import Invalid, NotFound, problem
from app.exchange.rows import CertificateRow, MeansRow
from app.services import jobs, stands, verdicts
from app.services.job_views import job_view
from app.services.lab import Work
from app.services.sessions import find_session, measurement_view, views
from app.services.views import CalibrationView, JobView, Page, SessionView
from app.store import measurement, results
from app.store.tables import Calibration, CalibrationParameter, Measurement
from solver.records import Method

METHODS: Final = (*get_args(Method), "both")


def request(work: Work, session_id: int, method: str = "both") -> JobView:
    """Ask for a calibration from the measurements that count now.

    A second request while the same one waits or runs gives the same job.

    Raises
    ------
    Invalid
        Unknown method, or nothing measured yet.
    """
    find_session(work, session_id)
    if method not in METHODS:
        raise Invalid(problem("unknown-method", "There is no method “%(method)s”. Choose one of %(methods)s.",
                              column="method", method=method, methods=", ".join(METHODS)))  # fmt: skip
    inputs = [row.id for row in measurement.current(work.db, session_id)]
    if not inputs:
        raise Invalid(problem("nothing-measured", "No position of this session has been measured yet."))
    wanted = {"method": method, "inputs": inputs}
    running = results.jobs_of(work.db, [session_id]).get(session_id)
    if running is not None and running.state in results.ACTIVE and running.request == wanted:
        return job_view(running)
    return jobs.submit(work, "calibrate", wanted, session_id)


def prepare(work: Work, session_id: int, wanted: Mapping[str, Any]) -> dict[str, Any]:
    """What the solving process needs: rows in laboratory units, latitude, method."""
    session = find_session(work, session_id)
    rows = [means_row(row) for row in measurement.measurements(work.db, wanted["inputs"])]
    return solver_payload(
        rows, stands.certificate_rows(session.certificate), session.latitude_deg, wanted["method"]
    )


def solver_payload(
    rows: Sequence[MeansRow], certificate: Sequence[CertificateRow], latitude_deg: float, method: str
) -> dict[str, Any]:
    """The payload of `app.services.computing.calibrate`."""
    return {
        "means": [asdict(row) for row in rows],
        "certificate": [asdict(row) for row in certificate],
        "latitude_deg": latitude_deg,
        "method": method,
    }


def store(work: Work, session_id: int, wanted: Mapping[str, Any], output: Mapping[str, Any]) -> int:
    """Keep a result as the session's next revision; the same result again stays the one there is."""
    session = find_session(work, session_id)
    last = results.last_calibration(work.db, session_id)
    digest = hashlib.sha256(output["result"].encode()).hexdigest()
    if last is not None and last.result_digest == digest and last.inputs == wanted["inputs"]:
        return last.id
    row = Calibration(
        session_id=session_id, revision=last.revision + 1 if last else 1,
        replaces_id=last.id if last else None, method=wanted["method"],
        solver_version=output["solver_version"], input_hash=output["input_hash"],
        certificate_id=session.certificate_id, inputs=list(wanted["inputs"]), result=output["result"],
        result_digest=digest, created_at=work.now, created_by=work.person.name,
        parameters=[CalibrationParameter(**item) for item in output["parameters"]],
    )  # fmt: skip
    work.db.add(row)
    work.db.flush()
    return row.id


def calibration(work: Work, calibration_id: int) -> CalibrationView:
    """A result with its provenance."""
    row = _find(work, calibration_id)
    later = [item for item in results.calibrations_of(work.db, row.session_id) if item.replaces_id == row.id]
    return CalibrationView(
        id=row.id, session=views(work, [row.session])[0],
        certificate=stands.certificate_view(row.session.certificate, work.now.date()),
        revision=row.revision, replaces=row.replaces_id, replaced_by=later[0].id if later else None,
        method=row.method, solver_version=row.solver_version, input_hash=row.input_hash,
        result_digest=row.result_digest, created_at=row.created_at, created_by=row.created_by,
        summary=verdicts.summary(row), result=json.loads(row.result),
        inputs=tuple(measurement_view(item) for item in measurement.measurements(work.db, row.inputs)),
    )  # fmt: skip


def result_text(work: Work, calibration_id: int) -> str:
    """The result's JSON text, byte for byte as it was stored."""
    return _find(work, calibration_id).result


def calibrations(
    work: Work,
    *,
    gyro: str | None = None,
    type_name: str | None = None,
    before: int | None = None,
    limit: int = 50,
) -> Page[SessionView]:
    """Sessions that have a result, the newest result first, each with its newest result."""
    rows = results.calibrations(work.db, gyro=gyro, type_name=type_name, before=before, limit=limit + 1)
    items = views(work, [row.session for row in rows[:limit]])
    return Page(items, str(rows[limit - 1].id) if len(rows) > limit else None)


def current_means(work: Work, session_id: int) -> list[MeansRow]:
    """The means that count now, by position and repeat."""
    find_session(work, session_id)
    return [means_row(row) for row in measurement.current(work.db, session_id)]


def means_row(row: Measurement) -> MeansRow:
    """A stored measurement as the solver's input takes it."""
    if row.jx_ma is None or row.jy_ma is None:
        raise ValueError(f"measurement {row.id} is withdrawn")
    return MeansRow(
        row.theta_deg, row.psi_deg, row.jx_ma, row.jy_ma, row.u_jx_ma, row.u_jy_ma, row.duration_s,
        row.rate_hz, row.measured_at, row.temperature_c, row.repeat, row.dof_jx, row.dof_jy,
    )  # fmt: skip


def _find(work: Work, calibration_id: int) -> Calibration:
    row = results.calibration(work.db, calibration_id)
    if row is None:
        raise NotFound(
            problem("unknown-calibration", "There is no calibration %(number)d.", number=calibration_id)
        )
    return row
