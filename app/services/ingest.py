"""Bringing measurements in: each saved position is a revision; nothing is overwritten."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from app.errors import Invalid, NotFound, Problem, problem
from app.exchange.positions import same_angle
from app.exchange.rows import MeansRow
from app.services import calibrations, jobs, stands
from app.services.lab import Work
from app.services.sessions import find_session, measurement_view
from app.services.views import JobView, MeasurementView
from app.store import measurement
from app.store.tables import Measurement, MeasuringSession, Record


@dataclass(frozen=True, slots=True)
class StoredRecord:
    """A record file that is on disk: digest of the Parquet file, and what it holds."""

    digest: str
    samples: int
    duration_s: float
    rate_hz: float


@dataclass(frozen=True, slots=True)
class Source:
    """Where a measurement came from: the way, and the uploaded bytes with their file's name."""

    origin: str
    digest: str | None = None
    name: str = ""


@dataclass(frozen=True, slots=True)
class Measured:
    """One measured position to be saved; `record` when its currents are kept too."""

    row: MeansRow
    source: Source
    record: StoredRecord | None = None
    note: str = ""


@dataclass(frozen=True, slots=True)
class Saved:
    """A saved position; `new` is False when the very same was there already."""

    measurement: MeasurementView
    new: bool


def save(work: Work, session_id: int, measured: Sequence[Measured]) -> tuple[Saved, ...]:
    """Save positions, each as its newest revision; what is there already in the same words stays.

    Raises
    ------
    NotFound
        No such session.
    Invalid
        The session's certificate lacks a position, so its angles are unknown; each is named.
    """
    session = find_session(work, session_id)
    places = _certified_places(session, measured)
    newest = {
        (row.theta_deg, row.psi_deg, row.repeat): row for row in measurement.revisions(work.db, session_id)
    }
    _keep_records(work, measured)
    saved = []
    for item, (theta_deg, psi_deg) in zip(measured, places, strict=True):
        key = (theta_deg, psi_deg, item.row.repeat)
        last, content = newest.get(key), _content(item)
        new = last is None or any(getattr(last, name) != value for name, value in content.items())
        if last is None or new:
            last = Measurement(
                session_id=session_id, theta_deg=theta_deg, psi_deg=psi_deg, repeat=item.row.repeat,
                revision=last.revision + 1 if last else 1, origin=item.source.origin,
                created_at=work.now, created_by=work.person.name, **content,
            )  # fmt: skip
            work.db.add(last)
            newest[key] = last
        saved.append((last, new))
    work.db.flush()
    return tuple(Saved(measurement_view(row), new) for row, new in saved)


def save_means(work: Work, session_id: int, row: MeansRow, source: Source, note: str = "") -> Saved:
    """Save the means of one position; see `save`."""
    return save(work, session_id, [Measured(row, source, note=note)])[0]


def save_record(work: Work, session_id: int, row: MeansRow, record: StoredRecord, source: Source) -> Saved:
    """Save the means of a record whose file is on disk already; see `save`."""
    return save(work, session_id, [Measured(row, source, record)])[0]


def _content(item: Measured) -> dict[str, Any]:
    row = item.row
    return {
        "jx_ma": row.jx_ma, "jy_ma": row.jy_ma, "u_jx_ma": row.u_jx_ma, "u_jy_ma": row.u_jy_ma,
        "dof_jx": row.dof_jx, "dof_jy": row.dof_jy, "duration_s": row.duration_s, "rate_hz": row.rate_hz,
        "measured_at": row.started_at, "temperature_c": row.temperature_c,
        "source_digest": item.source.digest, "note": item.note,
        "record_digest": item.record.digest if item.record else None,
    }  # fmt: skip


def _keep_records(work: Work, measured: Sequence[Measured]) -> None:
    wanted = {item.record.digest: (item.record, item.source) for item in measured if item.record}
    known = measurement.known_records(work.db, list(wanted))
    work.db.add_all(
        Record(
            digest=digest, samples=record.samples, duration_s=record.duration_s, rate_hz=record.rate_hz,
            source_digest=source.digest or digest, source_name=source.name, created_at=work.now,
        )
        for digest, (record, source) in wanted.items()
        if digest not in known
    )  # fmt: skip
    work.db.flush()


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
    save(work, session_id, [measured_item(item, source) for item in output["measured"]])
    if request["method"]:
        calibrations.request(work, session_id, request["method"])


def source_suffix(name: str) -> str:
    """Suffix under which an uploaded file's bytes are kept: its own where it is a plain one."""
    suffix = name.lower().rsplit("/", 1)[-1].partition(".")[2]
    return suffix if suffix.replace(".", "").isalnum() and len(suffix) <= 16 else "bin"


def measured_item(item: Mapping[str, Any], source: Source) -> Measured:
    """What a computing process measured, as it is saved."""
    record = None if item["record"] is None else StoredRecord(**item["record"])
    return Measured(MeansRow(**item["means"]), source, record)


def _certified_places(session: MeasuringSession, measured: Sequence[Measured]) -> list[tuple[float, float]]:
    certified = stands.certificate_rows(session.certificate)
    places, missing = [], []
    for item in measured:
        theta_deg, psi_deg = item.row.theta_deg, item.row.psi_deg
        place = next(
            (
                (row.theta_deg, row.psi_deg)
                for row in certified
                if same_angle(row.theta_deg, theta_deg) and same_angle(row.psi_deg, psi_deg)
            ),
            None,
        )
        if place is None:
            missing.append(_not_certified(session.certificate.number, theta_deg, psi_deg))
        else:
            places.append(place)
    if missing:
        raise Invalid(*missing)
    return places


def _not_certified(number: str, theta_deg: float, psi_deg: float) -> Problem:
    return problem(
        "position-not-certified",
        "Certificate %(number)s has no position θ %(theta)g°, ψ %(psi)g°; measure a certified position "
        "or enter a certificate that has it.",
        number=number,
        theta=theta_deg,
        psi=psi_deg,
    )
