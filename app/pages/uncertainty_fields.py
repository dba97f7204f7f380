"""A stand's statement of uncertainty as a form and as a summary: fields ↔ keys of `app.exchange.uncertainties`.

The form shows what a laboratory usually states. Whatever else stands in a statement (further correlations,
temperature coefficients, the angles' common part) is left as it is by `merged` and listed by `further`.
"""

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from decimal import Decimal
from typing import Any, Final

from app.errors import Invalid, Problem, problem
from app.exchange.numbers import SIZES, typed
from app.exchange.uncertainties import UNCERTAINTY_KEYS, Statement
from app.figures import entered
from app.i18n import gettext, localised, marked
from app.pages import labels
from app.pages.forms import Fields, Form, negative
from solver.records import PARAMETERS

GAINS: Final = ("gain_x", "gain_y")
CORRELATION: Final = "correlation_gain_x_gain_y"
"""Field of the correlation coefficient of the two channels' gains."""

_OFFSETS: Final = ("offset_x", "offset_y")
_WITH_UNIT = re.compile(r"(?P<number>.*?\d[.,]?)\s*(?P<unit>[^\W\d_]+)")
_CURRENTS: Final = {"на": "na", "мка": "ua", "ма": "ma", "а": "a"}
_LARGEST_IN_NA: Final = 1e-2
"""mA; a larger offset reads better in mA."""


@dataclass(frozen=True, slots=True)
class Row:
    """One line of the form: an input, its field, its key in the statement, its unit, and what to say of it."""

    name: str
    field: str
    key: str
    unit: str
    hint: str

    @property
    def dof(self) -> str:
        """Field of its degrees of freedom."""
        return f"dof_{self.name}"


_KEYS: Final = {name: key for key, (name, _) in UNCERTAINTY_KEYS.items()}
_UNITS: Final = {"ppm": "ppm", "arcsec": "arcsec", "ma": "nA", "k": "K"}


def _row(name: str, hint: str) -> Row:
    key = _KEYS[name]
    field = f"u_{name}_na" if name in _OFFSETS else key
    return Row(name, field, key, _UNITS[key.rsplit("_", 1)[1]], hint)


GROUPS: Final[tuple[tuple[str, tuple[Row, ...]], ...]] = (
    (
        marked("Ammeter"),
        (
            _row("gain_x", marked("Relative error of the scale of channel x. Calibration certificate of the ammeter.")),
            _row("gain_y", marked("The same of channel y.")),
            _row("offset_x", marked("What channel x shows at no current. Zero check, or the certificate. "
                                    "In nA; another unit may follow the number: 0.002 mA.")),
            _row("offset_y", marked("The same of channel y.")),
        ),
    ),
    (
        marked("Base of the stand"),
        (
            _row("level_1", marked("Tilt about the axis that points east. Level or autocollimator, as it was set up.")),
            _row("level_2", marked("Tilt about the axis that points north.")),
            _row("azimuth", marked("Turn away from true north. Gyrotheodolite or astronomical bearing.")),
        ),
    ),
    (
        marked("Place"),
        (
            _row("latitude", marked("Of the pier. Survey, map or satellite receiver: 1″ is 31 m on the ground.")),
            _row("gravity", marked("Local gravity against what counts as 1 g. Gravimetric map, or the formula.")),
        ),
    ),
    (
        marked("Session"),
        (
            _row("temperature", marked("Gyro’s temperature against that of its stated parameters. It counts through "
                                       "their temperature coefficients.")),
        ),
    ),
)  # fmt: skip
"""The form, group by group; names and hints are to be translated where they are shown."""

ROWS: Final = tuple(row for _, rows in GROUPS for row in rows)
FIELDS: Final = (*(field for row in ROWS for field in (row.field, row.dof)), CORRELATION)

_NAMES: Final = {
    "gain_x": marked("Gain, channel x"), "gain_y": marked("Gain, channel y"),
    "offset_x": marked("Offset, channel x"), "offset_y": marked("Offset, channel y"),
    "alpha": marked("α, common part"), "beta": marked("β, common part"), "gamma": marked("γ, common part"),
    "level_1": marked("Level about east"), "level_2": marked("Level about north"),
    "azimuth": marked("Azimuth"), "latitude": marked("Latitude"), "gravity": marked("Gravity"),
    "temperature": marked("Temperature"),
}  # fmt: skip


@dataclass(frozen=True, slots=True)
class Line:
    """One thing stated, in words: what, how much, in which unit, with how many degrees of freedom."""

    name: str
    value: str
    unit: str = ""
    dof: str = ""


def name_of(name: str) -> str:
    """An input in words."""
    return gettext(_NAMES[name])


def form_of(statement: Statement) -> Form:
    """The form with what is stated."""
    values = dict.fromkeys(FIELDS, "")
    for row in ROWS:
        value = statement.get(row.key)
        if value is not None:
            values[row.field] = _offset_entered(value) if row.name in _OFFSETS else entered(value)
        values[row.dof] = entered(_dof(statement).get(row.name))
    values[CORRELATION] = entered(_gain_correlation(statement))
    return Form(values)


def read(form: Form) -> dict[str, Any]:
    """What was typed, as a statement of the fields shown; `Invalid` with every field that is wrong."""
    fields = Fields(form)
    statement: dict[str, Any] = {}
    dof: dict[str, float] = {}
    for row in ROWS:
        value = _offset(form, fields, row) if row.name in _OFFSETS else fields.not_negative(row.field)
        freedom = fields.optional(row.dof, "")
        if value is not None:
            statement[row.key] = value
        if freedom is not None:
            dof[row.name] = freedom
        fields.wrong(*_complaints(row, form, freedom))
    correlation = fields.optional(CORRELATION, "")
    if correlation is not None:
        fields.wrong(*_correlation_complaints(form, correlation))
        statement["correlations"] = [{"between": list(GAINS), "coefficient": correlation}]
    fields.check()
    return statement | ({"dof": dof} if dof else {})


