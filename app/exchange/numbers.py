"""Decimal numbers as people and programs write them, read exactly and rounded once.

A number is read as an exact decimal, shifted exactly into the laboratory's unit and then rounded
to the nearest float64. So 4.536 µA, 0.004536 mA and 4.536e-6 A become the same bits. The sizes
below relate units of one kind to each other (they are exact, but for the radian, which has fifty
digits); what turns laboratory units into SI stands in `solver.units`.
"""

import re
from decimal import Decimal, InvalidOperation
from fractions import Fraction
from math import inf, isinf
from typing import Final

from app.errors import Invalid, Problem
from solver.errors import Message

_LONGEST = 1000
LARGEST: Final = 1e12
"""No quantity of a file is larger in the laboratory's unit; it keeps sums and squares finite."""

_LARGEST_EXPONENT = 400  # beyond binary64 in every unit; keeps exact fractions short

_MINUSES: Final = dict.fromkeys(map(ord, "\u2010\u2011\u2012\u2013\u2212\ufe63\uff0d"), "-")
_SPACES: Final = dict.fromkeys(map(ord, "\u00a0\u2007\u2009\u200a\u200b\u202f\u2002\u2003\ufeff"), " ")
_TYPOGRAPHY: Final = _MINUSES | _SPACES

_NUMBER = re.compile(r"([+-]?) ?([0-9]+[.,]?[0-9]*|[.,][0-9]+)(?:[eE]([+-]?[0-9]+))?")
_NAN = re.compile(r"[+-]?(nan|n/a|#n/a|null|none)|#?(num|value|div/0|ref)!?", re.IGNORECASE)
_INFINITE = re.compile(r"[+-]? ?(inf|infinity|∞)", re.IGNORECASE)
_GROUPED = re.compile(
    r"[+-]? ?[0-9]{1,3}(([ '’_][0-9]{3})+([.,][0-9]*)?|(,[0-9]{3})+\.[0-9]*|(\.[0-9]{3})+,[0-9]*"
    r"|(,[0-9]{3}){2,}|(\.[0-9]{3}){2,})"
)

_PI = Fraction("3.14159265358979323846264338327950288419716939937511")
_DEG_PER_RAD = Fraction(180) / _PI

SIZES: Final[dict[str, dict[str, Fraction]]] = {
    "current": {
        "a": Fraction(1), "ma": Fraction(1, 10**3), "ua": Fraction(1, 10**6), "na": Fraction(1, 10**9),
        "µa": Fraction(1, 10**6), "μa": Fraction(1, 10**6),  # micro sign and Greek mu
    },
    "angle": {
        "deg": Fraction(1), "arcmin": Fraction(1, 60), "arcsec": Fraction(1, 3600),
        "rad": _DEG_PER_RAD, "mrad": _DEG_PER_RAD / 10**3, "urad": _DEG_PER_RAD / 10**6,
    },
    "time": {
        "s": Fraction(1), "ms": Fraction(1, 10**3), "us": Fraction(1, 10**6),
        "min": Fraction(60), "h": Fraction(3600),
    },
    "frequency": {"hz": Fraction(1), "khz": Fraction(10**3)},
    "temperature": {"c": Fraction(1), "k": Fraction(1)},
}  # fmt: skip
"""Units by kind, each with its size in the first unit of its kind."""

_ZERO: Final = {"k": Fraction("273.15")}  # zero of the Celsius scale on this one

_SIZE_OF: Final = {unit: size for kind in SIZES.values() for unit, size in kind.items()}


def read_decimal(text: str, *, comma: bool = True) -> Decimal | Message:
    """Read one number, exactly; or say what is wrong with it and what to do.

    Takes any minus sign, spaces of any width around the number, an exponent, and a decimal point
    or (with `comma`) a decimal comma. Refuses text, NaN, infinity and thousands separators.

    Parameters
    ----------
    text
        As typed, pasted or found in a file.
    comma
        Whether a decimal comma is understood: not in a file separated by commas.
    """
    if len(text) > _LONGEST:
        return Message("not-a-number", "This is too long for a number. Write at most 1000 characters.")
    plain = text.translate(_TYPOGRAPHY).strip()
    match = _NUMBER.fullmatch(plain)
    if match is None or (not comma and "," in plain):
        return _complaint(plain, comma=comma)
    sign, digits, exponent = match.groups()
    try:
        value = Decimal(f"{sign}{digits.replace(',', '.')}e{exponent or 0}")
    except InvalidOperation:
        value = Decimal("Infinity")
    if value.is_infinite() or (value and value.adjusted() > _LARGEST_EXPONENT):
        return overflow(plain)
    if value.adjusted() < -_LARGEST_EXPONENT:
        return Decimal("-0") if value.is_signed() else Decimal(0)
    return value


