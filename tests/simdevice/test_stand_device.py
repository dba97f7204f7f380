"""The stand by its bytes, as a manual would print them: what is sent, seconds waited, what is answered."""

import pytest

from tests.simdevice.instruments import Bench, told

# A turn of 180° at 30 °/s and 1 s of locking take 7 s; seeking the reference at rest takes 10 s.
DIALOGUES = {
    "it says who it is": [("*IDN?", 0, "Driftbook,SIM-STAND,7,1.0")],
    "it seeks its reference": [
        ("AXIS:REFerence?", 0, "0"),
        ("AXIS:HOME", 0, ""),
        ("AXIS:MOVing?", 9.9, "1"),
        ("AXIS:MOVing?", 0.1, "1"),
        ("AXIS:MOVing?", 0, "0"),
        ("AXIS:REFerence?", 0, "1"),
        ("AXIS:POSition?", 0, "0.0000,0.0000"),
    ],
    "it moves": [
        ("AXIS:HOME", 10, ""),
        ("AXIS:POSition 90,180", 0, ""),
        ("AXIS:POSition?", 3.5, "0.0000,0.0000"),
        ("axis:pos?;mov?", 3.5, "45.0000,90.0000;1"),
        ("AXIS:POS?;MOV?", 0, "90.0000,180.0000;0"),
        ("SYSTem:ERRor?", 0, '0,"No error"'),
    ],
}


@pytest.mark.parametrize("dialogue", DIALOGUES.values(), ids=DIALOGUES)
def test_the_stand_answers_as_its_manual_says(dialogue):
    bench = Bench()
    for sent, wait, answer in dialogue:
        assert (sent, told(bench.stand, sent)) == (sent, answer)
        bench.wait(wait)
