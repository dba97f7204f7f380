"""Messages and answers, status registers and the error queue (IEEE 488.2-1992, chapters 10 and 11)."""

import logging

import pytest
from hypothesis import given
from hypothesis import strategies as st

from simdevice.scpi.instrument import HangUp
from tests.simdevice.scpi.lamp import Talk

WORDS = [
    "*IDN?", "*ESR?", "*RST", "*STB?", "*ESE", "*SRE", "LIGH", ":", "BRIG", "?", " ", ";", ",", "5", "1E9", "'", '"',
    "#", "#H", "(", "ON", "SYST:ERR?", "STAT:OPER:ENAB", "\r", "\t", "\x00", "é", "DATA?",
]  # fmt: skip


def test_answers_of_one_message_are_one_line():
    talk = Talk()
    assert talk("LIGH:BRIG 5;BRIG?;STAT?;*ESE?") == "5;0;0"
    assert list(talk.instrument.respond(b"LIGH:BRIG 6")) == []


def test_a_block_is_an_answer_like_others():
    # A block says its length: 5 bytes, whatever they are.
    assert Talk()("DATA?;*ESE?") == "#15a;\n\x00\xff;0"


def test_power_on_is_told_once():
    talk = Talk()
    assert (talk("*ESR?"), talk("*ESR?")) == ("128", "0")


@pytest.mark.parametrize(
    ("message", "bit"),
    [("NONSENSE", 32), ("LIGH:BRIG", 32), ("LIGH:BRIG 500", 16), ("*IDN?;*STB?", 4), ("*OPC", 1)],
)
def test_what_happened_stands_in_the_event_register(message, bit):
    talk = Talk()
    talk("*CLS")
    talk(message)
    assert (talk("*ESR?"), talk("*ESR?")) == (str(bit), "0")


def test_nothing_may_be_asked_after_an_answer_without_end():
    """IEEE 488.2-1992, 6.3.7.5: ``*IDN?`` must be the last query of its message."""
    talk = Talk()
    assert (talk("*IDN?;LIGH:BRIG?"), talk.errors()) == ("House,LAMP,1,1.0", [-440])
    assert (talk("LIGH:BRIG?;*IDN?"), talk.errors()) == ("0;House,LAMP,1,1.0", [])


def test_a_command_error_ends_its_message_and_an_execution_error_does_not():
    talk = Talk()
    assert (talk("LIGH:BRIG 500;BRIG?"), talk.errors()) == ("0", [-222])
    assert (talk("LIGH:BRIG 5;BRI 6;BRIG 7"), talk.errors()) == ("", [-113])
    assert talk("LIGH:BRIG?") == "5"


def test_errors_come_out_in_their_order():
    talk = Talk()
    for message in ("NONSENSE", "LIGH:BRIG 500", "LIGH:BRIG"):
        talk(message)
    assert talk("SYST:ERR:COUN?") == "3"
    assert [talk("SYSTem:ERRor:NEXT?").split(",")[0] for _ in range(4)] == ["-113", "-222", "-109", "0"]


def test_a_full_queue_says_so_in_its_last_place():
    talk = Talk()
    for _ in range(25):
        talk("LIGH:BRIG 500")
    assert talk("*ESR?") == str(128 | 16 | 8)
    assert talk.errors() == [-222] * 19 + [-350]


def test_clear_forgets_what_happened_and_keeps_the_masks():
    talk = Talk()
    talk("*ESE 60;*SRE 36;:STAT:OPER:ENAB 16")
    talk("NONSENSE")
    talk("*CLS")
    assert talk("*ESR?;*STB?;:SYST:ERR:COUN?") == "0;16;0"
    assert talk("*ESE?;*SRE?;:STAT:OPER:ENAB?") == "60;36;16"


def test_reset_is_the_devices_and_leaves_the_status():
    talk = Talk()
    talk("*ESE 60;LIGH:BRIG 5")
    talk("NONSENSE")
    assert talk("*RST;*ESE?;LIGH:BRIG?") == "60;0"
    assert talk.errors() == [-113]


def byte(talk: Talk) -> int:
    """The status byte with no answer before it in its message."""
    return int(talk("*STB?"))


