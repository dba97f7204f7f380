"""Keeping the studies up with what comes in: told of every change, one job behind it.

`changed` counts a change in the same transaction as the change itself, and enqueues the job that takes it
in (`app.services.drift.studying`) unless one waits to begin already. The job reads the count with the data,
so it knows what its study has seen: whatever comes in meanwhile leaves the study behind, and has a job of its
own. A crash at any moment leaves the old study or the new one, and the job queue begins the job anew.

A subject is a gyro, ``{"gyro": id}``, or a stand, ``{"stand": id}``: the request of a job of kind `KIND`.
"""

from collections.abc import Iterable, Mapping
from typing import Final

from app.services import jobs
from app.services.lab import Work
from app.store import drift
from app.store.tables import DriftStudy
from solver import __version__

KIND: Final = "follow"
STAND_METHOD: Final = "least-squares"
"""By which a stand's gyros are studied together."""
Subject = Mapping[str, int]


def changed(work: Work, gyro_id: int, *, methods: Iterable[str] = ()) -> None:
    """Something came in for a gyro: a result by these methods, an event, a baseline, other limits.

    Parameters
    ----------
    methods
        Those that may be new to the gyro; every study that is there is counted anyway.
    """
    _count(work, {"gyro": gyro_id}, methods)


def studied_gyro(work: Work, gyro_id: int, methods: Iterable[str]) -> None:
    """A gyro's study was made by these methods: the stands it was measured on are studied from it."""
    if STAND_METHOD in methods:
        for stand in drift.stands_of(work.db, gyro_id):
            _count(work, {"stand": stand.id}, (STAND_METHOD,))


def changed_stand(work: Work, stand_id: int) -> None:
    """Something happened to a stand; its own study and those of the gyros measured there take it in.

    Gyros before stands, as everywhere: whoever locks rows in one order waits for nobody in a circle.
    """
    for gyro_id in drift.gyros_on(work.db, stand_id):
        _count(work, {"gyro": gyro_id}, ())
    _count(work, {"stand": stand_id}, ())


def changed_type(work: Work, type_id: int) -> None:
    """A type's limits or interval are others now."""
    for gyro_id in drift.gyros_of_type(work.db, type_id):
        _count(work, {"gyro": gyro_id}, ())


def catch_up(work: Work) -> None:
    """See to it that a job will make every study that is missing, behind without a job, or of another solver.

    For the start of the service: results may be older than the studies, and a job may have failed.
    """
    for gyro_id, method in drift.without_study(work.db):
        work.db.add(DriftStudy(gyro_id=gyro_id, method=method))
    work.db.flush()
    for row in drift.outdated(work.db, __version__):
        row.changed += 1
    work.db.flush()
    rows = drift.unattended(work.db)
    gyros = {row.gyro_id for row in rows if row.gyro_id is not None}
    stands = {row.stand_id for row in rows if row.stand_id is not None}
    for subject in (*({"gyro": key} for key in sorted(gyros)), *({"stand": key} for key in sorted(stands))):
        _count(work, subject, ())


def ids(subject: Subject) -> tuple[int | None, int | None]:
    """The gyro's id and the stand's, one of them None."""
    return subject.get("gyro"), subject.get("stand")


def _count(work: Work, subject: Subject, methods: Iterable[str]) -> None:
    """Count a change of every study of the subject; one job will take them all in."""
    gyro_id, stand_id = ids(subject)
    drift.locked(work.db, gyro_id, stand_id)
    rows = list(drift.studies(work.db, gyro_id, stand_id))
    for row in rows:
        row.changed += 1
    missing = set(methods) - {row.method for row in rows}
    rows += [
        DriftStudy(gyro_id=gyro_id, stand_id=stand_id, method=method, changed=1, studied=0)
        for method in sorted(missing)
    ]
    if not rows:
        return
    work.db.add_all(rows)
    known = {row.job_id for row in rows if row.job_id is not None}
    waiting = drift.queued_job(work.db, sorted(known)) or jobs.submit(work, KIND, subject, None).id
    for row in rows:
        row.job_id = waiting
    work.db.flush()
