"""Bytes on the wire, and every way in which a connection breaks."""

import socket
import subprocess
import sys
import threading
import time

import pytest
from scripted import WAITS_S, Cut, Peer

from app.station.contracts import InstrumentLost
from app.station.instruments.visa import Connection, Instrument, Unanswered

SHORT_S = 0.3  # long enough for an answer on a busy machine's own network, which takes about a millisecond


def of(peer: Peer, **changes) -> Instrument:
    return Instrument(Connection("stand", peer.address, timeout_s=changes.pop("timeout_s", 5.0), **changes))


def test_a_line_is_sent_with_its_end_and_an_answer_comes_without():
    with Peer((b"AXIS:HOME", b""), (b"*IDN?", b"Maker,Model,7,1.0\n")) as peer:
        instrument = of(peer)
        instrument.write("AXIS:HOME")
        assert instrument.ask("*IDN?") == "Maker,Model,7,1.0"
        instrument.close()
    assert peer.clients == 1


@pytest.mark.parametrize(("sent_end", "read_end"), [("\r", "\r"), ("\r\n", "\r\n"), (";", "#")])
def test_lines_end_as_the_description_says(sent_end, read_end):
    with Peer(
        (b"?POS", b"+090.000" + read_end.encode()), (b"?POS", b"1" + read_end.encode()), end=sent_end.encode()
    ) as peer:
        instrument = of(peer, write_termination=sent_end, read_termination=read_end)
        assert instrument.ask("?POS") == "+090.000"
        assert instrument.ask("?POS") == "1"
        instrument.close()


def test_a_block_may_hold_what_ends_a_line_elsewhere():
    content = bytes(range(256)) * 40  # beyond the 4096 bytes that come at once
    with Peer((b"DATA?", b"#510240" + content + b"\n"), (b"DATA?", b"#10\n"), (b"*OPC?", b"1\n")) as peer:
        instrument = of(peer)
        assert instrument.ask_block("DATA?") == content
        assert instrument.ask_block("DATA?") == b""
        assert instrument.ask("*OPC?") == "1"  # the next answer begins where the block ended
        instrument.close()


@pytest.mark.parametrize("answer", [b"12,13\n", b"#0123\n", b"#2xx\n", b"#11ab\n"])
def test_what_is_no_block_is_said_and_the_connection_given_up(answer):
    with Peer((b"DATA?", answer), (b"*OPC?", b"1\n")) as peer:
        instrument = of(peer)
        with pytest.raises(
            InstrumentLost, match=r"\[stand\] at TCPIP0::127.0.0.1::\d+::SOCKET answered DATA\? by"
        ):
            instrument.ask_block("DATA?")
        assert instrument.closed
        assert instrument.ask("*OPC?") == "1"
        instrument.close()
    assert peer.clients == 2


def test_silence_is_told_with_what_was_asked_and_leaves_the_choice_to_the_caller():
    with Peer((b"AXIS:POS?", b"")) as peer:
        instrument = of(peer, timeout_s=SHORT_S)
        with pytest.raises(Unanswered, match=r"did not answer AXIS:POS\? within 0.3 s"):
            instrument.ask("AXIS:POS?")
        assert not instrument.closed
        instrument.close()


@pytest.mark.parametrize("said", [b"", b"#", b"#3100", b"#3100abc"])
def test_a_block_that_is_cut_is_told_as_such_at_once_and_the_next_use_opens_another(said):
    """And not after the timeout, which is ten seconds."""
    with Peer((b"DATA?", Cut(said)), (b"DATA?", b"#13abc\n")) as peer:
        instrument = of(peer, timeout_s=WAITS_S)
        begun = time.monotonic()
        with pytest.raises(InstrumentLost, match=r"broke at DATA\? \(closed at the other end\)"):
            instrument.ask_block("DATA?")
        assert time.monotonic() - begun < WAITS_S / 2
        assert instrument.closed
        assert instrument.ask_block("DATA?") == b"abc"
        instrument.close()
    assert peer.clients == 2


