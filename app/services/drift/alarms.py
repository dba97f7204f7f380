"""Alarms: raised once for each episode, kept up while it goes on, acknowledged by a person with a cause.

A study gives its findings anew each time; `take_in` lays them against the alarms that are there. A finding
belongs to an alarm of its parameter and kind whose episode meets it in time, and then moves the alarm's end on; what
is true of the whole course, such as a trend, belongs to the open one. What nothing shows any more ends: as replaced
when the result that raised it counts no more, otherwise as lapsed. Only a person ends an alarm for which an event
was entered afterwards: whoever may enter events does not judge. An alarm that a person acknowledged is never changed
but for its end.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from typing import Any, Final

from app.errors import Conflict, Invalid, NotFound, problem
from app.exchange.si import PARAMETER_UNITS
from app.services import access
from app.services.drift.events import BREAKING
from app.services.drift.views import AlarmView
from app.services.lab import Work
from app.store import drift
from app.store.tables import Alarm, DriftStudy

CAUSES: Final = ("gyro", "stand", "certificate", "operator", "environment", "repair", "false-alarm", "other")
"""What a person may give as the cause."""
SEVERITIES: Final = ("serious", "warning", "notice")
_SERIOUS: Final = frozenset({"out-of-limits", "step", "beyond-limits"})
_WARNING: Final = frozenset({"limit-ahead", "trend", "ewma", "cusum", "repeatability"})
_LASTING: Final = frozenset({"limit-ahead", "trend", "repeatability"})
"""Kinds that are said of the whole course: one of each is open at a time."""
_LONGEST: Final = 4000


@dataclass(frozen=True, slots=True)
class Finding:
    """What a study found that a person has to know; plain, so that it comes from a child process.

    Attributes
    ----------
    parameter
        None for a stand.
    kind
        As `Alarm.kind`.
    calibration, last_calibration
        The first and the last result that show it.
    since, until
        The time of its episode, ISO 8601 in UTC; of a step the sessions that it may have happened before.
    baseline
        What it was judged against; None when against nothing frozen.
    template, values
        Its sentence.
    explained
        An event that is known explains it: it raises no alarm, but one that stands goes on.
    """

    parameter: str | None
    kind: str
    calibration: int
    last_calibration: int
    since: str
    until: str
    template: str
    values: Mapping[str, Any]
    baseline: int | None = None
    explained: bool = False


def severity(kind: str) -> str:
    """How bad a kind of alarm is; run rules, which see patterns within the limits, are notices."""
    if kind in _SERIOUS or kind.startswith("stand-"):
        return "serious"
    return "warning" if kind in _WARNING else "notice"


def take_in(work: Work, study: DriftStudy, findings: Sequence[Finding], counting: Iterable[int]) -> None:
    """Raise, keep up and end a subject's alarms by what its study found.

    Parameters
    ----------
    counting
        Ids of the results that count.
    """
    known = list(drift.alarms_of(work.db, study.gyro_id, study.stand_id, study.method))
    times = drift.measured_at(
        work.db, {row.calibration_id for row in known} | {row.last_calibration_id for row in known}
    )
    shown: set[int] = set()
    for finding in sorted(findings, key=lambda item: item.since):
        same = [row for row in known if _is_same(row, finding, times)]
        alarm = next((row for row in same if row.state == "open"), same[0] if same else None)
        if alarm is None and finding.explained:
            continue
        if alarm is None:
            alarm = _raise(work, study, finding)
            known.append(alarm)
            times |= {
                finding.calibration: datetime.fromisoformat(finding.since),
                finding.last_calibration: datetime.fromisoformat(finding.until),
            }
        elif alarm.state == "open":
            alarm.template, alarm.values = finding.template, dict(finding.values)
            alarm.baseline_id = finding.baseline
        if times[alarm.last_calibration_id] <= datetime.fromisoformat(finding.until):
            alarm.last_calibration_id = finding.last_calibration
            times[finding.last_calibration] = datetime.fromisoformat(finding.until)
        shown.add(alarm.id)
    unshown = [row for row in known if row.id not in shown and row.state == "open"]
    _end(work, unshown, frozenset(counting), _entered(work, study))


def _is_same(alarm: Alarm, finding: Finding, times: Mapping[int, datetime]) -> bool:
    if (alarm.parameter, alarm.kind) != (finding.parameter, finding.kind):
        return False
    if alarm.state == "open" and alarm.kind in _LASTING:
        return True
    since, until = datetime.fromisoformat(finding.since), datetime.fromisoformat(finding.until)
    return alarm.state in ("open", "acknowledged") and (
        times[alarm.calibration_id] <= until and since <= times[alarm.last_calibration_id]
    )


def _raise(work: Work, study: DriftStudy, finding: Finding) -> Alarm:
    row = Alarm(
        gyro_id=study.gyro_id, stand_id=study.stand_id, parameter=finding.parameter, method=study.method,
        kind=finding.kind, severity=severity(finding.kind), baseline_id=finding.baseline,
        calibration_id=finding.calibration, last_calibration_id=finding.last_calibration,
        template=finding.template, values=dict(finding.values), raised_at=work.now, state="open", note="",
    )  # fmt: skip
    work.db.add(row)
    work.db.flush()
    return row


def _entered(work: Work, study: DriftStudy) -> datetime | None:
    """When the last event was entered that may explain something of the subject."""
    stands = (
        [study.stand_id]
        if study.stand_id is not None
        else [stand.id for stand in drift.stands_of(work.db, study.gyro_id or 0)]
    )
    found = drift.events(work.db, study.gyro_id, stands)
    return max((event.created_at for event in found if event.kind in BREAKING), default=None)


def _end(work: Work, rows: Sequence[Alarm], counting: frozenset[int], entered: datetime | None) -> None:
    for row in rows:
        counts = row.calibration_id in counting
        if counts and entered is not None and entered > row.raised_at:
            continue
        row.state = "lapsed" if counts else "replaced"
        row.ended_at = work.now


def acknowledge(work: Work, alarm_id: int, cause: str, note: str = "") -> AlarmView:
    """Answer for an alarm: what caused it, in the person's judgement.

    Raises
    ------
    Forbidden
        The person's role does not judge.
    NotFound
        There is none of that number.
    Conflict
        It is not open any more.
    Invalid
        An unknown cause, no note to the cause “other”, a note that is too long.
    """
    access.require_judge(work.person)
    row = drift.alarm(work.db, alarm_id)
    if row is None:
        raise NotFound(problem("unknown-alarm", "There is no alarm %(number)d.", number=alarm_id))
    if row.state != "open":
        raise Conflict(problem("alarm-ended", "This alarm is not open any more."))
    _check(cause, note)
    row.state, row.cause, row.note = "acknowledged", cause, note.strip()
    row.acknowledged_at, row.acknowledged_by, row.ended_at = work.now, work.person.name, work.now
    work.db.flush()
    return alarm(work, alarm_id)


def _check(cause: str, note: str) -> None:
    if cause not in CAUSES:
        raise Invalid(problem("unknown-cause", "There is no cause “%(cause)s”. Choose one of %(causes)s.",
                              column="cause", cause=cause, causes=", ".join(CAUSES)))  # fmt: skip
    if cause == "other" and not note.strip():
        raise Invalid(problem("cause-unsaid", "Say in the note what the cause was.", column="note"))
    if len(note) > _LONGEST:
        raise Invalid(problem("note-too-long", "A note has at most %(most)d characters.", column="note",
                              most=_LONGEST))  # fmt: skip


def alarm(work: Work, alarm_id: int) -> AlarmView:
    """One alarm."""
    found = drift.alarm_rows(work.db, alarm_id=alarm_id)
    if not found:
        raise NotFound(problem("unknown-alarm", "There is no alarm %(number)d.", number=alarm_id))
    return _view(found[0])


def alarms(
    work: Work,
    *,
    gyro: str | None = None,
    stand: str | None = None,
    kind: str | None = None,
    state: str | None = "open",
    method: str | None = None,
    start: int = 0,
    limit: int = 200,
) -> tuple[AlarmView, ...]:
    """Alarms, the worst first, of those equally bad the one raised last."""
    rows = drift.alarm_rows(
        work.db, gyro=gyro, stand=stand, kind=kind, state=state, method=method, start=start, limit=limit
    )
    return tuple(_view(row) for row in rows)


def counts(work: Work) -> Mapping[str, int]:
    """How many open alarms there are of each severity."""
    return drift.alarm_counts(work.db)


def _view(row: drift.AlarmRow) -> AlarmView:
    alarm = row.alarm
    return AlarmView(
        id=alarm.id, gyro=alarm.gyro.serial if alarm.gyro else None,
        stand=alarm.stand.name if alarm.stand else None, parameter=alarm.parameter,
        unit=PARAMETER_UNITS[alarm.parameter][0] if alarm.parameter else None, method=alarm.method,
        kind=alarm.kind, severity=alarm.severity, baseline=alarm.baseline_id,
        calibration=alarm.calibration_id, session=row.session, at=row.at,
        last_calibration=alarm.last_calibration_id, last_session=row.last_session, last_at=row.last_at,
        template=alarm.template, values=alarm.values, raised_at=alarm.raised_at, state=alarm.state,
        ended_at=alarm.ended_at, acknowledged_at=alarm.acknowledged_at,
        acknowledged_by=alarm.acknowledged_by, cause=alarm.cause, note=alarm.note,
    )  # fmt: skip
