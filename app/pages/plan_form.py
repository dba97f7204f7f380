"""The question of a plan as it stands in the address, and the form that asks it."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Final

from app.errors import Problem
from app.exchange.planned import listed_positions
from app.figures import entered, plain
from app.i18n import gettext, marked
from app.pages import labels
from app.pages.forms import Fields, Form
from app.services.plan_question import Asked
from app.services.views import GyroView, TypeView
from solver.records import PARAMETERS

FIELDS: Final = (
    "certificate", "nominal", "time_min", "moving_s", "noise_deg_per_h", "floor_deg_per_h", "mode", "positions",
    "count", "grid_deg", "criterion", "repeats",
)  # fmt: skip
"""Names of the form's fields, in the order of the page."""

GRIDS: Final = (90.0, 45.0, 30.0)
PROPOSE: Final = "propose"
_MODES: Final = {"judge": marked("Judge these positions"), PROPOSE: marked("Propose the best positions")}
_CRITERIA: Final = {
    "D": marked("D: all at once"),
    "A": marked("A: mean square"),
}
_PLACES: Final = {"time_s": "time_min", "gyro": "nominal", "type": "nominal"}


def form_of(query: Mapping[str, str]) -> Form:
    """What the address says; what it leaves out has its usual value."""
    usual = Asked()
    values = {
        "certificate": "", "nominal": "", "time_min": entered(usual.time_s / 60), "moving_s": entered(usual.moving_s),
        "noise_deg_per_h": entered(usual.noise_deg_per_h), "floor_deg_per_h": "", "mode": "judge", "positions": "",
        "count": "8", "grid_deg": "", "criterion": usual.criterion, "repeats": "",
    }  # fmt: skip
    return Form({name: query.get(name, values[name])[:4000] for name in FIELDS})


def asked_of(form: Form) -> Asked:
    """The form's fields as a question.

    Raises
    ------
    Invalid
        With every field that cannot be read.
    """
    fields = Fields(form)
    proposing = form.value("mode") == PROPOSE
    asked = Asked(
        count=fields.whole("count") if proposing else None,
        grid_deg=fields.optional("grid_deg", "deg") if proposing else None,
        criterion=form.value("criterion"),
        repeats=form.value("repeats") == "yes",
        time_s=60.0 * fields.number("time_min", "min"),
        moving_s=fields.number("moving_s", "s"),
        noise_deg_per_h=fields.number("noise_deg_per_h", ""),
        floor_deg_per_h=fields.optional("floor_deg_per_h", "") or 0.0,
    )
    fields.check()
    text = form.value("positions")
    listed = listed_positions(text, "positions") if text.strip() and not proposing else ()
    return replace(asked, positions=listed)


def subject_of(form: Form) -> dict[str, str | None]:
    """Certificate, and gyro or type, as `app.services.plan_subjects.subject` takes them."""
    kind, _, name = form.value("nominal").partition(":")
    return {
        "certificate": form.value("certificate") or None,
        "gyro": name if kind == "gyro" else None,
        "type_name": name if kind == "type" else None,
    }


def at_field(item: Problem) -> Problem:
    """A problem of a service as that of the form's field."""
    return replace(item, column=_PLACES.get(item.column or "", item.column))


def modes() -> list[tuple[str, str]]:
    """What may be asked."""
    return [(name, gettext(text)) for name, text in _MODES.items()]


def grids() -> list[tuple[str, str]]:
    """Where positions are chosen from."""
    steps = [(entered(step), gettext("the grid of %(step)s°") % {"step": plain(step)}) for step in GRIDS]
    return [("", gettext("the certificate")), *steps]


def criteria() -> list[tuple[str, str]]:
    """What is best."""
    each = [
        (name, gettext("smallest u(%(name)s)") % {"name": labels.symbol_text(name)}) for name in PARAMETERS
    ]
    return [*((name, gettext(text)) for name, text in _CRITERIA.items()), *each]


def nominals(types: Sequence[TypeView], gyros: Sequence[GyroView]) -> list[tuple[str, str]]:
    """Whose nominal values are taken: types first, then single gyros."""
    return [
        ("", gettext("the paper’s gyro")),
        *((f"type:{kind.name}", gettext("type %(type)s") % {"type": kind.name}) for kind in types),
        *((f"gyro:{item.serial}", gettext("gyro %(gyro)s") % {"gyro": item.serial}) for item in gyros),
    ]
