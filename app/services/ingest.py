"""Bringing measurements in: each saved position is a revision; nothing is overwritten."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final

from app.errors import Invalid, NotFound, problem
from app.exchange.positions import same_angle
from app.exchange.rows import MeansRow
from app.services import calibrations, jobs, stands
from app.services.lab import Work
from app.services.sessions import find_session, measurement_view
from app.services.views import JobView, MeasurementView
from app.store import measurement
from app.store.tables import Measurement, MeasuringSession, Record

_CONTENT: Final = ("jx_ma", "jy_ma", "u_jx_ma", "u_jy_ma", "duration_s", "rate_hz", "measured_at",
                   "temperature_c", "record_digest", "source_digest", "note")  # fmt: skip


@dataclass(frozen=True, slots=True)
class Source:
    """Where a measurement came from: the way, the uploaded bytes, the record file made of them."""

    origin: str
    digest: str | None = None
    name: str = ""
    record_digest: str | None = None


@dataclass(frozen=True, slots=True)
class Saved:
    """A saved position; `new` is False when the very same was there already."""

    measurement: MeasurementView
    new: bool


@dataclass(frozen=True, slots=True)
class StoredRecord:
    """A record file that is on disk: digest of the Parquet file, and what it holds."""

    digest: str
    samples: int
    duration_s: float
    rate_hz: float


def save_means(work: Work, session_id: int, row: MeansRow, source: Source, note: str = "") -> Saved:
    """Save the means of one position as its newest revision.

    Raises
    ------
    NotFound
        No such session.
    Invalid
        The session's certificate has no such position, so its angles are unknown.
    """
    session = find_session(work, session_id)
    theta_deg, psi_deg = _certified_place(session, row)
    content = {
        "jx_ma": row.jx_ma, "jy_ma": row.jy_ma, "u_jx_ma": row.u_jx_ma, "u_jy_ma": row.u_jy_ma,
        "duration_s": row.duration_s, "rate_hz": row.rate_hz, "measured_at": row.started_at,
        "temperature_c": row.temperature_c, "record_digest": source.record_digest,
        "source_digest": source.digest, "note": note,
    }  # fmt: skip
    last = measurement.last_revision(work.db, session_id, theta_deg, psi_deg, row.repeat)
    if last is not None and all(getattr(last, name) == content[name] for name in _CONTENT):
        return Saved(measurement_view(last), new=False)
    new = Measurement(
        session_id=session_id, theta_deg=theta_deg, psi_deg=psi_deg, repeat=row.repeat,
        revision=last.revision + 1 if last else 1, origin=source.origin, created_at=work.now,
        created_by=work.person.name, **content,
    )  # fmt: skip
    work.db.add(new)
    work.db.flush()
    return Saved(measurement_view(new), new=True)


def withdraw(work: Work, session_id: int, theta_deg: float, psi_deg: float, repeat: int, note: str) -> Saved:
    """Take a position back: a revision without currents, with the reason."""
    find_session(work, session_id)
    last = measurement.last_revision(work.db, session_id, theta_deg, psi_deg, repeat)
    if last is None:
        raise NotFound(problem("not-measured", "This position has not been measured."))
    if last.jx_ma is None:
        return Saved(measurement_view(last), new=False)
    new = Measurement(
        session_id=session_id, theta_deg=theta_deg, psi_deg=psi_deg, repeat=repeat,
        revision=last.revision + 1, origin="withdrawn", note=note, created_at=work.now,
        created_by=work.person.name,
    )  # fmt: skip
    work.db.add(new)
    work.db.flush()
    return Saved(measurement_view(new), new=True)


def save_record(work: Work, session_id: int, row: MeansRow, record: StoredRecord, source: Source) -> Saved:
    """Save the means of a record whose file is on disk already."""
    if measurement.record(work.db, record.digest) is None:
        work.db.add(
            Record(
                digest=record.digest, samples=record.samples, duration_s=record.duration_s,
                rate_hz=record.rate_hz, source_digest=source.digest or record.digest,
                source_name=source.name, created_at=work.now,
            )
        )  # fmt: skip
        work.db.flush()
    return save_means(work, session_id, row, Source(source.origin, source.digest, source.name, record.digest))


def request_import(
    work: Work, session_id: int, source_digest: str, name: str, then_solve: str | None = None
) -> JobView:
    """Read an uploaded file, whose bytes are on disk, in the background; then solve if asked."""
    find_session(work, session_id)
    request = {"source": source_digest, "name": name, "method": then_solve}
    return jobs.submit(work, "import", request, session_id)


def prepare_import(work: Work, session_id: int, request: Mapping[str, Any]) -> dict[str, Any]:
    """What the reading process needs."""
    return {
        "records": str(work.files.folder),
        "source": request["source"],
        "name": request["name"],
        "suffix": source_suffix(request["name"]),
    }


def store_import(work: Work, session_id: int, request: Mapping[str, Any], output: Mapping[str, Any]) -> None:
    """Keep what was read, and ask for the calibration if that was wanted."""
    source = Source("upload", request["source"], request["name"])
    for item in output["measured"]:
        row = MeansRow(**item["means"])
        if item["record"] is None:
            save_means(work, session_id, row, source)
        else:
            save_record(work, session_id, row, StoredRecord(**item["record"]), source)
    if request["method"]:
        calibrations.request(work, session_id, request["method"])


def source_suffix(name: str) -> str:
    """Suffix under which an uploaded file's bytes are kept: its own where it is a plain one."""
    suffix = name.lower().rsplit("/", 1)[-1].partition(".")[2]
    return suffix if suffix.replace(".", "").isalnum() and len(suffix) <= 16 else "bin"


def _certified_place(session: MeasuringSession, row: MeansRow) -> tuple[float, float]:
    for certified in stands.certificate_rows(session.certificate):
        if same_angle(certified.theta_deg, row.theta_deg) and same_angle(certified.psi_deg, row.psi_deg):
            return certified.theta_deg, certified.psi_deg
    raise Invalid(
        problem(
            "position-not-certified",
            "Certificate %(number)s has no position θ %(theta)g°, ψ %(psi)g°; measure a certified position "
            "or enter a certificate that has it.",
            number=session.certificate.number,
            theta=row.theta_deg,
            psi=row.psi_deg,
        )
    )
