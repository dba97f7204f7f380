"""Simulated sessions: opened like real ones, measured by the simulator, solved at once."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

from app.errors import Invalid, problem
from app.services import calibrations, ingest, jobs, stands
from app.services.calibrations import METHODS
from app.services.lab import Work
from app.services.sessions import NewSession, find_session, open_session
from app.services.simulated import Conditions
from app.services.views import JobView, SessionView
from app.store import measurement


@dataclass(frozen=True, slots=True)
class NewSimulation:
    """What is to be simulated; `noise_deg_per_h` of a position's mean, None for the type's own."""

    gyro: str
    stand: str
    seed: int
    duration_s: float = 60.0
    rate_hz: float = 200.0
    noise_deg_per_h: float | None = None
    certificate: str | None = None
    method: str = "both"


def request(work: Work, new: NewSimulation) -> tuple[SessionView, JobView]:
    """Open the session and put its simulation in the queue.

    Raises
    ------
    Invalid
        A value outside what the simulator can do, each named by its field.
    """
    _check(new)
    session = open_session(work, NewSession(new.gyro, new.stand, new.certificate, origin="simulation"))
    conditions = Conditions(
        session.type, new.gyro, new.stand, session.start, new.seed, new.duration_s, new.rate_hz,
        new.noise_deg_per_h,
    )  # fmt: skip
    wanted = {"conditions": asdict(conditions), "method": new.method, "trials": calibrations.TRIALS}
    return session, jobs.submit(work, "simulate", wanted, session.id)


def _check(new: NewSimulation) -> None:
    wrong = []
    if not 0 <= new.seed < 2**63:
        wrong.append(problem("bad-seed", "The seed is a whole number from 0 to 2⁶³ − 1.", column="seed"))
    if not 1 <= new.duration_s <= 3600:
        wrong.append(
            problem("bad-duration", "The duration lies between 1 s and 3600 s.", column="duration_s")
        )
    if not 1 <= new.rate_hz <= 2000:
        wrong.append(problem("bad-rate", "The rate lies between 1 Hz and 2000 Hz.", column="rate_hz"))
    if new.noise_deg_per_h is not None and not 0 <= new.noise_deg_per_h <= 10:
        wrong.append(problem("bad-noise", "The noise lies between 0 and 10 °/h.", column="noise_deg_per_h"))
    if new.method not in METHODS:
        wrong.append(problem("unknown-method", "There is no method “%(method)s”. Choose one of %(methods)s.",
                             column="method", method=new.method, methods=", ".join(METHODS)))  # fmt: skip
    if wrong:
        raise Invalid(*wrong)


def prepare(work: Work, session_id: int, wanted: Mapping[str, Any]) -> dict[str, Any]:
    """What the simulating process needs."""
    session = find_session(work, session_id)
    known = calibrations.stated(work, session, wanted)
    return {
        "records": str(work.files.folder),
        "certificate": [asdict(row) for row in stands.certificate_rows(session.certificate)],
        "latitude_deg": session.latitude_deg,
        "conditions": dict(wanted["conditions"]),
        "method": wanted["method"],
        "stated": asdict(known),
    }


def store(work: Work, session_id: int, wanted: Mapping[str, Any], output: Mapping[str, Any]) -> int:
    """Keep records, means, truth and result."""
    find_session(work, session_id).truth = output["truth"]
    ingest.save(
        work,
        session_id,
        [
            ingest.measured_item(item, ingest.Source("simulation", item["record"]["digest"]))
            for item in output["measured"]
        ],
    )
    inputs = [row.id for row in measurement.current(work.db, session_id)]
    return calibrations.store(work, session_id, {"method": wanted["method"], "inputs": inputs}, output)