def merged(before: Statement, given: Statement) -> dict[str, Any]:
    """The statement `given` by the form, with everything of the one before that the form does not show."""
    shown = {row.key for row in ROWS} | {"dof", "correlations"}
    others = [item for item in before.get("correlations", []) if set(item["between"]) != set(GAINS)]
    return {
        **{key: value for key, value in before.items() if key not in shown},
        **given,
        "correlations": [*given.get("correlations", []), *others],
        "dof": {**_hidden_dof(before), **given.get("dof", {})},
    }


def beside_field(item: Problem) -> Problem:
    """A problem of the statement at the field that it came from; its column is a JSON pointer."""
    pointer = item.column or ""
    at = {f"/{row.key}": row.field for row in ROWS} | {f"/dof/{row.name}": row.dof for row in ROWS}
    if pointer.startswith("/correlations/0"):  # `merged` puts the form's own first
        return replace(item, column=CORRELATION)
    return replace(item, column=at.get(pointer, item.column))


def summary(statement: Statement) -> list[Line]:
    """Everything that is stated, in words."""
    lines = [
        _line(name, statement[key], _dof(statement).get(name))
        for key, (name, _) in UNCERTAINTY_KEYS.items()
        if key in statement
    ]
    return [*lines, *_relations(statement)]


def further(statement: Statement) -> list[Line]:
    """What is stated beyond the fields of the form."""
    shown = {row.key for row in ROWS}
    kept = {key: value for key, value in statement.items() if key not in shown}
    kept["correlations"] = [
        item for item in statement.get("correlations", []) if set(item["between"]) != set(GAINS)
    ]
    return summary(kept)


def _line(name: str, value: float, dof: float | None) -> Line:
    unit = _UNITS[_KEYS[name].rsplit("_", 1)[1]]
    text = entered(value)
    if name in _OFFSETS:
        unit = "nA" if value <= _LARGEST_IN_NA else "mA"
        text = localised(_in_na(value)) if unit == "nA" else text
    return Line(name_of(name), text, labels.unit(unit), entered(dof))


def _relations(statement: Statement) -> Iterator[Line]:
    for item in statement.get("correlations", []):
        one, other = (name_of(name) for name in item["between"])
        yield Line(
            gettext("Correlation of both gains")
            if set(item["between"]) == set(GAINS)
            else gettext("Correlation: %(one)s – %(other)s") % {"one": one, "other": other},
            entered(item["coefficient"]),
        )
    coefficients = statement.get("temperature_coefficients", {})
    for name in PARAMETERS:
        if name in coefficients:
            unit = f"{labels.unit(labels.PARAMETER_UNITS[name])}/{labels.unit('K')}"
            yield Line(
                gettext("%(name)s, per kelvin") % {"name": labels.parameter(name)},
                entered(coefficients[name]),
                unit,
            )


def _dof(statement: Statement) -> Mapping[str, float]:
    found: Mapping[str, float] = statement.get("dof", {})
    return found


def _hidden_dof(statement: Statement) -> dict[str, float]:
    shown = {row.name for row in ROWS}
    return {name: value for name, value in _dof(statement).items() if name not in shown}


def _gain_correlation(statement: Statement) -> float | None:
    for item in statement.get("correlations", []):
        if set(item["between"]) == set(GAINS):
            return float(item["coefficient"])
    return None


def _in_na(value_ma: float) -> str:
    """The same decimal in nA, so that it reads back as the same bits."""
    return f"{Decimal(repr(float(value_ma))).scaleb(6).normalize():f}"


def _offset_entered(value_ma: float) -> str:
    return (
        localised(_in_na(value_ma))
        if value_ma <= _LARGEST_IN_NA
        else f"{entered(value_ma)} {labels.unit('mA')}"
    )


def _offset(form: Form, fields: Fields, row: Row) -> float | None:
    """An offset in mA: a number in nA, or with another unit of current behind it."""
    text = form.value(row.field).strip()
    if not text:
        return None
    unit, number = "na", text
    match = _WITH_UNIT.fullmatch(text)
    if match:
        named = match["unit"].casefold()
        named = _CURRENTS.get(named, named)
        if named in SIZES["current"]:
            unit, number = named, match["number"]
    try:
        value = typed(number, unit, "ma", column=row.field)
    except Invalid as error:
        fields.wrong(*error.problems)
        return None
    fields.wrong(*negative(row.field, value))
    return value


def _complaints(row: Row, form: Form, dof: float | None) -> Iterator[Problem]:
    if dof is not None and dof <= 0:
        yield problem("bad-dof", "Degrees of freedom are greater than 0. Leave this empty if they are not known.",
                      column=row.dof)  # fmt: skip
    if dof is not None and not form.value(row.field).strip():
        yield problem("half-uncertainty", "Give the standard uncertainty that these degrees of freedom belong to, "
                      "or leave both empty.", column=row.field)  # fmt: skip


def _correlation_complaints(form: Form, correlation: float) -> Iterator[Problem]:
    if abs(correlation) > 1:
        yield problem(
            "bad-correlation", "A correlation coefficient lies between −1 and 1.", column=CORRELATION
        )
    if not all(form.value(row.field).strip() for row in ROWS if row.name in GAINS):
        yield problem("half-correlation", "A correlation needs the uncertainty of both gains. Give them, or leave "
                      "this empty.", column=CORRELATION)  # fmt: skip
