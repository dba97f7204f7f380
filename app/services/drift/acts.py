"""What people did lately about the drift: events entered and withdrawn, baselines, alarms answered."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from datetime import datetime

from app.services.lab import Work
from app.store import drift
from app.store.tables import Alarm, Baseline, Event
from solver.records import PARAMETERS


@dataclass(frozen=True, slots=True)
class Act:
    """One thing that a person did.

    Attributes
    ----------
    kind
        event-entered, event-withdrawn, baseline-frozen, baseline-retired or alarm-acknowledged.
    about
        The kind of the event or of the alarm; empty of a baseline.
    gyro, stand, parameter
        What it was about.
    note
        What the person wrote with it.
    """

    at: datetime
    by: str
    kind: str
    about: str
    gyro: str | None
    stand: str | None
    parameter: str | None
    note: str


def latest(work: Work, limit: int) -> tuple[Act, ...]:
    """The latest acts, the newest first; what was done to several parameters at once is one."""
    found: dict[tuple[object, ...], Act] = {}
    for act in sorted(_acts(work, limit), key=lambda act: act.at, reverse=True):
        key = (act.at, act.by, act.kind, act.about, act.gyro, act.stand, act.note)
        found[key] = replace(act, parameter=None) if key in found else act
    return tuple(found.values())[:limit]


def _acts(work: Work, limit: int) -> Iterator[Act]:
    """The latest of each kind."""
    for event in drift.latest(work.db, Event, Event.created_at, limit):
        yield _of_event(work, event, "event-entered", event.created_at, event.created_by)
    for event in drift.latest(work.db, Event, Event.withdrawn_at, limit):
        yield _of_event(work, event, "event-withdrawn", event.withdrawn_at, event.withdrawn_by)
    rows = limit * len(PARAMETERS)
    for row in drift.latest(work.db, Baseline, Baseline.frozen_at, rows):
        yield _of_baseline(work, row, "baseline-frozen", row.frozen_at, row.frozen_by)
    for row in drift.latest(work.db, Baseline, Baseline.retired_at, rows):
        yield _of_baseline(work, row, "baseline-retired", row.retired_at, row.retired_by)
    for alarm in drift.latest(work.db, Alarm, Alarm.acknowledged_at, limit):
        gyro, stand = drift.subject_names(work.db, alarm.gyro_id, alarm.stand_id)
        yield Act(
            alarm.acknowledged_at or work.now, alarm.acknowledged_by or "", "alarm-acknowledged", alarm.kind,
            gyro, stand, alarm.parameter, alarm.note,
        )  # fmt: skip


def _of_event(work: Work, row: Event, kind: str, at: datetime | None, by: str | None) -> Act:
    gyro, stand = drift.subject_names(work.db, row.gyro_id, row.stand_id)
    return Act(at or work.now, by or "", kind, row.kind, gyro, stand, None, row.note)


def _of_baseline(work: Work, row: Baseline, kind: str, at: datetime | None, by: str | None) -> Act:
    gyro, _ = drift.subject_names(work.db, row.gyro_id, None)
    return Act(at or work.now, by or "", kind, "", gyro, None, row.parameter, row.reason)
