"""Planning a session: what positions will tell before anything is measured, and which are best."""

from typing import Any, Final, Literal

from fastapi import APIRouter, Request, Response

from app.errors import AppError
from app.exchange.json_values import dumps
from app.i18n import translate
from app.pages import plan_form, plan_view
from app.pages.base import Reader, TheLab, render
from app.pages.forms import Form
from app.pages.tables import Row, csv_answer
from app.services import gyros, plan_subjects, planning, stands
from app.services.lab import Lab, Person
from app.services.plan_question import Subject
from app.services.plan_views import Plan, as_json

router = APIRouter()

View = Literal["plan", "counts", "trade"]
_COLUMNS: Final = ("theta_deg", "psi_deg", "times", "duration_s", "certified")


@router.get("/stands/{name}/plan")
def page(request: Request, person: Reader, lab: TheLab, name: str, view: View = "plan") -> Response:
    """The question, and what it gives; one view is computed at a time."""
    form, shown, status = plan_form.form_of(request.query_params), {}, 200
    with lab.read(person) as work:
        stand, certificates = stands.stand(work, name), stands.certificates(work, name)
        known = plan_form.nominals(gyros.types(work), gyros.gyros(work, limit=1000).items)
    try:
        shown = _shown(request, _subject(lab, person, name, form), view)
    except AppError as error:
        form = form.with_problems(*(plan_form.at_field(item) for item in error.problems))
        status = error.status
    return render(
        request, "planning/page.html", status=status, stand=stand, form=form, view=view, nominals=known,
        certificates=[(item.number, item.number) for item in certificates], modes=plan_form.modes(),
        grids=plan_form.grids(), criteria=plan_form.criteria(), **(_NOTHING | shown),
    )  # fmt: skip


@router.get("/stands/{name}/plan.{kind}")
def exported(
    request: Request, person: Reader, lab: TheLab, name: str, kind: Literal["csv", "json"]
) -> Response:
    """The plan as a file: CSV lists the positions, JSON holds all of it."""
    subject = _subject(lab, person, name, plan_form.form_of(request.query_params))
    planned = planning.planned(subject)
    if kind == "csv":
        return csv_answer(_rows(planned.plan), _COLUMNS, f"plan-{name}")
    return Response(dumps(as_json(planned)), media_type="application/json")


def _subject(lab: Lab, person: Person, name: str, form: Form) -> Subject:
    with lab.read(person) as work:
        return plan_subjects.subject(work, name, plan_form.asked_of(form), **plan_form.subject_of(form))


_NOTHING: Final[dict[str, Any]] = {
    "subject": None,
    "plan": None,
    "counts": None,
    "trade": None,
    "chart": None,
}


def _shown(request: Request, subject: Subject, view: View) -> dict[str, Any]:
    """What the chosen view shows."""
    question = subject.question
    plan = planning.plan(question)
    shown: dict[str, Any] = {
        "subject": subject, "plan": plan, "rows": plan_view.parameter_rows(plan),
        "factors": plan_view.factors_text(plan), "warnings": [translate(item) for item in plan.warnings],
    }  # fmt: skip
    if view == "plan":
        rows = question.certificate if plan.search is None else question.candidates()
        shown["map"] = plan_view.plan_map(plan, ((row.theta_deg, row.psi_deg) for row in rows))
    elif view == "counts":
        shown["counts"] = plan_view.worth_rows(request, planning.counts(question))
    else:
        trade = planning.trade(question)
        shown |= {"trade": trade, "trade_rows": plan_view.trade_rows(request, trade)}
        shown["chart"] = plan_view.trade_chart(request, trade) if trade.front else None
    return shown


def _rows(plan: Plan) -> list[Row]:
    return [
        {"theta_deg": item.theta_deg, "psi_deg": item.psi_deg, "times": item.times,
         "duration_s": plan.duration_s, "certified": item.certified}
        for item in plan.positions
    ]  # fmt: skip
