"""Typed and written decimals: exact reading, exact shifts, against Python's own arithmetic."""

import math
import struct
from decimal import Decimal, localcontext
from fractions import Fraction

import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.errors import Invalid
from app.exchange.numbers import SIZES, exact_in, power_of_ten, read_decimal, to_lab, typed
from solver.errors import Message

finite = st.floats(allow_nan=False, allow_infinity=False)


def bits(value: float) -> bytes:
    return struct.pack("<d", value)


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("0.004536", "0.004536"),
        ("0,004536", "0.004536"),
        ("-1", "-1"),
        ("−1.5", "-1.5"),  # U+2212 minus
        ("–1,5", "-1.5"),  # en dash
        ("‐2", "-2"),  # U+2010 hyphen
        ("－2", "-2"),  # full-width
        ("− 2", "-2"),  # a minus set apart
        ("+3", "3"),
        ("\u00a012.5\u202f", "12.5"),
        ("\t7 ", "7"),
        (".5", "0.5"),
        ("5.", "5"),
        ("5,", "5"),
        ("1e-3", "0.001"),
        ("1,5E−03", "0.0015"),
        ("007", "7"),
        ("1e-400", "1e-400"),
    ],
)
def test_a_number_is_read_however_it_is_written(text: str, value: str) -> None:
    assert read_decimal(text) == Decimal(value)


@pytest.mark.parametrize(
    ("text", "code"),
    [
        ("", "empty-value"),
        (" \u00a0", "empty-value"),
        ("nan", "nan"),
        ("-NaN", "nan"),
        ("#N/A", "nan"),
        ("#DIV/0!", "nan"),
        ("null", "nan"),
        ("inf", "infinite"),
        ("-Infinity", "infinite"),
        ("−∞", "infinite"),
        ("1 234.5", "thousands-separator"),
        ("1\u00a0234", "thousands-separator"),
        ("1\u202f234,5", "thousands-separator"),
        ("1,234.5", "thousands-separator"),
        ("1.234,5", "thousands-separator"),
        ("1,234,567", "thousands-separator"),
        ("1'234", "thousands-separator"),
        ("1_000", "thousands-separator"),
        ("4.5 mA", "not-a-number"),
        ("abc", "not-a-number"),
        ("1e", "not-a-number"),
        ("--1", "not-a-number"),
        ("1-2", "not-a-number"),
        ("0x10", "not-a-number"),
        ("١٢", "not-a-number"),  # Arabic digits: float() would take them
        ("1.2.3", "not-a-number"),
        ("9" * 1001, "not-a-number"),
        ("1e401", "too-large"),
        ("1e99999999999999999999", "too-large"),
    ],
)
def test_what_is_no_number_is_told_with_its_cure(text: str, code: str) -> None:
    answer = read_decimal(text)
    assert isinstance(answer, Message)
    assert answer.code == code
    assert answer.text.count(".") >= 1
    assert any(word in answer.text for word in ("Write", "Fill", "Measure", "Check"))


def test_a_decimal_comma_is_refused_where_commas_separate_columns() -> None:
    answer = read_decimal("0,5", comma=False)
    assert isinstance(answer, Message)
    assert answer.code == "decimal-comma"
    assert "semicolons" in answer.text


@given(finite)
def test_every_float_comes_back_from_its_own_text_bit_by_bit(value: float) -> None:
    for text in (repr(value), repr(value).replace(".", ",").replace("-", "−")):
        assert bits(to_lab(text, "ma", "ma")) == bits(value)


@given(st.decimals(allow_nan=False, allow_infinity=False, min_value=-1000, max_value=1000, places=12))
def test_one_current_in_four_units_has_the_same_bits(milliampere: Decimal) -> None:
    with localcontext() as exact:
        exact.prec = 60
        texts = {
            "a": milliampere.scaleb(-3),
            "ma": milliampere,
            "ua": milliampere.scaleb(3),
            "na": milliampere.scaleb(6),
        }
    expected = bits(float(str(milliampere)))  # Python's float() rounds a decimal text correctly
    for unit, value in texts.items():
        assert bits(to_lab(str(value), unit, "ma")) == expected
        assert bits(to_lab(f"{value:e}", unit, "ma")) == expected


def test_the_issues_own_example() -> None:
    assert (
        to_lab("4.536", "ua", "ma")
        == to_lab("0.004536", "ma", "ma")
        == to_lab("4.536e-6", "a", "ma")
        == 0.004536
    )


@given(st.decimals(allow_nan=False, allow_infinity=False, min_value=-400, max_value=400, places=9))
def test_degrees_and_arcseconds_are_one_exact_fraction(value: Decimal) -> None:
    assert to_lab(value, "deg", "arcsec") == float(Fraction(value) * 3600)
    assert to_lab(value, "arcsec", "deg") == float(Fraction(value) / 3600)


@pytest.mark.parametrize("degrees", [0.0, 30.0, 90.0, 180.0, 270.0, 45.5])
def test_radians_as_a_program_prints_them_give_whole_degrees(degrees: float) -> None:
    assert to_lab(repr(math.radians(degrees)), "rad", "deg") == pytest.approx(degrees, rel=3e-16)


def test_zero_of_kelvin() -> None:
    assert to_lab("0", "k", "c") == -273.15
    assert to_lab("293.15", "k", "c") == 20.0
    assert to_lab("0", "c", "c") == 0.0


@pytest.mark.parametrize(("unit", "lab_unit", "exponent"), [
    ("ma", "ma", 0), ("a", "ma", 3), ("ua", "ma", -3), ("μa", "ma", -3), ("ms", "s", -3), ("deg", "arcsec", None),
    ("k", "c", None), ("c", "c", 0),
])  # fmt: skip
def test_units_related_by_a_power_of_ten(unit: str, lab_unit: str, exponent: int | None) -> None:
    assert power_of_ten(unit, lab_unit) == exponent


def test_every_unit_goes_to_every_other_of_its_kind_and_back_without_rounding() -> None:
    for units in SIZES.values():
        for a in units:
            for b in set(units) - {"c", "k"}:
                assert exact_in(Decimal(1), a, b) * exact_in(Decimal(1), b, a) == 1 or a in {"c", "k"}


def test_a_number_that_overflows_in_the_laboratorys_unit_is_refused() -> None:
    with pytest.raises(Invalid, match="too large"):
        to_lab("1e308", "a", "ma")
    assert to_lab("1e308", "ua", "ma") == 1e305


def test_typed_names_the_field() -> None:
    assert typed("4,5", "ua", "ma", column="jx_ma") == 0.0045
    assert typed("4.5", "ma") == 4.5
    with pytest.raises(Invalid) as caught:
        typed("four", "ma", column="jx_ma")
    (item,) = caught.value.problems
    assert (item.column, item.message.code) == ("jx_ma", "not-a-number")


@given(st.text(max_size=30))
def test_any_text_gives_a_number_or_a_message(text: str) -> None:
    answer = read_decimal(text)
    assert isinstance(answer, Decimal | Message)
    if isinstance(answer, Decimal):
        assert answer.is_finite()
