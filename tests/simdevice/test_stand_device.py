"""The stand by its bytes, as a manual would print them: what is sent, what is answered, seconds to wait then.

At 30 °/s a turn of 180° takes 6 s, and 1 s more to lock; seeking the reference takes 10 s.
"""

import pytest

from tests.simdevice.instruments import Bench, told

OK = '0,"No error"'
NO_REFERENCE = '-221,"Settings conflict;the axes have no reference: seek it with AXIS:HOME"'
STOPPED = '101,"Emergency stop;release the button and send SAFety:RESet"'
PRESSED = '-221,"Settings conflict;the button of the emergency stop is still pressed"'

DIALOGUES = {
    "identity": [("*IDN?", "Driftbook,SIM-STAND,7,1.0", 0)],
    "seeking the reference": [
        ("AXIS:REFerence?", "0", 0),
        ("AXIS:HOME", "", 0),
        ("AXIS:MOVing?", "1", 9.9),
        ("AXIS:MOVing?", "1", 0.2),
        ("AXIS:MOVing?", "0", 0),
        ("AXIS:REFerence?", "1", 0),
        ("AXIS:POSition?", "0.0000,0.0000", 0),
    ],
    "moving": [
        ("AXIS:HOME", "", 10),
        ("AXIS:POSition 90,180", "", 0),
        ("AXIS:POSition?", "0.0000,0.0000", 3.5),
        ("axis:pos?;mov?", "45.0000,90.0000;1", 3.5),
        ("AXIS:POS?;MOV?", "90.0000,180.0000;0", 0),
        ("SYSTem:ERRor?", OK, 0),
    ],
    "angles with their unit, and negative ones": [
        ("AXIS:HOME", "", 10),
        ("AXIS:POS 90 DEG, -90 DEG", "", 7),
        ("AXIS:POS?;:SYST:ERR?", "90.0000,-90.0000;" + OK, 0),
    ],
    "an angle beside a fixed position is taken to it": [
        ("AXIS:HOME", "", 10),
        ("AXIS:POS 89.995,0", "", 7),
        ("SYST:ERR?", OK, 0),
        ("AXIS:POS 89.98,0", "", 0),
        ("SYST:ERR?", '-224,"Illegal parameter value;no fixed position at 89.98, 0 deg"', 0),
    ],
    "no movement without a reference": [
        ("AXIS:POS 90,180", "", 0),
        ("AXIS:MOV?;:SYST:ERR?", "0;" + NO_REFERENCE, 0),
        ("SYST:ERR?", OK, 0),
    ],
    "limits": [
        ("AXIS:LIMit?", "-360.0000,360.0000,-360.0000,360.0000", 0),
        ("AXIS:HOME", "", 10),
        ("AXIS:POS 450,0", "", 0),
        ("SYST:ERR?", '-222,"Data out of range;450 is not from -360 to 360"', 0),
        ("AXIS:POS 0", "", 0),
        ("SYST:ERR?", '-109,"Missing parameter;AXIS:POSition takes 2"', 0),
        ("AXIS:MOV?", "0", 0),
    ],
    "a new movement takes the place of the old one": [
        ("AXIS:HOME", "", 10),
        ("AXIS:POS 180,0", "", 3.5),
        ("AXIS:POS 0,0", "", 0),
        ("AXIS:POS?", "90.0000,0.0000", 4),
        ("AXIS:POS?;MOV?;:SYST:ERR?", "0.0000,0.0000;0;" + OK, 0),
    ],
    "stopping": [
        ("AXIS:HOME", "", 10),
        ("AXIS:POS 180,0", "", 3.5),
        ("ABORt", "", 0),
        ("AXIS:POS?;MOV?;REF?", "90.0000,0.0000;0;1", 5),
        ("AXIS:POS?", "90.0000,0.0000", 0),
    ],
    "stopping while the reference is sought": [
        ("AXIS:HOME", "", 5),
        ("ABOR;AXIS:MOV?;REF?", "0;0", 10),
        ("AXIS:REF?", "0", 0),
    ],
    "reset stops and keeps the reference": [
        ("AXIS:HOME", "", 10),
        ("AXIS:POS 180,0", "", 3.5),
        ("*RST;AXIS:POS?;MOV?;REF?", "90.0000,0.0000;0;1", 0),
    ],
    "the emergency stop": [
        ("AXIS:HOME", "", 10),
        ("AXIS:POS 180,0", "", 3.5),
        ("SAFety:ESTop?", "0", 0),
        ("SAFety:ESTop:PRESs ON", "", 1),
        ("SAF:EST?;:AXIS:MOV?;POS?", "1;0;90.0000,0.0000", 0),
        ("AXIS:POS 0,0;:SYST:ERR?", STOPPED, 0),
        ("AXIS:HOME;:SYST:ERR?", STOPPED, 0),
        ("SAFety:RESet;:SYST:ERR?", PRESSED, 100),
        ("SAF:RES;:SYST:ERR?", PRESSED, 0),
        ("SAF:EST:PRES OFF", "", 0),
        ("SAF:EST?", "1", 0),
        ("SAF:RES;EST?", "0", 0),
        ("AXIS:POS 0,0", "", 4),
        ("AXIS:POS?;REF?;:SYST:ERR?", "0.0000,0.0000;1;" + OK, 0),
    ],
    "conditions": [
        ("STATus:OPERation:CONDition?;:STATus:QUEStionable:CONDition?", "0;512", 0),
        ("AXIS:HOME", "", 5),
        ("STAT:OPER:COND?;:STAT:QUES:COND?", "768;512", 5),
        ("STAT:OPER:COND?;:STAT:QUES:COND?", "0;0", 0),
        ("AXIS:POS 0,90", "", 1),
        ("STAT:OPER:COND?", "256", 0),
        ("SAF:EST:PRES ON;:STAT:OPER:COND?;:STAT:QUES:COND?", "0;1024", 0),
    ],
    "registers": [
        ("*ESR?", "128", 0),
        ("*ESE 1;*SRE 32;*OPC", "", 0),
        ("*ESR?", "1", 0),
        ("AXIS:HOME;*OPC", "", 5),
        ("*STB?", "0", 5),
        ("*STB?", "96", 0),
        ("*ESR?;*STB?", "1;16", 0),
        ("AXIS:HOM", "", 0),
        ("*ESR?;:SYST:ERR?", '32;-113,"Undefined header;AXIS:HOM"', 0),
        ("*IDN?;*ESR?", "Driftbook,SIM-STAND,7,1.0", 0),
        ("*ESR?;:SYST:ERR?", '4;-440,"Query UNTERMINATED after indefinite response"', 0),
    ],
}

