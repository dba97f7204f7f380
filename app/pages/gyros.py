"""Gyros: the list by status and type, a new one, its type and note."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from typing import Annotated, Any, Final, Literal

from fastapi import APIRouter, Depends, Query, Request, Response

from app.errors import AppError
from app.pages import drift_labels, labels
from app.pages.base import Reader, TheLab, Writer, render, see
from app.pages.forms import Fields, Form, Sent
from app.pages.sparkline import Sparkline, sparkline
from app.pages.tables import Row, csv_answer, json_answer
from app.services import gyros, history
from app.services.drift import alarms, due
from app.services.drift.due import Due
from app.services.drift.views import AlarmView
from app.services.lab import Work
from app.services.views import GyroView
from solver.records import PARAMETERS

router = APIRouter()

STATUSES: Final = ("fails", "undetermined", "conditional", "no-limit", "conforms", "none")
"""Of a gyro by its latest result, the worst first."""

_ALARM_AS: Final = {name: STATUSES.index(like) for name, like in (
    ("serious", "fails"), ("warning", "conditional"), ("notice", "conditional"),
)}  # fmt: skip
_DUE_AS: Final = {"overdue": STATUSES.index("undetermined"), "due-soon": STATUSES.index("conditional")}
"""As how bad a verdict an open alarm and a day due are counted."""
_MOST_ALARMS: Final = 5000
_PER_PAGE: Final = 50
_BATCH: Final = 500
_Key = Callable[[GyroView], Any]


def _drift(name: str) -> _Key:
    def key(gyro: GyroView) -> float:
        value = gyro.last_result.parameters[name].value if gyro.last_result else None
        return float("-inf") if value is None else value

    return key


_SORTS: Final[dict[str, _Key]] = {
    "serial": lambda gyro: gyro.serial,
    "w0x": _drift("w0x"),
    "w0y": _drift("w0y"),
    "date": lambda gyro: gyro.last_measured_at or datetime.min.replace(tzinfo=UTC),
}


@dataclass(frozen=True, slots=True)
class Needs:
    """What is to be done with the gyros: their open alarms, the worst first, and when each is due."""

    alarms: Mapping[str | None, Sequence[AlarmView]]
    due: Mapping[str, Due]

    def rank(self, gyro: GyroView) -> tuple[int, int]:
        """For the order by status, the most urgent highest: by verdict, alarm and day due; then by verdict alone."""
        verdict = STATUSES.index(labels.result_status(gyro.last_result))
        worst = self.alarms[gyro.serial][0].severity if gyro.serial in self.alarms else ""
        state = self.due[gyro.serial].state
        return -min(verdict, _ALARM_AS.get(worst, verdict), _DUE_AS.get(state, verdict)), -verdict


@dataclass(frozen=True, slots=True)
class Selection:
    """Which gyros are wanted: part of number or type, one type, one status; empty for any."""

    text: Annotated[str, Query(alias="q")] = ""
    kind: Annotated[str, Query(alias="type")] = ""
    status: str = ""


Selected = Annotated[Selection, Depends()]


@router.get("/gyros")
def listing(
    request: Request, person: Reader, lab: TheLab, wanted: Selected, sort: str = "-status", start: int = 0
) -> Response:
    """The gyros, those first with which something is to be done."""
    with lab.read(person) as work:
        everything = tuple(_all(work))
        needs = _needs(work)
        found = _ordered(_chosen(everything, wanted), sort, needs)
        start = max(0, start)
        shown = found[start : start + _PER_PAGE]
        drifts = {gyro.serial: _year(work, gyro.serial) for gyro in shown if gyro.last_result}
        kinds = gyros.types(work)
    return render(
        request, "gyros/list.html", gyros=shown, total=len(found), start=start, drifts=drifts, kinds=kinds,
        due_on=needs.due, alarms_of=needs.alarms, alarm_mark=drift_labels.alarm,
        everything=len(everything), sort=sort if sort.removeprefix("-") in (*_SORTS, "status") else "-status",
        wanted=wanted,
        type_counts=_counts(_chosen(everything, replace(wanted, kind="")), lambda gyro: gyro.type),
        status_counts=_counts(
            _chosen(everything, replace(wanted, status="")), lambda gyro: labels.result_status(gyro.last_result)
        ),
        statuses=STATUSES, next_start=start + _PER_PAGE if start + _PER_PAGE < len(found) else None,
    )  # fmt: skip


@router.get("/gyros.{form}")
def exported(
    person: Reader, lab: TheLab, form: Literal["csv", "json"], wanted: Selected, sort: str = "serial"
) -> Response:
    """The same list as a file."""
    with lab.read(person) as work:
        needs = _needs(work)
        found = _ordered(_chosen(tuple(_all(work)), wanted), sort, needs)
        rows = [_row(gyro, needs.due[gyro.serial]) for gyro in found]
    return json_answer(rows) if form == "json" else csv_answer(rows, _COLUMNS, "gyros")


@router.get("/gyros/new")
def new(request: Request, person: Writer, lab: TheLab) -> Response:
    """Ask for serial number and type."""
    return _form(request, lab, person, Form())


@router.post("/gyros/new")
def add(request: Request, person: Writer, lab: TheLab, sent: Sent) -> Response:
    """Register a gyro."""
    form = Form.of(sent, "serial", "type", "note", "check")
    try:
        fields = Fields(form)
        serial, kind, note = fields.text("serial", 60), fields.text("type", 60), fields.text("note")
        fields.check()
        with lab.write(person) as work:
            made = gyros.add_gyro(work, serial, kind, note, check=bool(form.value("check")))
    except AppError as error:
        return _form(request, lab, person, form.with_problems(*error.problems), error.status)
    return see(f"/gyros/{made.serial}")


@router.get("/gyros/{serial}/edit")
def edit(request: Request, person: Writer, lab: TheLab, serial: str) -> Response:
    """Ask for another type or note, and whether it is a check gyro."""
    with lab.read(person) as work:
        known = gyros.gyro(work, serial)
    said = {"type": known.type, "note": known.note, "check": "1" if known.check else ""}
    return _form(request, lab, person, Form(said), gyro=known)


@router.post("/gyros/{serial}/edit")
def change(request: Request, person: Writer, lab: TheLab, serial: str, sent: Sent) -> Response:
    """Correct a gyro's type or note, or make it a check gyro."""
    form = Form.of(sent, "type", "note", "check")
    with lab.read(person) as work:
        known = gyros.gyro(work, serial)
    try:
        fields = Fields(form)
        kind, note = fields.text("type", 60), fields.text("note")
        fields.check()
        with lab.write(person) as work:
            gyros.change_gyro(work, serial, type_name=kind, note=note, check=bool(form.value("check")))
    except AppError as error:
        shown = form.with_problems(*error.problems)
        return _form(request, lab, person, shown, error.status, gyro=known)
    return see(f"/gyros/{serial}")


