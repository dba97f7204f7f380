"""Instruments on real sockets: many clients, broken ones, and garbage."""

import asyncio
import contextlib
import time
from collections.abc import Iterator

import numpy as np
import pytest
import pyvisa

from simdevice.ammeter_device import AmmeterDevice
from simdevice.clock import Clock
from simdevice.faults import parse
from simdevice.laboratory import Laboratory
from simdevice.scenarios import scenario
from simdevice.scpi.instrument import Instrument
from simdevice.serving import LONGEST_MESSAGE, listening
from simdevice.stand_device import StandDevice
from tests.simdevice.instruments import rows

OK = b'0,"No error"\n'
PATIENCE_S = 20


def instruments(speed=1000.0, faults=()):
    clock = Clock(time.time(), speed)
    laboratory = Laboratory(scenario("gvk-6").bench(7), clock, [parse(text) for text in faults])
    return [
        Instrument(StandDevice(laboratory, "House,STAND,7,1")),
        Instrument(AmmeterDevice(laboratory, "House,AMMETER,7,1")),
    ]


def served(visit, **arrangement):
    """Run `visit(stand port, ammeter port)` beside the instruments."""

    async def run():
        async with listening(instruments(**arrangement), "127.0.0.1", [0, 0]) as ports, clients():
            return await asyncio.wait_for(visit(*ports), PATIENCE_S)

    return asyncio.run(run())


OPENED = []


@contextlib.asynccontextmanager
async def clients():
    """Closes the connections that were opened."""
    try:
        yield
    finally:
        for client in OPENED:
            client.writer.transport.abort()
        OPENED.clear()
        await asyncio.sleep(0)  # the loop closes the sockets in its next round


class Client:
    """A connection, line by line."""

    def __init__(self, reader, writer) -> None:
        self.reader, self.writer = reader, writer
        OPENED.append(self)

    @classmethod
    async def to(cls, port):
        return cls(*await asyncio.open_connection("127.0.0.1", port))

    async def send(self, raw: bytes) -> None:
        self.writer.write(raw)
        await self.writer.drain()

    async def ask(self, raw: bytes) -> bytes:
        await self.send(raw + b"\n")
        return await self.reader.readline()

    async def ask_block(self, raw: bytes) -> np.ndarray:
        await self.send(raw + b"\n")
        head = await self.reader.readexactly(2)
        length = await self.reader.readexactly(int(head[1:]))
        return rows(head + length + await self.reader.readexactly(int(length) + 1))


def test_lines_are_answered_in_their_order():
    async def visit(stand, ammeter):
        client = await Client.to(stand)
        await client.send(b"*IDN?\r\nAXIS:REF?\n\n \nAXIS:MO")
        assert await client.reader.readline() == b"House,STAND,7,1\n"
        assert await client.reader.readline() == b"0\n"
        assert await client.ask(b"V?") == b"0\n"
        assert await client.ask(b"SYST:ERR?") == OK

    served(visit)


def test_many_clients_each_get_their_own_answers():
    async def one(port, mask):
        client = await Client.to(port)
        for turn in range(30):
            # A message is executed whole: nobody comes between setting and asking.
            number = (mask + turn) % 256
            assert await client.ask(f"*ESE {number};*ESE?".encode()) == f"{number}\n".encode()

    async def visit(stand, ammeter):
        await asyncio.gather(*(one(port, 7 * n) for n in range(20) for port in (stand, ammeter)))

    served(visit)


def test_the_error_queue_is_the_instruments():
    async def visit(stand, ammeter):
        one, other, third = await Client.to(stand), await Client.to(stand), await Client.to(ammeter)
        await one.send(b"NONSENSE\n")
        assert await one.ask(b"*OPC?") == b"1\n"
        assert await third.ask(b"SYST:ERR?") == OK
        assert (await other.ask(b"SYST:ERR?")).startswith(b"-113")
        assert await one.ask(b"SYST:ERR?") == OK

    served(visit)


