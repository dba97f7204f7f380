"""A stand and an ammeter that speak quite differently are driven by another file alone; bytes as in a manual."""

import numpy as np
import pytest
from scripted import Peer

from app.station.contracts import EmergencyStop, InstrumentFault, InstrumentLost, Place
from app.station.instruments.description import read_station
from app.station.instruments.opening import open_ammeter, open_stand

OTHER = r"""
[stand]
address = "STAND"
write_termination = "\r"
read_termination = "\r"
timeout_s = 0.5
identity = 'ROTARY 2000 .*'
[stand.commands]
identify = { send = "?VER", answer = '(?P<identity>.*)' }
home = ["REF 1", "REF 2"]
move = ["MOV 1,{theta_deg:.0f}", "MOV 2,{psi_arcsec:.0f}"]
stop = "HALT"
status = [
    { send = "?POS", answer = '(?P<theta>[^,]+),(?P<psi>[^,]+)', units = { theta = "deg", psi = "arcmin" } },
    { send = "?FLAGS", answer = 'H(?P<homed>[01]) E(?P<emergency_stop>OK|STOP)', yes = '1|STOP' },
]
[stand.limits]
theta_deg = [-5, 365]
psi_deg = [-185, 185]
arrival_deg = 0.02
rest_deg = 0.002
[stand.times]
homing_s = 10
moving_s = 20

[ammeter]
address = "AMMETER"
write_termination = "\r\n"
read_termination = "\r\n"
timeout_s = 0.5
identity = 'PICO 2'
[ammeter.commands]
identify = { send = "ID?", answer = '(?P<identity>.*)' }
reading = [
    { send = "X?", answer = 'X=(?P<jx>.*)', unit = "uA" },
    { send = "Y?", answer = 'Y=(?P<jy>.*)', unit = "uA" },
]
start = { send = "GO N={samples:06d} DT={interval_s:.4f}", answer = "OK" }
status = [
    { send = "N?", answer = '(?P<samples>\d+) (?P<running>BUSY|READY)', yes = "BUSY" },
    { assume = { overload = false } },
]
fetch = [
    { send = "X {first_from_one},{last_from_one}", columns = ["jx"], unit = "uA", separator = ";" },
    { send = "Y {first_from_one},{last_from_one}", columns = ["jy"], unit = "uA", separator = ";" },
]
stop = "END"
errors = { send = "ERR?", answer = '(?P<text>.*)', none = "NONE" }
[ammeter.limits]
largest_ma = 0.2

[settling]
window_s = 2
limit_na_per_s = 50
[warm_up]
window_s = 300
limit_na_per_s = 0.02
"""
VERSION = (b"?VER", b"ROTARY 2000 v7\r")
FREE = (b"?FLAGS", b"H1 EOK\r")
ID = (b"ID?", b"PICO 2\r\n")
NO_ERROR = (b"ERR?", b"NONE\r\n")


def stand_of(peer: Peer):
    return open_stand(read_station(OTHER.replace("STAND", peer.address, 1).encode(), "other.toml").stand)


def ammeter_of(peer: Peer):
    return open_ammeter(
        read_station(OTHER.replace("AMMETER", peer.address, 1).encode(), "other.toml").ammeter
    )


def test_the_stand_is_sent_axis_by_axis_within_its_travel():
    script = (
        VERSION,
        (b"?POS", b"+090.000,+180.000\r"), FREE, (b"MOV 1,90", b""), (b"MOV 2,648000", b""),
        (b"?POS", b"+090.000,+10800.0\r"), FREE, (b"MOV 1,180", b""), (b"MOV 2,-324000", b""),  # 270° is −90° here
    )  # fmt: skip
    with Peer(*script, end=b"\r") as peer:
        stand = stand_of(peer)
        stand.move(Place(90.0, 180.0))
        stand.move(Place(180.0, 270.0))
        stand.close()


def test_its_encoders_tell_whether_it_moves_and_read_near_the_commanded_angle():
    script = (
        VERSION,
        (b"?POS", b"+000.000,+00000.0\r"), FREE, (b"MOV 1,0", b""), (b"MOV 2,-324000", b""),
        (b"?POS", b"+000.000,-02700.0\r"), FREE,
        (b"?POS", b"+000.000,-05399.9\r"), FREE,
        (b"?POS", b"+359.999,-05399.9\r"), FREE,
    )  # fmt: skip
    with Peer(*script, end=b"\r") as peer:
        stand = stand_of(peer)
        stand.move(Place(0.0, 270.0))
        assert stand.status().moving  # the first look after the command tells nothing yet
        assert stand.status().moving  # 45° in between
        status = stand.status()
        assert not status.moving
        # −5399.9′ are −89.99833°, which is 270.00167°; and 359.999° are 0.001° before the 0° commanded.
        assert status.place == pytest.approx((-0.001, 270.0 + 0.1 / 60.0), abs=1e-9)
        stand.close()


def test_its_emergency_stop_is_a_word():
    with Peer(VERSION, (b"?POS", b"+0,+0\r"), (b"?FLAGS", b"H1 ESTOP\r"), end=b"\r") as peer:
        stand = stand_of(peer)
        with pytest.raises(EmergencyStop):
            stand.move(Place(0.0, 0.0))
        stand.close()


def test_homing_takes_two_commands_and_stopping_one():
    script = (VERSION, (b"?POS", b"+0,+0\r"), FREE, (b"REF 1", b""), (b"REF 2", b""), (b"HALT", b""))
    with Peer(*script, end=b"\r") as peer:
        stand = stand_of(peer)
        stand.home()
        stand.stop()
        stand.close()


