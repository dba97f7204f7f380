"""Limits of a type of gyro: what its results are judged by."""

from dataclasses import replace
from typing import Final

from fastapi import APIRouter, Request, Response

from app.errors import AppError, NotFound, Problem, problem
from app.figures import entered
from app.pages import labels
from app.pages.base import Reader, TheLab, Writer, render, see
from app.pages.forms import Fields, Form, Sent
from app.services import gyros
from app.services.lab import Lab, Person
from app.services.views import TypeView
from solver.records import PARAMETERS

router = APIRouter()


def _field(parameter: str, end: str) -> str:
    return f"{end}_{labels.field(parameter)}"


_FIELDS: Final = tuple(_field(name, end) for name in PARAMETERS for end in ("low", "high"))


@router.get("/types/{name}")
def limits(request: Request, person: Reader, lab: TheLab, name: str) -> Response:
    """The limits as they are, in a form for whoever may change them."""
    kind = _find(lab, person, name)
    values = {
        _field(parameter, end): entered(value)
        for parameter, pair in kind.limits.items()
        for end, value in zip(("low", "high"), pair, strict=True)
    }
    return _shown(request, kind, Form(dict.fromkeys(_FIELDS, "") | values))


@router.post("/types/{name}")
def change(request: Request, person: Writer, lab: TheLab, name: str, sent: Sent) -> Response:
    """Enter limits in place of those before."""
    kind = _find(lab, person, name)
    form = Form.of(sent, *_FIELDS)
    try:
        entered_limits = _read(form)
        with lab.write(person) as work:
            gyros.set_limits(work, name, entered_limits)
    except AppError as error:
        problems = [_beside_field(item) for item in error.problems]
        return _shown(request, kind, form.with_problems(*problems), error.status)
    return see("/gyros")


def _read(form: Form) -> dict[str, tuple[float, float]]:
    fields = Fields(form)
    found = {}
    for parameter in PARAMETERS:
        low, high = (fields.optional(_field(parameter, end), "") for end in ("low", "high"))
        if low is not None and high is not None:
            found[parameter] = (low, high)
        elif (low is None) != (high is None):
            fields.wrong(problem("half-limit", "Give both limits, or none.",
                                 column=_field(parameter, "low" if low is None else "high")))  # fmt: skip
    fields.check()
    return found


def _beside_field(item: Problem) -> Problem:
    """What the service says about a parameter stands beside its lower limit."""
    return replace(item, column=_field(item.column, "low")) if item.column in PARAMETERS else item


def _find(lab: Lab, person: Person, name: str) -> TypeView:
    with lab.read(person) as work:
        for kind in gyros.types(work):
            if kind.name == name:
                return kind
    raise NotFound(problem("unknown-type", "There is no type %(name)s.", name=name))


def _shown(request: Request, kind: TypeView, form: Form, status: int = 200) -> Response:
    return render(
        request, "types/limits.html", status=status, kind=kind, form=form, unit_of=labels.PARAMETER_UNITS,
        rows=[(name, _field(name, "low"), _field(name, "high")) for name in PARAMETERS],
    )  # fmt: skip