@pytest.mark.parametrize("said", [b"", b"12.3"])
def test_a_line_that_is_cut_is_no_answer(said):
    with Peer((b"AXIS:POS?", Cut(said)), (b"AXIS:POS?", b"12.34\n")) as peer:
        instrument = of(peer, timeout_s=WAITS_S)
        begun = time.monotonic()
        with pytest.raises(InstrumentLost, match=r"broke at AXIS:POS\? \(closed at the other end\)"):
            instrument.ask("AXIS:POS?")
        assert time.monotonic() - begun < WAITS_S / 2
        assert instrument.ask("AXIS:POS?") == "12.34"
        instrument.close()


def test_an_instrument_that_went_away_between_two_questions_is_lost_at_once():
    """And not after the timeout, which is ten seconds."""
    with Peer((b"*IDN?", Cut(b"Maker\n")), (b"*IDN?", b"Maker\n")) as peer:
        instrument = of(peer, timeout_s=WAITS_S)
        assert instrument.ask("*IDN?") == "Maker"
        time.sleep(0.2)  # until the news has arrived here, from this same machine
        begun = time.monotonic()
        with pytest.raises(InstrumentLost, match=r"broke at \*IDN\? \(closed at the other end\)"):
            instrument.ask("*IDN?")
        assert time.monotonic() - begun < WAITS_S / 2
        assert instrument.ask("*IDN?") == "Maker"
        instrument.close()


def test_nobody_there_is_lost():
    with socket.create_server(("127.0.0.1", 0)) as server:
        address = f"TCPIP0::127.0.0.1::{server.getsockname()[1]}::SOCKET"
    instrument = Instrument(Connection("ammeter", address, timeout_s=SHORT_S))
    with pytest.raises(InstrumentLost, match=r"\[ammeter\]"):
        instrument.ask("*IDN?")
    instrument.close()


@pytest.mark.parametrize("address", ["nonsense", "TCPIP0::127.0.0.1::SOCKET"])
def test_an_address_that_is_none_says_so(address):
    with pytest.raises(
        InstrumentLost, match=r"\[stand\] cannot be reached at .*address in the station's file"
    ):
        Instrument(Connection("stand", address)).open()


def test_an_attribute_that_the_connection_has_not_is_named():
    with Peer() as peer:
        instrument = of(peer, attributes={"VI_ATTR_ASRL_BAUD": 9600})
        with pytest.raises(InstrumentLost, match="VI_ATTR_ASRL_BAUD"):
            instrument.open()


def test_closing_twice_is_once():
    with Peer((b"A", b"")) as peer:
        instrument = of(peer)
        instrument.close()
        instrument.write("A")
        instrument.close()
        instrument.close()


def test_threads_do_not_mix_their_answers():
    """Eight threads ask for their own number; the peer answers any line by itself, late."""

    def echo(server: socket.socket) -> None:
        client, _ = server.accept()
        with client:
            for line in client.makefile("rb"):
                time.sleep(0.001)
                client.sendall(line)

    with socket.create_server(("127.0.0.1", 0)) as server:
        peer = threading.Thread(target=echo, args=(server,))
        peer.start()
        instrument = Instrument(Connection("stand", f"TCPIP0::127.0.0.1::{server.getsockname()[1]}::SOCKET"))
        wrong = []

        def ask(number: int) -> None:
            for turn in range(20):
                asked = f"{number}.{turn}"
                if (answered := instrument.ask(asked)) != asked:
                    wrong.append((asked, answered))

        threads = [threading.Thread(target=ask, args=(number,)) for number in range(8)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        instrument.close()
        peer.join()
    assert not wrong


def test_the_library_is_imported_only_when_an_instrument_is_used():
    """It takes half a second, which a command that only describes or solves shall not wait for."""
    script = "import sys, app.station.instruments.opening; sys.exit('pyvisa' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", script], check=False).returncode == 0