def test_who_waits_does_not_keep_others_waiting():
    async def visit(stand, ammeter):
        waiting, other = await Client.to(stand), await Client.to(stand)
        await waiting.send(b"AXIS:HOME;*OPC?;REF?\n")  # 10 s
        begun = time.monotonic()
        while await other.ask(b"AXIS:MOV?") != b"1\n":
            assert time.monotonic() < begun + 5
        await other.send(b"ABOR\n")
        assert await waiting.reader.readline() == b"1;0\n"
        assert time.monotonic() < begun + 9

    served(visit, speed=1.0)


@pytest.mark.parametrize(
    ("garbage", "error"),
    [
        (b"\xff\xfe\x00\x80\n", b"-101"),
        (b"GET / HTTP/1.1\r\nHost: x\r\n", b"-1"),
        (b"A" * (LONGEST_MESSAGE + 1) + b"\n", b"-363"),
        (b"*IDN? " * 100_000 + b"\n", b"-363"),
        (b"\x00" * 3 * LONGEST_MESSAGE + b"\n", b"-363"),
        (bytes(range(128, 256)) * 1000 + b"\n", b"-363"),
        (b"AXIS:POS " + b"9" * 4000 + b",0\n", b"-124"),
    ],
    ids=["binary", "http", "long", "very long", "zeros", "long binary", "long number"],
)
def test_garbage_is_an_error_and_the_client_goes_on(garbage, error):
    async def visit(stand, ammeter):
        client = await Client.to(stand)
        await client.send(garbage)
        assert (await client.ask(b"SYST:ERR?")).startswith(error)
        assert await client.ask(b"*CLS;:AXIS:REF?") == b"0\n"

    served(visit)


def test_a_client_that_goes_away_takes_nothing_with_it():
    async def visit(stand, ammeter):
        for raw in (b"*IDN?\n" * 1000, b"AXIS:POS 90,", b"AXIS:HOME;*OPC?\n", b""):
            client = await Client.to(stand)
            await client.send(raw)
            client.writer.transport.abort()
        client = await Client.to(stand)
        assert await client.ask(b"*WAI;AXIS:MOV?") == b"0\n"
        # Half a line is no command; the whole one was executed or never arrived, and harmed nobody.
        assert await client.ask(b"SYST:ERR?") == OK

    served(visit)


def test_what_a_client_began_goes_on_without_it():
    async def visit(stand, ammeter):
        first = await Client.to(ammeter)
        assert await first.ask(b"ACQ:COUN 2000;LAB 3;:INIT;:ACQ:LAB?") == b"3\n"
        first.writer.close()
        second = await Client.to(ammeter)
        assert await second.ask(b"*OPC?;:ACQ:STAT?") == b"1;DONE,3,2000,0\n"

    served(visit)


def test_a_client_that_only_stops_sending_gets_its_answers():
    async def visit(stand, ammeter):
        client = await Client.to(stand)
        client.writer.write(b"AXIS:HOME\n*OPC?\nAXIS:REF?\n")
        client.writer.write_eof()
        assert await client.reader.read() == b"1\n1\n"

    served(visit)


def test_a_client_that_waits_for_a_stalled_stand_and_goes_is_forgotten():
    async def visit(stand, ammeter):
        client = await Client.to(stand)
        assert await client.ask(b"AXIS:HOME;*OPC?") == b"1\n"
        client.writer.write(b"AXIS:POS 90,0\n*OPC?\n")
        client.writer.write_eof()
        assert await client.reader.read() == b""
        other = await Client.to(stand)
        assert await other.ask(b"AXIS:MOV?") == b"1\n"

    served(visit, faults=["stall@90/0"])


def test_a_client_that_does_not_read_stalls_nobody():
    async def visit(stand, ammeter):
        other, greedy = await Client.to(ammeter), await Client.to(ammeter)
        assert await other.ask(b"ACQ:COUN 12000;:INIT;*OPC?") == b"1\n"
        greedy.writer.write(b"FETC:BLOC? 0,12000\n" * 200)  # 77 MB that it never reads
        for _ in range(50):
            assert await other.ask(b"ACQ:STAT?") == b"DONE,0,12000,0\n"
        greedy.writer.transport.abort()

    served(visit)


