"""The ammeter by its bytes, as a manual would print them: what is sent, what is answered, seconds to wait then."""

import struct

import numpy as np
import pytest

from simdevice.scpi.instrument import HangUp
from tests.simdevice.instruments import Bench, rows, told, told_raw

OK = '0,"No error"'
MOVES = '-221,"Settings conflict;the stand moves, and a record is of steady currents"'
BETWEEN = '-221,"Settings conflict;the stand is between its positions, and a record is of a position"'

DIALOGUES = {
    "identity": [("*IDN?", "Driftbook,SIM-AMMETER,7,1.0", 0)],
    "settings": [
        ("SENSe:RATE?;:ACQuire:COUNt?;TAKE?;LABel?", "200;12000;0;0", 0),
        ("SENSe:RATE 250 HZ;:ACQuire:COUNt 500;TAKE 2;LABel 17", "", 0),
        ("SENS:RATE?;:ACQ:COUN?;TAKE?;LAB?;:SYST:ERR?", "250;500;2;17;" + OK, 0),
        ("*RST;:SENS:RATE?;:ACQ:COUN?;TAKE?;LAB?", "200;12000;0;0", 0),
        ("SENS:RATE 0.5", "", 0),
        ("SYST:ERR?", '-222,"Data out of range;0.5 is not from 1 to 20000"', 0),
        ("ACQ:COUN 0", "", 0),
        ("SYST:ERR?", '-222,"Data out of range;0 is not from 1 to 1e+06"', 0),
    ],
    "an acquisition": [
        ("ACQuire:STATe?", "IDLE,0,0,0", 0),
        ("SENSe:RATE 200;:ACQuire:COUNt 400;TAKE 0;LABel 5", "", 0),
        ("INITiate", "", 0),
        ("ACQuire:STATe?", "RUN,5,0,0", 0.5),
        ("ACQ:STAT?", "RUN,5,100,0", 1.4975),
        ("ACQ:STAT?", "RUN,5,399,0", 0.0025),
        ("ACQ:STAT?", "DONE,5,400,0", 1000),
        ("ACQ:STAT?", "DONE,5,400,0", 0),
        ("ACQ:LAB 6;STAT?", "DONE,5,400,0", 0),
        ("*RST;:ACQ:STAT?", "IDLE,0,0,0", 0),
    ],
    "a second acquisition waits for the first, or for ABORt": [
        ("ACQ:COUN 400;LAB 1;:INIT", "", 1),
        ("ACQ:LAB 2;:INIT;:SYST:ERR?", '-213,"Init ignored;an acquisition runs: ABORt it first"', 0),
        ("ACQ:STAT?", "RUN,1,200,0", 0),
        ("ABORt;:ACQ:STAT?", "DONE,1,200,0", 10),
        ("ACQ:STAT?", "DONE,1,200,0", 0),
        ("INIT;:ACQ:STAT?;:SYST:ERR?", "RUN,2,0,0;" + OK, 0),
    ],
    "nothing to fetch": [
        ("FETCh:BLOCk? 0,10", "", 0),
        ("SYST:ERR?", '-230,"Data corrupt or stale;nothing was acquired: INITiate first"', 0),
        ("INIT", "", 0),
        ("FETCh:BLOCk? 0,10", "#10", 0.005),
        ("FETCh:BLOCk? 1,10", "#10", 0),
        ("FETCh:BLOCk? 5", "", 0),
        ("SYST:ERR?", '-109,"Missing parameter;FETCh:BLOCk? takes 2"', 0),
        ("FETCh:BLOCk? -1,5;:SYST:ERR?", '-222,"Data out of range;-1 is not from 0 to 1e+06"', 0),
    ],
    "conditions and registers": [
        ("*CLS;*ESE 1;*SRE 32;:STAT:OPER:COND?", "0", 0),
        ("ACQ:COUN 200;:INIT;*OPC;:STAT:OPER:COND?", "16", 0.9),
        ("*STB?;*ESR?", "0;0", 0.1),
        ("STAT:OPER:COND?;*STB?", "0;112", 0),
        ("*STB?;*ESR?", "96;1", 0),
        ("STAT:OPER?;:STAT:QUES?", "16;0", 0),
    ],
}  # fmt: skip


@pytest.mark.parametrize("dialogue", DIALOGUES.values(), ids=DIALOGUES)
def test_the_ammeter_answers_as_its_manual_says(dialogue):
    bench = Bench()
    for sent, answer, wait in dialogue:
        assert (sent, told(bench.ammeter, sent)) == (sent, answer)
        bench.wait(wait)


def test_a_reading_is_both_currents_in_ampere():
    answer = told(Bench("quiet").ammeter, "MEASure:CURRent?")
    jx, jy = answer.split(",")
    # Mantissa with nine decimals, exponent of two digits at least: 1.234567890E-06.
    assert len(jx.lstrip("-")) == len(jy.lstrip("-")) == 15
    assert 1e-8 < abs(float(jx)) < 1e-4


def test_a_block_is_rows_of_four_little_endian_numbers():
    bench = Bench()
    told(bench.ammeter, "ACQ:COUN 30;:INIT")
    bench.wait(1)
    answer = told_raw(bench.ammeter, "FETC:BLOC? 10,2")
    assert answer[:4] == b"#264"
    assert len(answer) == 4 + 64 + 1
    assert answer[-1:] == b"\n"
    index, t, jx, jy = struct.unpack("<4d", answer[4:36])
    assert (index, t) == (10.0, 10 / 200)
    # 1 nA steps: readings are whole nanoampere.
    assert jx * 1e9 == pytest.approx(round(jx * 1e9), abs=1e-6)
    assert struct.unpack("<4d", answer[36:68])[0] == 11.0
    assert rows(told_raw(bench.ammeter, "FETC:BLOC? 10,1")).tolist() == [[index, t, jx, jy]]