def _form(
    request: Request, lab: TheLab, person: Reader, form: Form, status: int = 200, gyro: GyroView | None = None
) -> Response:
    with lab.read(person) as work:
        kinds = gyros.types(work)
    return render(request, "gyros/form.html", status=status, form=form, kinds=kinds, gyro=gyro)


def _all(work: Work) -> Iterator[GyroView]:
    after = None
    while True:
        part = gyros.gyros(work, after=after, limit=_BATCH)
        yield from part.items
        if (after := part.next) is None:
            return


def _chosen(found: Sequence[GyroView], wanted: Selection) -> list[GyroView]:
    text = wanted.text.strip().casefold()
    return [
        gyro
        for gyro in found
        if (text in gyro.serial.casefold() or text in gyro.type.casefold())
        and wanted.kind in ("", gyro.type)
        and wanted.status in ("", labels.result_status(gyro.last_result))
    ]


def _needs(work: Work) -> Needs:
    by_gyro: dict[str | None, list[AlarmView]] = {}
    for alarm in alarms.alarms(work, limit=_MOST_ALARMS):
        by_gyro.setdefault(alarm.gyro, []).append(alarm)
    return Needs(by_gyro, {item.gyro: item for item in due.due_list(work)})


def _ordered(found: list[GyroView], sort: str, needs: Needs) -> list[GyroView]:
    key = _SORTS.get(sort.removeprefix("-"), needs.rank)
    return sorted(sorted(found, key=_SORTS["serial"]), key=key, reverse=sort.startswith("-"))


def _counts(found: Sequence[GyroView], key: Callable[[GyroView], str]) -> dict[str, int]:
    counts: dict[str, int] = {}
    for gyro in found:
        counts[key(gyro)] = counts.get(key(gyro), 0) + 1
    return counts


def _year(work: Work, serial: str) -> Sparkline | None:
    series = history.history(work, serial, parameter="w0y")[0]
    return sparkline(series)


_COLUMNS: Final = (
    "serial", "type", "status", "note", "last_session", "last_measured_at", "last_stand", "due", "due_state",
    *(f"{labels.field(name)}{end}" for name in PARAMETERS for end in ("", "_u")),
)  # fmt: skip


def _row(gyro: GyroView, holds: Due) -> Row:
    row: Row = {
        "serial": gyro.serial, "type": gyro.type, "status": labels.result_status(gyro.last_result),
        "note": gyro.note, "last_session": gyro.last_session, "last_measured_at": gyro.last_measured_at,
        "last_stand": gyro.last_stand, "due": holds.due, "due_state": holds.state,
    }  # fmt: skip
    for name in PARAMETERS:
        view = gyro.last_result.parameters.get(name) if gyro.last_result else None
        row[labels.field(name)] = view.value if view else None
        row[f"{labels.field(name)}_u"] = view.u if view else None
    return row