def test_an_interrupted_block_ends_the_connection_and_the_next_one_gets_it():
    async def visit(stand, ammeter):
        client = await Client.to(ammeter)
        assert await client.ask(b"ACQ:COUN 100;:INIT;*OPC?") == b"1\n"
        await client.send(b"FETC:BLOC? 0,100\n")
        assert len(await client.reader.read()) == (6 + 3200) // 2
        again = await Client.to(ammeter)
        assert len(await again.ask_block(b"FETC:BLOC? 0,100")) == 100

    served(visit, faults=["interrupted@0/0"])


def test_speed_changes_no_sample_and_both_are_those_of_real_time():
    async def visit(stand, ammeter):
        client = await Client.to(ammeter)
        assert await client.ask(b"SENS:RATE 2000;:ACQ:COUN 300;:INIT;*OPC?") == b"1\n"
        return await client.ask_block(b"FETC:BLOC? 0,300")

    begun = time.monotonic()
    slow = served(visit, speed=1.0)
    assert time.monotonic() - begun > 0.15
    fast = served(visit, speed=1e5)
    assert np.array_equal(slow, fast)
    assert slow[-1, 1] == pytest.approx(299 / 2000, abs=1e-12)  # rounding


def test_a_port_that_is_taken_is_an_error():
    async def visit(stand, ammeter):
        with pytest.raises(OSError, match=r"in use|only one usage"):
            async with listening(instruments()[:1], "127.0.0.1", [stand]):
                pass

    served(visit)


def test_the_end_of_the_service_is_the_end_of_its_connections():
    async def run():
        async with clients():
            async with listening(instruments(speed=1.0), "127.0.0.1", [0, 0]) as (stand, _):
                idle, waiting = await Client.to(stand), await Client.to(stand)
                assert await idle.ask(b"AXIS:REF?") == b"0\n"
                await waiting.send(b"AXIS:HOME;*OPC?\n")
                while await idle.ask(b"AXIS:MOV?") != b"1\n":
                    pass
            for client in (idle, waiting):
                with contextlib.suppress(ConnectionResetError):
                    assert await client.reader.read() == b""
            with pytest.raises(ConnectionError):
                await Client.to(stand)

    asyncio.run(asyncio.wait_for(run(), PATIENCE_S))


@pytest.fixture
def visa() -> Iterator[pyvisa.ResourceManager]:
    manager = pyvisa.ResourceManager("@py")
    yield manager
    manager.close()


def test_visa_drives_both(visa):
    def drive(stand, ammeter):
        opened = [
            visa.open_resource(
                f"TCPIP0::127.0.0.1::{port}::SOCKET",
                read_termination="\n",
                write_termination="\n",
                timeout=5000,
            )
            for port in (stand, ammeter)
        ]
        axes, meter = opened
        assert [item.query("*IDN?") for item in opened] == ["House,STAND,7,1", "House,AMMETER,7,1"]
        assert axes.query("AXIS:HOME;*OPC?") == "1"
        assert axes.query("AXIS:POS 90,180;*OPC?;POS?") == "1;90.0000,180.0000"
        assert len(meter.query_ascii_values("MEAS:CURR?")) == 2
        assert meter.query("ACQ:COUN 3000;LAB 1;:INIT;*OPC?;:ACQ:STAT?") == "1;DONE,1,3000,0"
        found = [
            meter.query_binary_values(f"FETC:BLOC? {first},1000", datatype="d", container=np.array)
            for first in range(0, 3000, 1000)
        ]
        assert [item.query("SYST:ERR?") for item in opened] == [OK.decode().strip()] * 2
        for item in opened:
            item.close()
        return np.concatenate(found).reshape(-1, 4)

    async def visit(stand, ammeter):
        record = await asyncio.to_thread(drive, stand, ammeter)
        client = await Client.to(ammeter)
        assert np.array_equal(record, await client.ask_block(b"FETC:BLOC? 0,3000"))

    served(visit)
