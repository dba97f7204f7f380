"""A type of gyro: the limits that its results are judged by, how long they hold, what its gyros should be."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Final

from fastapi import APIRouter, Request, Response

from app.errors import AppError, Invalid, NotFound, Problem, problem
from app.figures import entered
from app.pages import labels
from app.pages.alarms import may_judge
from app.pages.base import Reader, TheLab, Writer, render, see
from app.pages.forms import Fields, Form, Sent
from app.services import access, gyros
from app.services.lab import Lab, Person
from app.services.views import Nominal, TypeView
from solver.records import PARAMETERS

router = APIRouter()

LIMITS: Final = ("low", "high")
SPREAD: Final = "repeatability"
NOMINAL: Final = ("nominal", "u", "per_kelvin")
INTERVAL: Final = "interval_days"
"""Columns of the two tables; a field is one of them and a parameter with its unit: ``low_w0x_deg_per_h``."""

_Limits = Mapping[str, tuple[float, float]]
_Nominals = Mapping[str, Nominal]


@dataclass(frozen=True, slots=True)
class _Stated:
    """What the form says of a type."""

    limits: _Limits
    spread: Mapping[str, float]
    nominals: _Nominals
    interval_days: int | None


def _field(parameter: str, column: str) -> str:
    unit = "_per_k" if column == "per_kelvin" else ""
    return f"{'temperature' if unit else column}_{labels.field(parameter)}{unit}"


_FIELDS: Final = (
    INTERVAL,
    *(_field(name, column) for columns in ((*LIMITS, SPREAD), NOMINAL) for name in PARAMETERS for column in columns),
)  # fmt: skip


@router.get("/types/{name}")
def detail(request: Request, person: Reader, lab: TheLab, name: str) -> Response:
    """Limits and nominal values as they are, in a form for whoever may change them."""
    kind = _find(lab, person, name)
    rows = ((LIMITS, kind.limits), (NOMINAL, kind.nominals))
    values = {
        _field(parameter, column): entered(value)
        for columns, stated in rows
        for parameter, given in stated.items()
        for column, value in zip(columns, given, strict=True)
    }
    values |= {
        _field(parameter, SPREAD): entered(largest) for parameter, largest in kind.repeatability.items()
    }
    values[INTERVAL] = "" if kind.interval_days is None else str(kind.interval_days)
    return _shown(request, person, kind, Form(dict.fromkeys(_FIELDS, "") | values))


@router.post("/types/{name}")
def change(request: Request, person: Writer, lab: TheLab, name: str, sent: Sent) -> Response:
    """Enter limits and nominal values in place of those before."""
    kind = _find(lab, person, name)
    form = Form.of(sent, *_FIELDS)
    try:
        fields = Fields(form)
        stated = _Stated(_limits(fields), _spread(fields), _nominals(fields), _interval(fields, form))
        fields.check()
        _keep(lab, person, name, stated)
    except AppError as error:
        return _shown(request, person, kind, form.with_problems(*error.problems), error.status)
    return see("/gyros")


def _keep(lab: Lab, person: Person, name: str, stated: _Stated) -> None:
    """All or nothing: `Forbidden`, or `Invalid` with what is wrong with any of it."""
    with lab.write(person) as work:
        access.require_judge(work.person)  # limits judge every result, also those that were signed
        problems = [
            *_refused(
                lambda: gyros.set_limits(work, name, stated.limits, repeatability=stated.spread), LIMITS[0]
            ),
            *_refused(lambda: gyros.set_nominals(work, name, stated.nominals), NOMINAL[1]),
            *_refused(lambda: gyros.set_interval(work, name, stated.interval_days), INTERVAL),
        ]
        if problems:
            raise Invalid(*problems)


def _refused(act: Callable[[], None], column: str) -> list[Problem]:
    """What the service says about a parameter, beside this column of its table."""
    try:
        act()
    except Invalid as error:
        return [
            replace(item, column=_field(item.column, SPREAD if SPREAD in item.message.code else column))
            if item.column in PARAMETERS
            else item
            for item in error.problems
        ]
    return []


def _limits(fields: Fields) -> _Limits:
    found = {}
    for parameter in PARAMETERS:
        low, high = (fields.optional(_field(parameter, end), "") for end in LIMITS)
        if low is not None and high is not None:
            found[parameter] = (low, high)
        elif (low is None) != (high is None):
            fields.wrong(problem("half-limit", "Give both limits, or none.",
                                 column=_field(parameter, "low" if low is None else "high")))  # fmt: skip
    return found


def _spread(fields: Fields) -> Mapping[str, float]:
    given = {name: fields.optional(_field(name, SPREAD), "") for name in PARAMETERS}
    return {name: value for name, value in given.items() if value is not None}


def _interval(fields: Fields, form: Form) -> int | None:
    return fields.whole(INTERVAL) if form.value(INTERVAL).strip() else None


def _nominals(fields: Fields) -> _Nominals:
    found = {}
    for parameter in PARAMETERS:
        value, u, per_kelvin = (fields.optional(_field(parameter, column), "") for column in NOMINAL)
        if value is not None and u is not None:
            found[parameter] = Nominal(value, u, per_kelvin)
        elif (value, u, per_kelvin) != (None, None, None):
            lacking = "nominal" if value is None else "u"
            fields.wrong(problem("half-nominal", "Give the nominal value and its standard deviation, or neither.",
                                 column=_field(parameter, lacking)))  # fmt: skip
    return found


def _find(lab: Lab, person: Person, name: str) -> TypeView:
    with lab.read(person) as work:
        for kind in gyros.types(work):
            if kind.name == name:
                return kind
    raise NotFound(problem("unknown-type", "There is no type %(name)s.", name=name))


def _shown(request: Request, person: Person, kind: TypeView, form: Form, status: int = 200) -> Response:
    return render(
        request, "types/detail.html", status=status, kind=kind, form=form, unit_of=labels.PARAMETER_UNITS,
        limit_rows=[(name, [_field(name, column) for column in (*LIMITS, SPREAD)]) for name in PARAMETERS],
        nominal_rows=[(name, [_field(name, column) for column in NOMINAL]) for name in PARAMETERS],
        may_write=may_judge(person),
    )  # fmt: skip
