"""How a header finds its command: forms, case, optional words, and where a message goes on."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.simdevice.scpi.lamp import Talk


@pytest.mark.parametrize(
    "header",
    ["LIGHt:BRIGhtness", "LIGH:BRIG", "light:brightness", "LiGhT:bRiG", ":LIGHt:BRIG"],
)
def test_short_and_long_form_in_any_case(header):
    talk = Talk()
    talk(f"{header} 40")
    assert (talk(f"{header}?"), talk.errors()) == ("40", [])


@pytest.mark.parametrize("header", ["LIG:BRIG", "LIGHT:BRIGHT", "LIGHTS:BRIG", "BRIG", "LIGH", "LIGH:BRIG:X"])
def test_nothing_between_the_forms_is_taken(header):
    talk = Talk()
    assert (talk(f"{header}?"), talk.errors()) == ("", [-113])


def test_words_in_brackets_may_be_left_out():
    talk = Talk()
    talk("LIGH:SOUR:STAT ON")
    assert talk("LIGH:STAT?;:LIGH:SOURCE:STATE?") == "1;1"


def test_a_query_and_a_command_are_two_things():
    talk = Talk()
    assert (talk("LIGH:COL 3"), talk("DATA"), talk("LIGH:MIX?"), talk.errors()) == ("", "", "", [-113] * 3)


@pytest.mark.parametrize(
    ("message", "answer", "errors"),
    [
        ("LIGH:BRIG 5;BRIG?", "5", []),
        ("LIGH:BRIG 5;:LIGH:BRIG?", "5", []),
        ("LIGH:BRIG 5;LIGH:BRIG?", "", [-113]),
        ("LIGH:BRIG 5;*ESE 1;BRIG?;*ESE?", "5;1", []),
        ("LIGH:SOUR:STAT ON;STAT?", "1", []),
        ("LIGH:SOUR:STAT ON;BRIG?", "", [-113]),
        ("LIGH:BRIG?;COL?;:SYST:VERS?", "0;1;1999.0", []),
        ("*IDN?", "House,LAMP,1,1.0", []),
    ],
)
def test_a_header_goes_on_where_the_last_one_ended(message, answer, errors):
    """SCPI 1999.0, volume 1, 6.2.4: a semicolon keeps the path, a colon or a new message starts at the root."""
    talk = Talk()
    assert (talk(message), talk.errors()) == (answer, errors)
    assert talk("LIGH:COL?") == "1"  # a new message starts at the root


@pytest.mark.parametrize(
    ("message", "error"),
    [
        ("LIGH:BRIG", -109),
        ("LIGH:BRIG 1,2", -108),
        ("LIGH:BRIG? 1", -108),
        ("LIGH:BRIG 101", -222),
        ("LIGH:BRIG -1E-9", -222),
        ("LIGH:BRIG 5 HZ", -131),
        ("LIGH:MIX 1 LX,0", -138),
        ("LIGH:BRIG HIGH", -148),
        ("LIGH:BRIG 'five'", -158),
        ("LIGH:STAT MAYBE", -224),
        ("LIGH:STAT 'ON'", -158),
        ("LIGH:MIX 10,0", -222),
    ],
)
def test_a_parameter_that_does_not_fit_changes_nothing(message, error):
    talk = Talk()
    talk("LIGH:BRIG 7;STAT ON;MIX 2,0.5")
    assert (talk(message), talk.errors()) == ("", [error])
    assert talk("LIGH:BRIG?;STAT?;COL?") == "7;1;2"


@pytest.mark.parametrize(("written", "kept"), [("2.4", "2"), ("2.6", "3"), ("#B101", "5"), ("3E0", "3")])
def test_a_whole_number_is_rounded(written, kept):
    talk = Talk()
    talk(f"LIGH:MIX {written},0")
    assert talk("LIGH:COL?") == kept


@pytest.mark.parametrize(("written", "on"), [("ON", "1"), ("off", "0"), ("1", "1"), ("0", "0"), ("-7", "1")])
def test_a_switch_takes_words_and_numbers(written, on):
    talk = Talk()
    talk(f"LIGH:STAT {written}")
    assert talk("LIGH:STAT?") == on


@given(st.floats(0, 100).map(repr))
def test_every_number_in_range_arrives_as_it_is(number):
    talk = Talk()
    talk(f"LIGH:BRIG {number} LX")
    assert talk.lamp.brightness == float(number)
