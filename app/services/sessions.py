"""Sessions at the stand: opening one, seeing it, listing them."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime, timedelta
from typing import Any, Final, cast

from app.errors import Invalid, NotFound, problem
from app.services import gyros, stands, verdicts
from app.services.job_views import job_view
from app.services.lab import Work
from app.services.live_views import Phase, RunBrief
from app.services.lookup import find_gyro
from app.services.views import (
    MeasurementView,
    Page,
    PositionView,
    SessionDetail,
    SessionState,
    SessionView,
)
from app.store import equipment, measurement, results, station
from app.store.tables import Calibration, Gyro, Job, Measurement, MeasuringSession, StandCertificate, Start

ON_FOR: Final = timedelta(hours=12)
"""A gyro is on for a working day; that it was on longer somebody has to say."""


@dataclass(frozen=True, slots=True)
class NewSession:
    """What is said when a session is opened.

    Without a certificate it is the one valid when the session started. Without the number of a start,
    `new_start` counts a further power-up, or says that it is still the newest; where it says nothing (None), the
    session belongs to the power-up or session of the gyro that is nearest to it within `ON_FOR`, else to a new one.
    """

    gyro: str
    stand: str
    certificate: str | None = None
    start: int | None = None
    new_start: bool | None = None
    started_at: datetime | None = None
    temperature_c: float | None = None
    note: str = ""
    origin: str = "typed"
    truth: dict[str, Any] | None = None


def open_session(work: Work, new: NewSession) -> SessionView:
    """Open a session for a gyro on a stand, frozen to one version of the stand's certificate.

    Raises
    ------
    NotFound
        Unknown gyro, stand, certificate or start.
    Invalid
        No certificate of the stand is valid then.
    """
    gyro, stand = find_gyro(work, new.gyro), stands.find_stand(work, new.stand)
    started_at = new.started_at or work.now
    row = MeasuringSession(
        gyro=gyro, stand=stand, certificate=_certificate(work, new, started_at),
        start=_start(work, new, gyro, started_at), latitude_deg=stand.latitude_deg, origin=new.origin,
        started_at=started_at, temperature_c=new.temperature_c, note=new.note, created_at=work.now,
        created_by=work.person.name, truth=new.truth,
    )  # fmt: skip
    work.db.add(row)
    work.db.flush()
    return views(work, [row])[0]


def _certificate(work: Work, new: NewSession, started_at: datetime) -> StandCertificate:
    stand = stands.find_stand(work, new.stand)
    if new.certificate is not None:
        return stands.find_certificate(work, stand, new.certificate)
    valid = equipment.valid_certificate(work.db, stand.id, started_at.date())
    if valid is None:
        raise Invalid(problem("no-valid-certificate", "Stand %(stand)s has no certificate valid on %(day)s. "
                              "Enter its certificate, or name the one to use.", column="certificate",
                              stand=stand.name, day=started_at.date().isoformat()))  # fmt: skip
    return valid


def _start(work: Work, new: NewSession, gyro: Gyro, started_at: datetime) -> Start:
    if new.start is not None:
        known = equipment.start(work.db, gyro.id, new.start)
        if known is None:
            raise NotFound(problem("unknown-start", "Gyro %(gyro)s has no start %(number)d.", column="start",
                                   gyro=gyro.serial, number=new.start))  # fmt: skip
        return known
    known = None
    if new.new_start is None:
        known = equipment.start_at(work.db, gyro.id, started_at, ON_FOR)
    elif not new.new_start:
        known = equipment.last_start(work.db, gyro.id)
    return known or gyros.add_start(work, gyro, started_at)


def sessions(
    work: Work,
    *,
    gyro: str | None = None,
    stand: str | None = None,
    since: datetime | None = None,
    until: datetime | None = None,
    before: int | None = None,
    limit: int = 50,
) -> Page[SessionView]:
    """Sessions, the newest first."""
    rows = measurement.sessions(
        work.db, gyro=gyro, stand=stand, since=since, until=until, before=before, limit=limit + 1
    )
    items = views(work, rows[:limit])
    return Page(items, str(items[-1].id) if len(rows) > limit else None)


def session(work: Work, session_id: int) -> SessionView:
    """One session in one line."""
    return views(work, [find_session(work, session_id)])[0]


def detail(work: Work, session_id: int) -> SessionDetail:
    """One session with its positions, all revisions and all results."""
    row = find_session(work, session_id)
    revisions = measurement.revisions(work.db, session_id)
    certificate = stands.certificate_view(row.certificate, work.now.date())
    return SessionDetail(
        session=views(work, [row])[0],
        certificate=certificate,
        positions=_positions(row, revisions),
        revisions=tuple(measurement_view(item) for item in revisions),
        results=tuple(verdicts.summary(item) for item in results.calibrations_of(work.db, session_id)),
        truth=row.truth,
    )


def _positions(row: MeasuringSession, revisions: Sequence[Measurement]) -> tuple[PositionView, ...]:
    newest = {(item.theta_deg, item.psi_deg, item.repeat): item for item in revisions}
    certified = {(item.theta_deg, item.psi_deg): item for item in stands.certificate_rows(row.certificate)}
    places = sorted({(*place, 0) for place in certified} | set(newest))
    numbers = {place: number for number, place in enumerate(sorted(certified), start=1)}
    return tuple(
        PositionView(
            numbers[theta, psi], theta, psi, repeat, certified[theta, psi],
            measurement_view(newest[theta, psi, repeat]) if (theta, psi, repeat) in newest else None,
        )
        for theta, psi, repeat in places
    )  # fmt: skip


def views(work: Work, rows: Sequence[MeasuringSession]) -> tuple[SessionView, ...]:
    """Sessions as they are listed: counts, jobs and results are fetched for all of them at once."""
    ids = [row.id for row in rows]
    counts = measurement.measured_positions(work.db, ids)
    jobs, newest = results.jobs_of(work.db, ids), results.last_calibrations(work.db, ids)
    runs = {
        key: RunBrief(cast(Phase, run.phase), *run[1:], now=work.now)
        for key, run in station.briefs(work.db, ids).items()
    }
    return tuple(_view(row, counts, jobs.get(row.id), newest.get(row.id), runs.get(row.id)) for row in rows)


def _view(
    row: MeasuringSession,
    counts: Mapping[int, int],
    job: Job | None,
    newest: Calibration | None,
    run: RunBrief | None,
) -> SessionView:
    measured, total = counts.get(row.id, 0), len(row.certificate.positions)
    return SessionView(
        id=row.id, gyro=row.gyro.serial, type=row.gyro.type.name, stand=row.stand.name,
        certificate=row.certificate.number, start=row.start.number, origin=row.origin,
        started_at=row.started_at, created_by=row.created_by, temperature_c=row.temperature_c,
        note=row.note, latitude_deg=row.latitude_deg, positions_measured=measured, positions_total=total,
        state=_state(job, newest, measured, total), job=job_view(job) if job else None,
        result=verdicts.summary(newest) if newest else None, station=run,
    )  # fmt: skip


def _state(job: Job | None, newest: Calibration | None, measured: int, total: int) -> SessionState:
    if job is not None and job.state in results.ACTIVE:
        return "solving"
    if job is not None and job.state == "failed":
        return "failed"
    if newest is not None:
        return "solved"
    return "ready" if measured >= total else "measuring"


def find_session(work: Work, session_id: int) -> MeasuringSession:
    """The session's row, or `NotFound`."""
    row = measurement.session(work.db, session_id)
    if row is None:
        raise NotFound(problem("unknown-session", "There is no session %(number)d.", number=session_id))
    return row


def measurement_view(row: Measurement) -> MeasurementView:
    """A measurement as it is shown."""
    return MeasurementView(
        id=row.id, theta_deg=row.theta_deg, psi_deg=row.psi_deg, repeat=row.repeat, revision=row.revision,
        jx_ma=row.jx_ma, jy_ma=row.jy_ma, u_jx_ma=row.u_jx_ma, u_jy_ma=row.u_jy_ma,
        duration_s=row.duration_s, rate_hz=row.rate_hz, measured_at=row.measured_at,
        temperature_c=row.temperature_c, record=row.record_digest, origin=row.origin, note=row.note,
        created_at=row.created_at, created_by=row.created_by,
    )  # fmt: skip