@pytest.mark.parametrize("size", [1, 7, 50, 51, 1000])
def test_blocks_of_any_size_give_the_same_samples_while_it_runs_and_after(size):
    bench = Bench()
    told(bench.ammeter, "ACQ:COUN 50;:INIT")
    running = []
    for _ in range(60):
        block = rows(told_raw(bench.ammeter, f"FETC:BLOC? {len(running)},{size}"))
        assert len(block) <= size
        running.extend(block.tolist())
        bench.wait(size / 200)
    assert [row[0] for row in running] == list(range(50))
    assert rows(told_raw(bench.ammeter, "FETC:BLOC? 0,50")).tolist() == running


def test_no_acquisition_while_the_stand_moves_or_stands_anywhere():
    bench = Bench()
    told(bench.stand, "AXIS:HOME")
    assert told(bench.ammeter, "INIT;:SYST:ERR?") == MOVES
    bench.wait(10)
    assert told(bench.ammeter, "INIT;:SYST:ERR?;:ABOR") == OK
    told(bench.stand, "AXIS:POS 90,0")
    bench.wait(2)
    told(bench.stand, "ABOR")
    assert told(bench.ammeter, "INIT;:SYST:ERR?") == BETWEEN
    assert told(bench.ammeter, "ACQ:STAT?") == "DONE,0,0,0"


@pytest.mark.parametrize("move", ["AXIS:POS 90,0", "AXIS:HOME"])
def test_a_movement_spoils_the_rest_of_an_acquisition(move):
    undisturbed = Bench()
    undisturbed.moved(0, 0)
    whole = undisturbed.acquired(400)
    bench = Bench()
    bench.moved(0, 0)
    told(bench.ammeter, "ACQ:COUN 400;:INIT")
    bench.wait(1)
    told(bench.stand, move)
    assert told(bench.ammeter, "ACQ:STAT?") == "RUN,0,200,0"
    bench.wait(0.005)
    assert told(bench.ammeter, "ACQ:STAT?;:STAT:QUES:COND?") == "RUN,0,201,1;2"
    bench.wait(1)
    found = rows(told_raw(bench.ammeter, "FETC:BLOC? 0,400"))
    assert np.array_equal(found[:200], whole[:200])
    assert np.array_equal(found[:, :2], whole[:, :2])
    # 30 °/s over 10 rad/(s·A) is 52 mA, and the ammeter's limit is 1 mA.
    assert (found[200:, 2:] == 1e-3).all()


def test_a_sample_at_the_limit_is_an_overload_once_it_is_there():
    bench = Bench(faults=["saturation@0/0"])
    record = bench.acquired(12_000)
    at_limit = np.flatnonzero(np.abs(record[:, 2:]).max(axis=1) >= 1e-3)
    assert told(bench.ammeter, "ACQ:STAT?") == "DONE,0,12000,1"
    told(bench.ammeter, "INIT")
    bench.wait(at_limit[0] / 200)
    assert told(bench.ammeter, "ACQ:STAT?") == f"RUN,0,{at_limit[0]},0"
    bench.wait(1 / 200)
    assert told(bench.ammeter, "ACQ:STAT?;:STAT:QUES:COND?") == f"RUN,0,{at_limit[0] + 1},1;2"


def test_a_reading_at_the_limit_is_an_overload():
    bench = Bench()
    told(bench.stand, "AXIS:HOME")
    assert told(bench.ammeter, "MEAS:CURR?;:STAT:QUES:COND?") == "1.000000000E-03,1.000000000E-03;2"
    bench.wait(10)
    told(bench.ammeter, "MEAS:CURR?")
    assert told(bench.ammeter, "STAT:QUES:COND?;:STAT:QUES?") == "0;2"


def test_dropped_samples_leave_a_gap_in_time_and_none_in_the_numbers():
    bench = Bench(faults=["dropped@0/0"])
    record = bench.acquired(12_000)
    assert np.array_equal(record[:, 0], np.arange(len(record)))
    gaps = np.diff(record[:, 1])
    assert len(record) < 12_000
    assert gaps.max() > 0.01
    assert (np.abs(gaps - 0.005) < 1e-9).sum() == len(gaps) - 1
    assert told(bench.ammeter, "ACQ:STAT?") == f"DONE,0,{len(record)},0"


@pytest.mark.parametrize(("fault", "takes"), [("interrupted@0/0", [0]), ("interrupted@0/0!", [0, 1])])
def test_the_connection_breaks_once_for_a_take_in_the_middle_of_a_block(fault, takes):
    bench = Bench(faults=[fault])
    for take in (0, 1):
        told(bench.ammeter, f"ACQ:TAKE {take};COUN 100;:INIT")
        assert told(bench.ammeter, "FETC:BLOC? 0,100") == "#10"
        bench.wait(1)
        if take in takes:
            with pytest.raises(HangUp) as broken:
                told(bench.ammeter, "FETC:BLOC? 0,50")
            # "#41600" and 1600 bytes are 1606.
            assert broken.value.sent[:6] == b"#41600"
            assert len(broken.value.sent) == 803
        assert len(rows(told_raw(bench.ammeter, "FETC:BLOC? 0,100"))) == 100


def test_a_record_too_short_for_its_fault_is_refused():
    bench = Bench(faults=["spike@0/0"], duration=1.0)
    assert told(bench.ammeter, "SENS:RATE 10;:INIT;:SYST:ERR?").startswith('-221,"Settings conflict;A record')
