"""Simulated instruments on TCP ports."""

import asyncio
import signal
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from datetime import UTC, datetime
from importlib.metadata import version
from threading import Event
from typing import Annotated

import typer

from app.cli.scenario_options import Latitude, ScenarioName, Seed, scenario_bench
from app.cli.signal_options import blaming
from app.cli.simulated_stand import register
from app.errors import Conflict, Invalid, problem
from simdevice.ammeter_device import AmmeterDevice
from simdevice.clock import Clock
from simdevice.faults import Kind, parse
from simdevice.laboratory import Laboratory
from simdevice.scpi.instrument import Instrument
from simdevice.serving import listening
from simdevice.stand_device import StandDevice

_STOP_SIGNALS = ("SIGINT", "SIGTERM", "SIGBREAK")
"""Those of these that the system has end the instruments; the last is Windows' Ctrl-Break."""
_STOP_WAITS_S = 0.1
"""Windows wakes no event loop for a signal, so the loop wakes by itself."""

simdevice = typer.Typer(add_completion=False, no_args_is_help=True, pretty_exceptions_enable=False)


simdevice.command()(register)


@simdevice.callback()
def _simdevice() -> None:
    """Simulated stand and ammeter."""


@simdevice.command()
def serve(
    stand_port: Annotated[
        int, typer.Option("--stand-port", min=0, max=65535, help="0: any free one.")
    ] = 5025,
    ammeter_port: Annotated[int, typer.Option("--ammeter-port", min=0, max=65535, help="Likewise.")] = 5026,
    host: Annotated[str, typer.Option("--host", help="Address to listen on.")] = "127.0.0.1",
    seed: Seed = 0,
    scenario: ScenarioName = "gvk-6",
    speed: Annotated[
        float, typer.Option("--speed", min=0.001, max=1e6, help="Seconds of the laboratory in one second.")
    ] = 1.0,
    latitude: Latitude = None,
    duration: Annotated[
        float, typer.Option("--duration", min=0.01, max=3600, help="Of a record in the session's plan, s.")
    ] = 60.0,
    rate: Annotated[
        float, typer.Option("--rate", min=1, max=20000, help="Samples per second there.")
    ] = 200.0,
    powered_on: Annotated[
        str | None,
        typer.Option("--powered-on", help="Moment of the gyro's power-on, ISO 8601; default: now."),
    ] = None,
    fault: Annotated[
        list[str] | None,
        typer.Option(
            "--fault",
            metavar="KIND[@THETA/PSI][!]",
            help="What goes wrong, such as stall@90/180; again for more. Without a place the seed draws one; ! "
            f"hits every take or movement instead of the first. Kinds: {', '.join(Kind)}.",
        ),
    ] = None,
) -> None:
    """Serve a simulated stand and ammeter as SCPI instruments until Ctrl-C."""
    clock = Clock(_moment(powered_on), speed)
    bench = replace(scenario_bench(scenario, seed, latitude), rate=rate, duration=duration)
    with blaming("--fault"):
        laboratory = Laboratory(bench, clock, [parse(text) for text in fault or ()])
    devices = [
        device(laboratory, f"Driftbook,{model},{seed},{version('driftbook')}")
        for device, model in ((StandDevice, "SIM-STAND"), (AmmeterDevice, "SIM-AMMETER"))
    ]
    try:
        asyncio.run(_serve([Instrument(device) for device in devices], host, [stand_port, ammeter_port]))
    except OSError as error:
        raise Conflict(
            problem("ports-taken", "The instruments cannot listen on %(host)s (%(why)s). Choose other ports with "
                    "--stand-port and --ammeter-port.", host=host, why=error.strerror or str(error))
        ) from error  # fmt: skip


async def _serve(instruments: Sequence[Instrument], host: str, ports: Sequence[int]) -> None:
    with _asked_to_stop() as stop:
        async with listening(instruments, host, ports) as bound:
            stand, ammeter = (f"TCPIP0::{host}::{port}::SOCKET" for port in bound)
            typer.echo(f"listening: stand {stand} ammeter {ammeter}")
            while not stop.is_set():
                await asyncio.sleep(_STOP_WAITS_S)


@contextmanager
def _asked_to_stop() -> Iterator[Event]:
    """An event that the system's signals set within the block."""
    stop = Event()
    before = {
        number: signal.signal(number, lambda *_: stop.set())
        for number in (getattr(signal, name, None) for name in _STOP_SIGNALS)
        if number is not None
    }
    try:
        yield stop
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def _moment(text: str | None) -> float:
    """A moment as seconds since 1970; without an offset it is UTC."""
    if text is None:
        return time.time()
    try:
        moment = datetime.fromisoformat(text)
    except ValueError:
        raise Invalid(
            problem("bad-moment", "“%(text)s” is no moment; write it like 2026-11-22T09:00:00Z.",
                    column="--powered-on", text=text)
        ) from None  # fmt: skip
    seconds = (moment if moment.tzinfo else moment.replace(tzinfo=UTC)).timestamp()
    if seconds > time.time():
        raise Invalid(
            problem("future-moment", "The gyro cannot be powered on in the future; %(text)s is to come.",
                    column="--powered-on", text=text)
        )  # fmt: skip
    return seconds
