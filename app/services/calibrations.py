"""Calibrations: asking for one, keeping its result for ever, showing it."""

import hashlib
import json
from collections.abc import Mapping
from dataclasses import asdict
from typing import Any, Final, get_args

from app.errors import Invalid, NotFound, problem
from app.exchange.rows import MeansRow
from app.services import jobs, priors, stands, verdicts
from app.services.drift import following
from app.services.gyros import nominals_of
from app.services.job_views import job_view
from app.services.lab import Work
from app.services.sessions import find_session, measurement_view, views
from app.services.solving import FEWEST_TRIALS, Stated
from app.services.views import CalibrationView, JobView, Page, SessionView
from app.store import measurement, results
from app.store.tables import Calibration, CalibrationParameter, Measurement, MeasuringSession, StandAttitude
from solver.records import Method

METHODS: Final = (*get_args(Method), "both")
TRIALS: Final = 20_000
"""Monte Carlo draws of a calibration when nobody says otherwise: the ends of their intervals are good to 2 % of u."""
MOST_TRIALS: Final = 10_000_000


def request(
    work: Work, session_id: int, method: str = "both", trials: int | None = TRIALS, seed: int = 0
) -> JobView:
    """Ask for a calibration from the measurements that count now.

    A second request while the same one waits or runs gives the same job.

    Parameters
    ----------
    trials, seed
        Draws of the Monte Carlo propagation of the uncertainty (0 for none, None for as many as two digits
        of u need), and of its random numbers.

    Raises
    ------
    Invalid
        Unknown method, a number of trials or a seed out of range, or nothing measured yet.
    """
    find_session(work, session_id)
    if method not in METHODS:
        raise Invalid(problem("unknown-method", "There is no method “%(method)s”. Choose one of %(methods)s.",
                              column="method", method=method, methods=", ".join(METHODS)))  # fmt: skip
    if trials and not FEWEST_TRIALS <= trials <= MOST_TRIALS:
        raise Invalid(problem("bad-trials", "The number of trials is 0 for none, or from %(fewest)d to %(most)d.",
                              column="monte_carlo", fewest=FEWEST_TRIALS, most=MOST_TRIALS))  # fmt: skip
    if not 0 <= seed < 2**63:
        raise Invalid(problem("bad-seed", "The seed is a whole number from 0 to 2⁶³ − 1.", column="seed"))
    inputs = [row.id for row in measurement.current(work.db, session_id)]
    if not inputs:
        raise Invalid(problem("nothing-measured", "No position of this session has been measured yet."))
    wanted = {"method": method, "inputs": inputs, "trials": trials, "seed": seed}
    running = results.jobs_of(work.db, [session_id]).get(session_id)
    if running is not None and running.state in results.ACTIVE and running.request == wanted:
        return job_view(running)
    return jobs.submit(work, "calibrate", wanted, session_id)


def prepare(work: Work, session_id: int, wanted: Mapping[str, Any]) -> dict[str, Any]:
    """What the solving process needs: rows in laboratory units, latitude, method."""
    session = find_session(work, session_id)
    rows = [means_row(row) for row in measurement.measurements(work.db, wanted["inputs"])]
    return {
        "means": [asdict(row) for row in rows],
        "certificate": [asdict(row) for row in stands.certificate_rows(session.certificate)],
        "latitude_deg": session.latitude_deg,
        "method": wanted["method"],
        "stated": asdict(stated(work, session, wanted)),
    }


def stated(work: Work, session: MeasuringSession, wanted: Mapping[str, Any]) -> Stated:
    """What is known of a session beside its currents and its certificate."""
    coefficients = {
        name: item.per_kelvin
        for name, item in nominals_of(session.gyro.type).items()
        if item.per_kelvin is not None
    }
    by_type = {"temperature_coefficients": coefficients} if coefficients else {}
    return Stated(
        uncertainties={**by_type, **stands.statement(session.certificate)},
        prior=priors.expectation(work, session),
        trials=wanted.get("trials", 0),
        seed=wanted.get("seed", 0),
    )


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
        result_digest=digest, **output["fit"], created_at=work.now, created_by=work.person.name,
        parameters=[CalibrationParameter(**item) for item in output["parameters"]],
    )  # fmt: skip
    work.db.add(row)
    work.db.flush()
    if output["attitude"] is not None:
        work.db.add(StandAttitude(calibration_id=row.id, **output["attitude"]))
    by = {item["method"] for item in output["parameters"]}
    following.changed(work, session.gyro_id, methods=by)
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
    """Sessions that have a result, the last one measured first, each with its newest result."""
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