def test_it_cannot_be_released_from_here():
    with Peer(end=b"\r") as peer, pytest.raises(InstrumentFault, match="no command “release”"):
        stand_of(peer).release()


def test_the_ammeter_reads_in_microamperes_channel_by_channel():
    with Peer(ID, (b"X?", b"X=-4.5361\r\n"), (b"Y?", b"Y=+1.2e1\r\n"), NO_ERROR, end=b"\r\n") as peer:
        ammeter = ammeter_of(peer)
        assert ammeter.reading() == (-0.0045361, 0.012)  # decimals are shifted exactly
        ammeter.close()


def test_it_acquires_without_label_or_take_and_its_samples_come_as_two_lines():
    script = (
        ID,
        (b"GO N=000003 DT=0.0050", b"OK\r\n"), NO_ERROR,
        (b"N?", b"2 BUSY\r\n"), NO_ERROR,
        (b"X 2,3", b"-1.5;-1.6\r\n"), (b"Y 2,3", b"2.5;2.6\r\n"), NO_ERROR,
        (b"END", b""), NO_ERROR,
    )  # fmt: skip
    with Peer(*script, end=b"\r\n") as peer:
        ammeter = ammeter_of(peer)
        ammeter.start(label=5, take=1, samples=3, rate_hz=200.0)
        status = ammeter.status()
        assert (status.label, status.running, status.samples, status.overload) == (None, True, 2, False)
        block = ammeter.fetch(1, 2)
        assert block.first == 1
        assert np.array_equal(block.t_s, [0.005, 0.01])  # by the rate that was asked for
        assert np.array_equal(block.jx_ma, [-0.0015, -0.0016])
        assert np.array_equal(block.jy_ma, [0.0025, 0.0026])
        ammeter.stop()
        ammeter.close()


def test_samples_of_an_acquisition_of_somebody_else_have_no_time():
    with Peer(ID, (b"X 1,1", b"1\r\n"), (b"Y 1,1", b"1\r\n"), NO_ERROR, end=b"\r\n") as peer:
        ammeter = ammeter_of(peer)
        with pytest.raises(InstrumentFault, match="does not tell the time"):
            ammeter.fetch(0, 1)
        ammeter.close()


@pytest.mark.parametrize(
    "answers", [(b"1;2\r\n", b"1\r\n"), (b"1;2;3\r\n", b"1;2;3\r\n")], ids=["uneven", "too many"]
)
def test_samples_that_were_not_asked_for_are_refused(answers):
    x, y = answers
    with Peer(ID, (b"X 1,2", x), (b"Y 1,2", y), NO_ERROR, end=b"\r\n") as peer:
        ammeter = ammeter_of(peer)
        with pytest.raises(InstrumentFault, match="asked for 2 samples from number 0"):
            ammeter.fetch(0, 2)
        ammeter.close()


def test_its_errors_are_told_in_its_own_words_all_of_them():
    script = (ID, (b"END", b""), (b"ERR?", b"FUSE X\r\n"), (b"ERR?", b"FUSE Y\r\n"), NO_ERROR)
    with Peer(*script, end=b"\r\n") as peer:
        ammeter = ammeter_of(peer)
        with pytest.raises(InstrumentFault, match=r"\[ammeter\] reports after END: FUSE X; FUSE Y\."):
            ammeter.stop()
        ammeter.close()


@pytest.mark.parametrize("answer", [b"X=four\r\n", b"Y=1\r\n", b"X=NaN\r\n", b"\r\n"])
def test_an_answer_that_does_not_fit_is_shown_and_the_connection_begun_anew(answer):
    good = (b"X?", b"X=1\r\n"), (b"Y?", b"Y=1\r\n"), NO_ERROR
    with Peer(ID, (b"X?", answer), ID, *good, end=b"\r\n") as peer:
        ammeter = ammeter_of(peer)
        with pytest.raises(InstrumentFault, match=r"answered X\? by “.*”, which does not fit"):
            ammeter.reading()
        assert ammeter.reading() == (0.001, 0.001)
        ammeter.close()
    assert peer.clients == 2


def test_silence_is_asked_for_its_reason_on_the_same_connection():
    refused = (b"X?", b""), (b"ERR?", b"RANGE\r\n"), NO_ERROR
    with Peer(ID, *refused, end=b"\r\n") as peer:
        ammeter = ammeter_of(peer)
        with pytest.raises(InstrumentFault, match=r"after X\?: RANGE"):
            ammeter.reading()
        ammeter.close()


@pytest.mark.parametrize("why", [b"NONE\r\n", b""], ids=["no error", "silent too"])
def test_silence_without_a_reason_is_a_lost_instrument_and_the_next_use_connects_anew(why):
    good = (b"X?", b"X=1\r\n"), (b"Y?", b"Y=1\r\n"), NO_ERROR
    with Peer(ID, (b"X?", b""), (b"ERR?", why), ID, *good, end=b"\r\n") as peer:
        ammeter = ammeter_of(peer)
        with pytest.raises(InstrumentLost, match=r"did not answer X\? within 0.5 s"):
            ammeter.reading()
        assert ammeter.reading() == (0.001, 0.001)
        ammeter.close()
    assert peer.clients == 2


def test_an_instrument_that_was_exchanged_behind_its_address_is_found_out():
    with Peer((b"ID?", b"PICO 3\r\n"), ID, (b"END", b""), NO_ERROR, end=b"\r\n") as peer:
        ammeter = ammeter_of(peer)
        with pytest.raises(InstrumentFault, match=r"says that it is “PICO 3”, where “PICO 2” is expected"):
            ammeter.stop()
        ammeter.stop()
        ammeter.close()
