"""Alarms: the quality manager's queue, one alarm with its answer, gyros that are due."""

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from typing import Annotated, Final, Literal

from fastapi import APIRouter, Depends, Query, Request, Response

from app.errors import AppError
from app.pages import drift_labels, drift_words
from app.pages.base import Reader, TheLab, Writer, local_path, render, see
from app.pages.forms import Form, Sent
from app.pages.tables import Row, csv_answer, json_answer, parquet_answer
from app.services import access
from app.services.drift import alarms, due
from app.services.drift.alarms import CAUSES
from app.services.drift.views import AlarmView
from app.services.lab import Lab, Person, Work

router = APIRouter()

STATES: Final = ("open", "acknowledged", "ended", "all")
"""Of alarms, as the page tells them apart: ended are those that nothing shows any more."""
_PER_PAGE: Final = 50
_MOST: Final = 5000
_DUE_SHOWN: Final = 12


@dataclass(frozen=True, slots=True)
class Selection:
    """Which alarms are wanted; empty for any."""

    state: str = "open"
    kind: str = ""
    gyro: str = ""
    stand: str = ""
    type_name: Annotated[str, Query(alias="type")] = ""
    method: str = ""


Selected = Annotated[Selection, Depends()]


@dataclass(frozen=True, slots=True)
class Queued:
    """An alarm with what its facets need: the gyro's type, the stand itself or the gyro's last one."""

    alarm: AlarmView
    type: str
    stand: str


_FACETS: Final[Mapping[str, Callable[[Queued], str]]] = {
    "kind": lambda item: item.alarm.kind,
    "stand": lambda item: item.stand,
    "type_name": lambda item: item.type,
    "method": lambda item: item.alarm.method,
}


@router.get("/alarms")
def listing(request: Request, person: Reader, lab: TheLab, wanted: Selected, start: int = 0) -> Response:
    """Alarms, the worst first; gyros that are due beside them."""
    with lab.read(person) as work:
        everything = _everything(work)
        urgent = due.urgent(work)
    found = _chosen(everything, wanted)
    start = max(0, start)
    return render(
        request, "alarms/list.html", found=found[start : start + _PER_PAGE], total=len(found), start=start,
        next_start=start + _PER_PAGE if start + _PER_PAGE < len(found) else None, wanted=wanted,
        states=_state_counts(everything, wanted), everything=len(everything),
        facets={name: _counts(everything, wanted, name) for name in _FACETS},
        urgent=urgent[:_DUE_SHOWN], urgent_total=len(urgent), judges=may_judge(person), now=datetime.now(UTC),
        drift=drift_labels, words=drift_words, causes=CAUSES,
    )  # fmt: skip


@router.get("/alarms.{form}")
def exported(
    person: Reader, lab: TheLab, form: Literal["csv", "json", "parquet"], wanted: Selected
) -> Response:
    """The same alarms as a file."""
    with lab.read(person) as work:
        rows = [_row(item) for item in _chosen(_everything(work), wanted)]
    if form == "json":
        return json_answer(rows)
    answer = csv_answer if form == "csv" else parquet_answer
    return answer(rows, _COLUMNS, "alarms")


@router.get("/alarms/{number}")
def one(request: Request, person: Reader, lab: TheLab, number: int) -> Response:
    """One alarm, and the form that answers it."""
    return _one(request, lab, person, number, Form({"cause": "", "note": ""}))


@router.post("/alarms/{number}/acknowledgement")
def acknowledge(request: Request, person: Writer, lab: TheLab, number: int, sent: Sent) -> Response:
    """Answer for an alarm with its cause."""
    form = Form.of(sent, "cause", "note")
    try:
        with lab.write(person) as work:
            alarms.acknowledge(work, number, form.value("cause"), form.value("note"))
    except AppError as error:
        return _one(request, lab, person, number, form.with_problems(*error.problems), error.status)
    wanted = sent.get("next")
    return see(local_path(wanted if isinstance(wanted, str) else None, f"/alarms/{number}"))


def may_judge(person: Person) -> bool:
    """Whether the person may acknowledge alarms and freeze baselines."""
    return "upload" in person.scopes and person.role in access.JUDGES


def _one(request: Request, lab: Lab, person: Person, number: int, form: Form, status: int = 200) -> Response:
    with lab.read(person) as work:
        item = _queued(alarms.alarm(work, number), {one.gyro: one for one in due.due_list(work)})
    return render(
        request, "alarms/one.html", status=status, alarm=item.alarm, stand=item.stand, form=form,
        judges=may_judge(person), now=datetime.now(UTC), drift=drift_labels, words=drift_words, causes=CAUSES,
    )  # fmt: skip


def _everything(work: Work) -> list[Queued]:
    known = {item.gyro: item for item in due.due_list(work)}
    return [_queued(alarm, known) for alarm in alarms.alarms(work, state=None, limit=_MOST)]


def _queued(alarm: AlarmView, known: Mapping[str, due.Due]) -> Queued:
    gyro = known.get(alarm.gyro) if alarm.gyro else None
    return Queued(alarm, gyro.type if gyro else "", alarm.stand or (gyro.stand if gyro else None) or "")


def _state(alarm: AlarmView) -> str:
    return alarm.state if alarm.state in ("open", "acknowledged") else "ended"


def _chosen(everything: Sequence[Queued], wanted: Selection) -> list[Queued]:
    return [
        item
        for item in everything
        if wanted.state in ("all", _state(item.alarm))
        and wanted.gyro in ("", item.alarm.gyro)
        and all(getattr(wanted, name) in ("", key(item)) for name, key in _FACETS.items())
    ]


def _state_counts(everything: Sequence[Queued], wanted: Selection) -> dict[str, int]:
    found = _chosen(everything, replace(wanted, state="all"))
    counts = Counter(_state(item.alarm) for item in found)
    return {state: len(found) if state == "all" else counts[state] for state in STATES}


def _counts(everything: Sequence[Queued], wanted: Selection, name: str) -> dict[str, int]:
    found = _chosen(everything, replace(wanted, **{name: ""}))
    return dict(Counter(key for key in map(_FACETS[name], found) if key).most_common())


_COLUMNS: Final = (
    "id", "state", "kind", "severity", "gyro", "type", "stand", "last_stand", "parameter", "method", "text", "session",
    "result", "since", "last_session", "until", "raised_at", "cause", "note", "acknowledged_by", "acknowledged_at",
)  # fmt: skip


def _row(item: Queued) -> Row:
    alarm = item.alarm
    return {
        "id": alarm.id, "state": alarm.state, "kind": alarm.kind, "severity": alarm.severity,
        "gyro": alarm.gyro, "type": item.type, "stand": alarm.stand, "last_stand": item.stand,
        "parameter": alarm.parameter, "method": alarm.method, "text": drift_words.alarm(alarm),
        "session": alarm.session, "result": alarm.calibration, "since": alarm.at,
        "last_session": alarm.last_session, "until": alarm.last_at, "raised_at": alarm.raised_at,
        "cause": alarm.cause, "note": alarm.note, "acknowledged_by": alarm.acknowledged_by,
        "acknowledged_at": alarm.acknowledged_at,
    }  # fmt: skip
