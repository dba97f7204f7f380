"""``driftbook simdevice serve`` as a process: its one line, its end, and what it measures when started again."""

import re
import signal
import socket
import subprocess
import sys
from contextlib import contextmanager
from datetime import UTC, datetime, timedelta

import numpy as np
import pyarrow.parquet as pq
import pytest

READY = re.compile(
    r"listening: stand TCPIP0::127\.0\.0\.1::(\d+)::SOCKET ammeter TCPIP0::127\.0\.0\.1::(\d+)::SOCKET\n"
)
BRIEF = ("--stand-port", "0", "--ammeter-port", "0", "--speed", "1000")


@contextmanager
def serving(*arguments):
    """The process and its two ports."""
    command = [sys.executable, "-m", "app", "simdevice", "serve", *BRIEF, *arguments]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        try:
            ready = READY.fullmatch(process.stdout.readline())
            assert ready, process.communicate()
            yield process, *map(int, ready.groups())
        finally:
            process.kill()


def told(port, *lines):
    """Answers to lines, of which each has one line of answer."""
    with socket.create_connection(("127.0.0.1", port), timeout=20) as connection:
        stream = connection.makefile("rwb")
        answers = []
        for line in lines:
            stream.write(line.encode() + b"\n")
            stream.flush()
            answers.append(stream.readline().decode().strip())
        stream.close()
    return answers


def block(port, first, most):
    with socket.create_connection(("127.0.0.1", port), timeout=20) as connection:
        connection.sendall(f"FETC:BLOC? {first},{most}\n".encode())
        stream = connection.makefile("rb")
        length = int(stream.read(int(stream.read(2)[1:])))
        contents = stream.read(length)
        stream.close()
    return contents


@pytest.mark.parametrize("ending", ["SIGINT", "SIGTERM"])
def test_it_says_where_it_listens_and_ends_cleanly(ending):
    with serving("--seed", "5") as (process, stand, ammeter):
        assert told(stand, "*IDN?")[0].startswith("Driftbook,SIM-STAND,5,")
        assert told(ammeter, "*IDN?")[0].startswith("Driftbook,SIM-AMMETER,5,")
        process.send_signal(getattr(signal, ending))
        out, err = process.communicate(timeout=20)
        assert (process.returncode, out, err) == (0, "", "")


def test_it_ends_silently_with_a_client_on_the_line():
    with (
        serving() as (process, stand, _),
        socket.create_connection(("127.0.0.1", stand), timeout=20) as client,
    ):
        client.sendall(b"*IDN?\n")
        assert client.recv(1000).startswith(b"Driftbook,SIM-STAND")
        process.send_signal(signal.SIGTERM)
        out, err = process.communicate(timeout=20)
        assert (process.returncode, out, err) == (0, "", "")


def test_a_restarted_process_measures_the_same():
    """Killing an instrument's process does not power the gyro down, and keeps no state."""
    powered_on = (datetime.now(UTC) - timedelta(minutes=5)).isoformat()
    arguments = ("--scenario", "full-noise", "--seed", "5", "--powered-on", powered_on)
    found = []
    for _ in range(2):
        with serving(*arguments) as (_, stand, ammeter):
            assert told(stand, "AXIS:HOME;*OPC?", "AXIS:POS 90,180;*OPC?") == ["1", "1"]
            assert told(ammeter, "ACQ:COUN 2000;TAKE 1;:INIT;*OPC?") == ["1"]
            found.append(block(ammeter, 0, 2000))
    assert len(found[0]) == 2000 * 32
    assert found[0] == found[1]


def test_a_record_is_that_of_a_session_simulated_with_the_same_words(tmp_path, driftbook):
    same = ("--scenario", "full-noise", "--seed", "5", "--duration", "3", "--rate", "100")
    assert driftbook("simulate", "--out", tmp_path / "day", "--format", "parquet", *same).code == 0
    (file,) = (tmp_path / "day").rglob("*090_psi180*.parquet")
    with serving(*same) as (_, stand, ammeter):
        assert told(stand, "AXIS:HOME;*OPC?", "AXIS:POS 90,180;*OPC?") == ["1", "1"]
        assert told(ammeter, "INIT;*OPC?;:ACQ:STAT?") == ["1;DONE,0,300,0"]
        served = np.frombuffer(block(ammeter, 0, 300), "<f8").reshape(-1, 4)
    table = pq.read_table(file)
    # Ampere and milliampere: one rounding.
    for column, name in ((2, "jx_ma"), (3, "jy_ma")):
        np.testing.assert_allclose(served[:, column] * 1e3, table[name].to_numpy(), rtol=1e-15)
    np.testing.assert_array_equal(served[:, 1], table["t_s"].to_numpy())


def test_a_fault_on_request():
    with serving("--fault", "lost-reference@0/90", "--fault", "spike") as (_, stand, _):
        assert told(stand, "AXIS:HOME;*OPC?;REF?", "AXIS:POS 0,90;*OPC?;REF?") == ["1;1", "1;0"]


def test_the_latitude_is_the_stands():
    currents = []
    for latitude in ("90", "0"):
        with serving("--scenario", "quiet", "--latitude", latitude) as (_, _, ammeter):
            currents.append(float(told(ammeter, "MEAS:CURR?")[0].split(",")[1]))
    # The base's north is the case's y: at the equator it has all of 7.3e-5 rad/s more, over 9.9 rad/(s·A).
    assert currents[1] - currents[0] == pytest.approx(
        7.292e-5 / 9.9, rel=1e-2
    )  # angles of 15″, cross-coupling


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("--scenario", "nowhere"), "There is no scenario nowhere."),
        (("--fault", "fire"), "There is no fault fire"),
        (("--fault", "stall@45/0"), "no position"),
        (("--powered-on", "yesterday"), "“yesterday” is no moment"),
        (("--powered-on", "2999-01-01"), "in the future"),
        (("--host", "203.0.113.1"), "cannot listen on 203.0.113.1"),
        (("--speed", "0"), "--speed"),
    ],
)
def test_what_cannot_be_served_is_said(driftbook, arguments, said):
    outcome = driftbook("simdevice", "serve", *BRIEF, *arguments)
    assert outcome.code == 2
    assert said in outcome.err
    assert outcome.out == ""


def test_a_port_that_is_taken_is_said_and_signals_mean_what_they_meant(driftbook):
    before = signal.getsignal(signal.SIGINT)
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        outcome = driftbook("simdevice", "serve", *BRIEF, "--ammeter-port", taken.getsockname()[1])
    assert outcome.code == 2
    assert "--ammeter-port" in outcome.err
    assert signal.getsignal(signal.SIGINT) is before
