"""The loop that is asked for as it stands in the address, and the form that asks."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Final

from app.figures import entered
from app.i18n import MINUS, gettext, localised, marked
from app.pages.forms import Fields, Form
from app.services.loop import MEMBERS, problems_of
from app.services.views import TypeView
from simdevice.dynamics import GVK_6, GVK_6_AS_PRINTED, LoopParameters

DURATION: Final = "duration_s"
_STARTS: Final = {
    "printed": (marked("with T1 as printed"), GVK_6_AS_PRINTED),
    "proportional": (marked("proportional only"), replace(GVK_6, integral_time=math.inf, lag_time=0.0)),
}
"""Loops of the paper's gyro to start from, beside its own."""
_INFINITE: Final = ("∞", "inf")
_LONGEST: Final = 100


def form_of(query: Mapping[str, str], usual: LoopParameters) -> Form:
    """What the address says; an empty or missing parameter is that of the loop it starts from."""
    values = {name: query.get(name, "").strip()[:_LONGEST] for name in MEMBERS}
    shown = {name: text or written(getattr(usual, MEMBERS[name])) for name, text in values.items()}
    return Form(shown | {DURATION: query.get(DURATION, "").strip()[:_LONGEST]})


def start_of(query: Mapping[str, str]) -> tuple[str, str | None]:
    """Which loop the form starts from, as its link says, and the type's name where it is a type."""
    start = query.get("start", "")
    kind, _, name = start.partition(":")
    return start, name if kind == "type" else None


def started(loop: LoopParameters, start: str) -> LoopParameters:
    """The usual loop, or another of the paper's gyro."""
    return _STARTS[start][1] if start in _STARTS else loop


def starts(types: Sequence[TypeView]) -> list[tuple[str, str]]:
    """Loops to start from: value of the address, and in words."""
    return [
        ("", gettext("the paper’s gyro")),
        *((name, gettext(text)) for name, (text, _) in _STARTS.items()),
        *((f"type:{kind.name}", gettext("type %(type)s") % {"type": kind.name}) for kind in types),
    ]


def given(form: Form) -> tuple[dict[str, float], float | None]:
    """Parameters by field, and the length of the step response.

    Raises
    ------
    Invalid
        With every field that cannot be read, or holds what no gyro's loop has.
    """
    fields = Fields(form)
    parameters = {
        name: math.inf
        if name == "t1_s" and form.value(name).lower() in _INFINITE
        else fields.number(name, "")
        for name in MEMBERS
    }
    duration = fields.optional(DURATION, "")
    read = {name: value for name, value in parameters.items() if not math.isnan(value)}
    fields.wrong(*problems_of(read, None if duration is None or math.isnan(duration) else duration))
    fields.check()
    return parameters, duration


def written(value: float) -> str:
    """A parameter for its field, small and large ones with their power of ten: ``5e-7``."""
    if math.isinf(value):
        return _INFINITE[0]
    if value == 0 or 1e-4 <= abs(value) < 1e6:
        return entered(value)
    mantissa, _, exponent = repr(float(f"{value:.15g}")).partition("e")
    if not exponent:
        mantissa, _, exponent = f"{value:.15e}".partition("e")
        mantissa = mantissa.rstrip("0").rstrip(".")
    return f"{localised(mantissa)}e{int(exponent)}".replace("-", MINUS)
