"""Messages taken apart, and the standard's number for what is none (SCPI 1999.0, 21.8.9)."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from simdevice.scpi.errors import ScpiError
from simdevice.scpi.syntax import Kind, units


def only(message: bytes):
    (unit,) = units(message)
    return unit


def values(message: bytes):
    return [
        (item.kind, item.text) if math.isnan(item.number) else (item.number, item.suffix)
        for item in only(message).parameters
    ]


def test_a_message_is_units_of_headers_and_parameters():
    first, second = units(b" :sens:rate 200 HZ ; *IDN?\r")
    assert (first.words, first.is_query, first.from_root) == (("SENS", "RATE"), False, True)
    assert (second.words, second.is_query, second.is_common) == (("*IDN",), True, True)


@pytest.mark.parametrize(
    ("parameter", "expected"),
    [
        (b"90", (90.0, "")),
        (b"-.5", (-0.5, "")),
        (b"+5.", (5.0, "")),
        (b"1.5e3", (1500.0, "")),
        (b"1.5 E -3 Hz", (0.0015, "HZ")),
        (b"90DEG", (90.0, "DEG")),
        (b"#HfF", (255.0, "")),
        (b"#q17", (15.0, "")),
        (b"#B101", (5.0, "")),
        (b"on", (Kind.WORD, "ON")),
        (b'"a;b,""c"""', (Kind.STRING, 'a;b,"c"')),
        (b"'it''s'", (Kind.STRING, "it's")),
    ],
)
def test_a_parameter_is_what_it_looks_like(parameter, expected):
    assert values(b"SET " + parameter) == [expected]


def test_separators_in_strings_separate_nothing():
    message = b"SET 'a,b;c',\"d;e\" ; NEXT?"
    first, second = units(message)
    assert [item.text for item in first.parameters] == ["a,b;c", "d;e"]
    assert second.words == ("NEXT",)


@pytest.mark.parametrize("message", [b"", b"  ", b";", b" ; ;\t;\r", b"\x00\x01"])
def test_white_space_says_nothing(message):
    assert list(units(message)) == []


@pytest.mark.parametrize(
    ("message", "number"),
    [
        (b"SET \xb0", -101),
        (b"SET \x7f", -101),
        (b"=", -102),
        (b"SET 1,", -102),
        (b"SET ,1", -102),
        (b"SET &", -102),
        (b":", -110),
        (b"*", -110),
        (b"SET::RATE", -110),
        (b"SET!", -110),
        (b"ABCDEFGHIJKLM 1", -112),
        (b"SET 1..2", -121),
        (b"SET 1 2", -121),
        (b"SET #HXY", -121),
        (b"SET #B12", -121),
        (b"SET 1E32001", -123),
        (b"SET 1E400", -123),
        (b"SET 1E99999999999", -123),
        (b"SET " + b"1" * 300, -124),
        (b"SET #H" + b"1" * 300, -124),
        (b"SET a-b", -141),
        (b"SET ABCDEFGHIJKLM", -144),
        (b"SET 'open", -151),
        (b"SET 'a'b", -151),
        (b"SET #", -161),
        (b"SET #X1", -161),
        (b"SET #15hello", -168),
        (b"SET (1)", -178),
    ],
)  # fmt: skip
def test_what_is_no_message_has_its_number(message, number):
    with pytest.raises(ScpiError) as error:
        list(units(message))
    assert error.value.number == number


def test_units_before_the_mistake_are_read():
    found = units(b"FIRST;SECOND 1..2;THIRD")
    assert next(found).words == ("FIRST",)
    with pytest.raises(ScpiError):
        next(found)


@given(st.binary(max_size=80))
def test_any_bytes_are_understood_or_refused_by_number(message):
    numbers = [-100]
    try:
        list(units(message))
    except ScpiError as error:
        numbers.append(error.number)
    assert all(-200 < number <= -100 for number in numbers)