def test_the_status_byte_sums_up():
    """Bits: errors 4, questionable 8, answer 16, events 32, request 64, operation 128."""
    talk = Talk()
    talk("*CLS")
    assert byte(talk) == 0
    talk("NONSENSE")
    assert byte(talk) == 4
    talk("*ESE 32")
    assert byte(talk) == 4 | 32
    talk("*SRE 32")
    assert byte(talk) == 4 | 32 | 64
    talk("*SRE 4;*ESE 0")
    assert byte(talk) == 4 | 64
    assert talk.errors() == [-113]
    assert byte(talk) == 0
    assert talk("LIGH:BRIG?;*STB?") == "0;16"
    assert talk("*SRE 16;LIGH:BRIG?;*STB?") == "0;80"


def test_the_request_for_service_cannot_ask_for_itself():
    talk = Talk()
    talk("*SRE 255")
    assert talk("*SRE?") == "191"


@pytest.mark.parametrize("message", ["*ESE 256", "*SRE -1", "STAT:OPER:ENAB 32768"])
def test_masks_have_their_width(message):
    talk = Talk()
    talk(message)
    assert talk.errors() == [-222]


@pytest.mark.parametrize(("group", "place", "summary"), [("OPER", 0, 128), ("QUES", 1, 8)])
def test_a_group_notes_what_became_true(group, place, summary):
    talk = Talk()
    talk("*CLS")
    talk(f"STAT:{group}:ENAB 16")
    talk.lamp.conditions[place] = 16 | 2
    assert talk(f"STAT:{group}:COND?") == "18"
    assert byte(talk) == summary
    talk.lamp.conditions[place] = 0
    assert (talk(f"STAT:{group}:COND?"), byte(talk)) == ("0", summary)
    assert (talk(f"STAT:{group}?"), talk(f"STAT:{group}:EVEN?"), byte(talk)) == ("18", "0", 0)
    talk.lamp.conditions[place] = 16
    talk("STAT:PRES")
    assert (talk(f"STAT:{group}:ENAB?"), byte(talk)) == ("0", 0)


def test_operation_complete_is_noted_when_all_is_done():
    talk = Talk()
    talk("*CLS")
    talk.lamp.left = 2.0
    talk("*OPC")
    assert talk("*ESR?") == "0"
    talk.lamp.left = 0.0
    assert talk("*ESR?") == "1"
    assert talk("*ESR?") == "0"


@pytest.mark.parametrize("forgetting", ["*CLS", "*RST"])
def test_operation_complete_is_forgotten(forgetting):
    talk = Talk()
    talk("*CLS")
    talk.lamp.left = 2.0
    talk("*OPC")
    talk(forgetting)
    talk.lamp.left = 0.0
    assert talk("*ESR?") == "0"


@pytest.mark.parametrize(("message", "answer"), [(b"*OPC?", b"1\n"), (b"*WAI;LIGH:BRIG?", b"0\n")])
def test_who_waits_gets_the_answer_when_all_is_done(message, answer):
    talk = Talk()
    talk.lamp.left = 2.0
    steps = talk.instrument.respond(message)
    # A client is not made to sleep long at a time: the operation may be stopped by another.
    assert 0 < next(steps) <= 0.1
    assert 0 < next(steps) <= 0.1
    assert talk("LIGH:COL?") == "1"  # others are answered meanwhile
    talk("ABOR")
    with pytest.raises(StopIteration) as end:
        next(steps)
    assert end.value.value == answer


def test_self_test_and_version():
    assert Talk()("*TST?;:SYST:VERS?") == "0;1999.0"


def test_a_broken_connection_takes_the_answers_before_it_along():
    with pytest.raises(HangUp) as broken:
        Talk()("LIGH:BRIG?;:BRE?;COL?")
    assert broken.value.sent == b"0;#15ab"


def test_a_failure_of_the_simulator_is_an_error_and_is_logged(caplog):
    talk = Talk()
    with caplog.at_level(logging.ERROR):
        assert talk("FAIL;LIGH:BRIG?") == "0"
    assert talk.errors() == [-310]
    assert "ZeroDivisionError" in caplog.text


@given(st.lists(st.one_of(st.sampled_from(WORDS), st.text(max_size=5)), max_size=12).map("".join))
def test_whatever_is_said_the_next_question_is_answered(message):
    talk = Talk()
    list(talk.instrument.respond(message.replace("\n", "").encode("utf-8")))
    assert talk("*CLS;:LIGH:COL?") == "1"


@given(st.binary(max_size=200))
def test_whatever_bytes_come_the_next_question_is_answered(message):
    talk = Talk()
    list(talk.instrument.respond(message))
    assert talk("*CLS;:LIGH:COL?") == "1"
