"""The simulated instruments behind real sockets, on a clock that runs fast, and the station's file for them."""

import asyncio
import threading
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass

from app.station.instruments.ammeter import DescribedAmmeter
from app.station.instruments.description import SIMULATED, StationFile, station_file
from app.station.instruments.opening import open_ammeter, open_stand
from app.station.instruments.stand import DescribedStand
from simdevice.ammeter_device import AmmeterDevice
from simdevice.clock import Clock
from simdevice.faults import located, parse
from simdevice.laboratory import Laboratory
from simdevice.scenarios import scenario
from simdevice.scpi.instrument import Instrument
from simdevice.serving import listening
from simdevice.stand_device import StandDevice

PATIENCE_S = 20.0  # a guard against a test that hangs


@dataclass
class Wired:
    laboratory: Laboratory
    file: StationFile
    stand: DescribedStand
    ammeter: DescribedAmmeter

    def at_rest(self) -> None:
        """Wait until the stand stands."""
        deadline = time.monotonic() + PATIENCE_S
        while self.stand.status().moving:
            assert time.monotonic() < deadline

    def acquired(self) -> int:
        """Wait until the ammeter has all samples; how many."""
        deadline = time.monotonic() + PATIENCE_S
        while (status := self.ammeter.status()).running:
            assert time.monotonic() < deadline
        return status.samples


@contextmanager
def wired(
    name: str = "gvk-6", seed: int = 3, faults: Sequence[str] = (), speed: float = 2000.0
) -> Iterator[Wired]:
    """Both instruments of one laboratory."""
    bench = scenario(name).bench(seed)
    struck = located([parse(fault) for fault in faults], bench.stand.certificate, seed)
    laboratory = Laboratory(bench, Clock(time.time() - 7200.0 / speed, speed), struck)
    devices = [
        StandDevice(laboratory, "Driftbook,SIM-STAND,3,1.0"),
        AmmeterDevice(laboratory, "Driftbook,SIM-AMMETER,3,1.0"),
    ]
    with _listening([Instrument(device) for device in devices]) as ports:
        stand, ammeter = (f"TCPIP0::127.0.0.1::{port}::SOCKET" for port in ports)
        file = station_file(SIMULATED, stand_address=stand, ammeter_address=ammeter)
        opened = Wired(laboratory, file, open_stand(file.stand), open_ammeter(file.ammeter))
        try:
            yield opened
        finally:
            opened.stand.close()
            opened.ammeter.close()


@contextmanager
def _listening(instruments: Sequence[Instrument]) -> Iterator[list[int]]:
    """Serve them in a thread with an event loop of its own."""
    bound: list[int] = []
    ready, end = threading.Event(), asyncio.Event()

    async def serve() -> None:
        async with listening(instruments, "127.0.0.1", [0, 0]) as ports:
            bound.extend(ports)
            ready.set()
            await end.wait()

    loop = asyncio.new_event_loop()
    thread = threading.Thread(target=loop.run_until_complete, args=(serve(),))
    thread.start()
    try:
        assert ready.wait(PATIENCE_S)
        yield bound
    finally:
        loop.call_soon_threadsafe(end.set)
        thread.join()
        loop.close()
