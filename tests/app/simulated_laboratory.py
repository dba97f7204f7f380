"""Simulated instruments on free ports, in a thread of the test's own."""

import asyncio
import threading
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass

from simdevice.ammeter_device import AmmeterDevice
from simdevice.bench import Bench
from simdevice.clock import Clock
from simdevice.faults import parse
from simdevice.laboratory import Laboratory
from simdevice.scpi.instrument import Instrument
from simdevice.serving import listening
from simdevice.stand_device import StandDevice


@dataclass
class Instruments:
    """A laboratory on TCP."""

    laboratory: Laboratory
    stand: str
    ammeter: str


@contextmanager
def instruments(
    bench: Bench, speed: float = 1000.0, faults: Sequence[str] = (), on_for_s: float = 0.0
) -> Iterator[Instruments]:
    """Serve until the block ends; `on_for_s` of laboratory time have passed since the power-on."""
    clock = Clock(time.time() - on_for_s / speed, speed)
    laboratory = Laboratory(bench, clock, [parse(text) for text in faults])
    devices = [Instrument(StandDevice(laboratory, "Driftbook,SIM-STAND,1,1")),
               Instrument(AmmeterDevice(laboratory, "Driftbook,SIM-AMMETER,1,1"))]  # fmt: skip
    loop, ready, done = asyncio.new_event_loop(), threading.Event(), asyncio.Event()
    addresses: list[str] = []

    async def serve() -> None:
        async with listening(devices, "127.0.0.1", [0, 0]) as ports:
            addresses.extend(f"TCPIP0::127.0.0.1::{port}::SOCKET" for port in ports)
            ready.set()
            await done.wait()

    thread = threading.Thread(target=lambda: loop.run_until_complete(serve()))
    thread.start()
    assert ready.wait(10)
    try:
        yield Instruments(laboratory, *addresses)
    finally:
        loop.call_soon_threadsafe(done.set)
        thread.join()
        loop.close()