def _complaint(plain: str, *, comma: bool) -> Message:
    """Say why `plain` is no number."""
    shown = {"text": plain[:40]}
    if not plain:
        return Message("empty-value", "There is no number here. Fill it in, or remove the whole row.")
    if _NAN.fullmatch(plain):
        return Message(
            "nan", "“%(text)s” is not a value. Measure this again, or remove the whole row.", shown
        )
    if _INFINITE.fullmatch(plain):
        return Message(
            "infinite", "“%(text)s” is infinite. Measure this again, or remove the whole row.", shown
        )
    if _GROUPED.fullmatch(plain):
        return Message(
            "thousands-separator",
            "“%(text)s” has a thousands separator. Write the number without it, as in 1234.5.",
            shown,
        )
    if not comma and _NUMBER.fullmatch(plain):
        return Message(
            "decimal-comma",
            "“%(text)s” has a decimal comma in a file separated by commas. "
            "Separate the columns by semicolons, or write a decimal point.",
            shown,
        )
    return Message("not-a-number", "“%(text)s” is not a number. Write it like −0.0045 or 4.5e-3.", shown)


def overflow(text: str) -> Message:
    """What to say about a number that nothing measured here can have."""
    return Message(
        "too-large", "“%(text)s” is too large. Check its exponent and its unit.", {"text": text[:40]}
    )


def exact_in(value: Decimal, unit: str, lab_unit: str) -> Fraction:
    """Shift a decimal from one unit into another of its kind, without rounding."""
    exact = (Fraction(value) - _ZERO.get(unit, 0)) * _SIZE_OF[unit]
    return exact / _SIZE_OF[lab_unit] + _ZERO.get(lab_unit, 0)


def shifted(value: Decimal, unit: str, lab_unit: str) -> float:
    """Shift a decimal into another unit and round it once; infinite beyond binary64."""
    if unit == lab_unit or (not value and not {unit, lab_unit} & _ZERO.keys()):
        return float(value)  # through its text: correctly rounded, and −0 keeps its sign
    try:
        return float(exact_in(value, unit, lab_unit))
    except OverflowError:
        return inf


def to_lab(value: Decimal | str, unit: str, lab_unit: str) -> float:
    """Shift a decimal into the laboratory's unit exactly; the float64 nearest to the result.

    Parameters
    ----------
    value
        Exact decimal, or text that `read_decimal` understands.
    unit, lab_unit
        Units of one kind of `SIZES`: ``ua`` and ``ma``.

    Raises
    ------
    Invalid
        When the text is no number, or the result is beyond binary64.
    """
    return _to_lab(value, unit, lab_unit, None)


def _to_lab(value: Decimal | str, unit: str, lab_unit: str, column: str | None) -> float:
    read = read_decimal(value) if isinstance(value, str) else value
    if isinstance(read, Message):
        raise Invalid(Problem(read, column=column))
    result = shifted(read, unit, lab_unit)
    if isinf(result):
        raise Invalid(Problem(overflow(str(value)), column=column))
    return result


def typed(text: str, unit: str, lab_unit: str | None = None, *, column: str | None = None) -> float:
    """Read a number that somebody typed into a form: decimal point and comma both count.

    Parameters
    ----------
    text
        What stands in the field.
    unit, lab_unit
        Unit of the field, and the one to return (default: the same).
    column
        Name of the field, for the problem.

    Raises
    ------
    Invalid
        One problem that names the field.
    """
    return _to_lab(text, unit, lab_unit or unit, column)


def power_of_ten(unit: str, lab_unit: str) -> int | None:
    """Exponent n with `unit` = 10ⁿ `lab_unit`, or None when the two are not related so."""
    if unit in _ZERO or lab_unit in _ZERO:
        return 0 if unit == lab_unit else None
    ratio = _SIZE_OF[unit] / _SIZE_OF[lab_unit]
    for exponent in range(-12, 13):
        if ratio == Fraction(10) ** exponent:
            return exponent
    return None
