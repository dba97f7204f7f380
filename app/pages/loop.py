"""The rebalance loop: choose its parameters, see whether it is stable and how it answers."""

from dataclasses import dataclass

from fastapi import APIRouter, Request, Response

from app.errors import AppError
from app.exchange.json_values import dumps
from app.pages import loop_form
from app.pages.base import Reader, TheLab, render
from app.pages.forms import Form
from app.pages.loop_view import loop_view
from app.pages.tables import csv_answer
from app.services import gyros, loop
from app.services.lab import Lab, Person
from app.services.loop_documents import COLUMNS, Table, as_json, rows
from simdevice.dynamics import GVK_6

router = APIRouter()


@dataclass(frozen=True, slots=True)
class _Question:
    start: str
    starts: list[tuple[str, str]]
    form: Form

    def answered(self) -> loop.LoopAnswer:
        """Raise `Invalid` with what is wrong with the form."""
        given, duration = loop_form.given(self.form)
        return loop.answer(loop.changed(GVK_6, given), duration)


@router.get("/loop")
def page(request: Request, person: Reader, lab: TheLab) -> Response:
    """The loop and everything about it."""
    asked, shown, status = _question(request, lab, person), None, 200
    form = asked.form
    try:
        shown = loop_view(asked.answered())
    except AppError as error:
        form, status = form.with_problems(*error.problems), error.status
    return render(
        request, "loop/page.html", status=status, form=form, starts=asked.starts, start=asked.start, shown=shown,
    )  # fmt: skip


@router.get("/loop.json")
def document(request: Request, person: Reader, lab: TheLab) -> Response:
    """All of it for a program."""
    found = _question(request, lab, person).answered()
    return Response(dumps(as_json(found)), media_type="application/json")


@router.get("/loop/{table}.csv")
def exported(request: Request, person: Reader, lab: TheLab, table: Table) -> Response:
    """One table as a file: poles, step response or frequency response."""
    found = _question(request, lab, person).answered()
    return csv_answer([dict(row) for row in rows(found, table)], COLUMNS[table], f"loop-{table}")


def _question(request: Request, lab: Lab, person: Person) -> _Question:
    start, type_name = loop_form.start_of(request.query_params)
    with lab.read(person) as work:
        usual = loop_form.started(loop.usual(work, type_name), start)
        starts = loop_form.starts(gyros.types(work))
    return _Question(start, starts, loop_form.form_of(request.query_params, usual))