FAULTS = {
    "stall@90/0": [
        ("AXIS:HOME", "", 10),
        ("AXIS:POS 90,0", "", 1000),
        ("AXIS:MOV?;POS?", "1;45.0000,0.0000", 0),
        ("ABOR;AXIS:MOV?", "0", 0),
        ("AXIS:POS 90,0", "", 4),
        ("AXIS:MOV?;POS?;REF?;:SYST:ERR?", "0;90.0000,0.0000;1;" + OK, 0),
    ],
    "stall@90/0!": [
        ("AXIS:HOME", "", 10),
        ("AXIS:POS 90,0", "", 1000),
        ("AXIS:POS 90,0", "", 1000),
        ("AXIS:MOV?;POS?", "1;67.5000,0.0000", 0),
        ("AXIS:POS 0,90", "", 4),
        ("AXIS:MOV?;POS?", "0;0.0000,90.0000", 0),
    ],
    "lost-reference@0/90": [
        ("AXIS:HOME", "", 10),
        ("AXIS:POS 90,0", "", 4),
        ("AXIS:POS 0,90", "", 2),
        ("AXIS:REF?", "1", 2),
        ("AXIS:REF?;MOV?;POS?", "0;0;0.0000,90.0000", 0),
        ("AXIS:POS 0,0;:SYST:ERR?", NO_REFERENCE, 0),
        ("AXIS:HOME", "", 13),
        ("AXIS:REF?", "1", 0),
        ("AXIS:POS 0,90", "", 4),
        ("AXIS:REF?", "1", 0),
    ],
    "wrong-position@0/90": [
        ("AXIS:HOME", "", 10),
        ("AXIS:POS 0,90", "", 4),
        ("AXIS:POS?;REF?;MOV?;:SYST:ERR?", "0.0000,90.0000;1;0;" + OK, 0),
    ],
    # Halfway of 4 s somebody presses the button, and lets it go 10 s later.
    "emergency-stop@90/0": [
        ("AXIS:HOME", "", 10),
        ("AXIS:POS 90,0", "", 1.9),
        ("SAF:EST?", "0", 0.2),
        ("SAF:EST?;:AXIS:MOV?;POS?;REF?", "1;0;45.0000,0.0000;1", 9.7),
        ("SAF:RES;:SYST:ERR?", PRESSED, 0.3),
        ("SAF:EST?;RES;EST?;:SYST:ERR?", "1;0;" + OK, 0),
        ("AXIS:POS 90,0", "", 4),
        ("AXIS:MOV?;POS?", "0;90.0000,0.0000", 0),
    ],
}  # fmt: skip


@pytest.mark.parametrize("dialogue", DIALOGUES.values(), ids=DIALOGUES)
def test_the_stand_answers_as_its_manual_says(dialogue):
    speak(Bench(), dialogue)


@pytest.mark.parametrize(("fault", "dialogue"), FAULTS.items(), ids=FAULTS)
def test_a_faulty_stand_behaves_as_its_fault_says(fault, dialogue):
    speak(Bench(faults=[fault]), dialogue)


def speak(bench, dialogue):
    for sent, answer, wait in dialogue:
        assert (sent, told(bench.stand, sent)) == (sent, answer)
        bench.wait(wait)


def test_a_program_may_wait_for_a_movement_or_ask():
    bench = Bench()
    steps = bench.stand.respond(b"AXIS:HOME;*OPC?;POS?")
    assert next(steps) > 0
    bench.wait(10)
    with pytest.raises(StopIteration) as end:
        next(steps)
    assert end.value.value == b"1;0.0000,0.0000\n"


def test_a_stall_is_waited_for_without_end():
    bench = Bench(faults=["stall@0/90"])
    bench.moved(0, 90)
    assert bench.stand.waits_for_ever()
    told(bench.stand, "ABOR")
    assert not bench.stand.waits_for_ever()
