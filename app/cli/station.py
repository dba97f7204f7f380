"""The automated stand: the cycle over VISA instruments, storing and forwarding."""

import platform
import sys
import threading
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Annotated, Any

import typer

from app.cli.solve import Method
from app.cli.tables import print_result
from app.errors import AppError
from app.exchange.planned import listed_positions
from app.station.clock import Clock
from app.station.contracts import EmergencyStop, InstrumentFault, InstrumentLost, Place
from app.station.controls import Controls, StopAsked
from app.station.finishing import NotFinished, named
from app.station.instruments.description import SIMULATED, StationFile, station_file
from app.station.instruments.opening import open_ammeter, open_stand
from app.station.keeping import runs
from app.station.keeping.durable import SpoolFailed
from app.station.keeping.entries import Acquiring, Entry, Judged, Planned, Sent, Warmed
from app.station.keeping.history import History
from app.station.preparing import SIXTEEN
from app.station.running import Orders, live_through

station = typer.Typer(
    help="Drive a stand and an ammeter through the automated cycle.",
    add_completion=False,
    no_args_is_help=True,
    pretty_exceptions_enable=False,
)

_BEYOND_CHANCE = 1e-4
"""Of the fit's χ²: one good session in ten thousand is looked at in vain."""

Config = Annotated[
    Path,
    typer.Option(
        "--config",
        help="TOML file that describes the instruments (default: the simulated ones).",
        show_default=False,
    ),
]
StandAddress = Annotated[
    str | None, typer.Option("--stand-address", help="VISA address that holds instead of the file's.")
]
AmmeterAddress = Annotated[str | None, typer.Option("--ammeter-address", help="Likewise, of the ammeter.")]


@station.command()
def run(
    gyro: Annotated[str, typer.Option("--gyro", help="Serial number.")],
    stand: Annotated[str, typer.Option("--stand", help="Stand, as the service calls it.")],
    server: Annotated[str, typer.Option("--server", help="Address of the service.")],
    token: Annotated[
        str, typer.Option("--token", envvar="DRIFTBOOK_TOKEN", help="With the scopes upload and read.")
    ],
    spool: Annotated[
        Path | None,
        typer.Option("--spool", help="Folder of this run (default: one of the user's, an unfinished run first)."),
    ] = None,
    positions: Annotated[
        str | None,
        typer.Option("--positions", help="16, 8, or a list such as 0/0,0/90 (default: the certificate's)."),
    ] = None,
    certificate: Annotated[
        str | None, typer.Option("--certificate", help="Number of the stand's certificate, if not the valid one.")
    ] = None,
    gyro_type: Annotated[
        str | None, typer.Option("--type", help="The gyro's type for the checks (default: the service's).")
    ] = None,
    temperature: Annotated[
        float | None, typer.Option("--temperature", min=-273.15, max=1000, help="Of the room, °C.")
    ] = None,
    method: Annotated[Method, typer.Option("--method", help="Of the calibration.")] = Method.LEAST_SQUARES,
    leave_out: Annotated[
        bool, typer.Option("--leave-out", help="Calibrate without positions that could not be measured.")
    ] = False,
    attended: Annotated[
        bool | None,
        typer.Option("--attended/--unattended", help="After an emergency stop, wait for a person or end "
                     "(default: wait at a terminal)."),
    ] = None,
    release: Annotated[
        bool, typer.Option("--release", help="Acknowledge an emergency stop: I made sure that all is safe.")
    ] = False,
    speed: Annotated[
        float, typer.Option("--speed", min=0.01, max=1e6, help="Lab seconds per second of simulated instruments.")
    ] = 1.0,
    poll: Annotated[float, typer.Option("--poll", min=0.001, max=60, help="Lab seconds between looks.")] = 0.5,
    config: Config = SIMULATED,
    stand_address: StandAddress = None,
    ammeter_address: AmmeterAddress = None,
) -> None:  # fmt: skip
    """Measure a gyro in all positions and have it calibrated; the same command goes on with an unfinished run.

    Ctrl-C ends it and keeps everything. Exit code 0: all positions are measured, no check objects to any, and the
    calibration finds every parameter and fits them.
    """
    described = station_file(config, stand_address=stand_address, ammeter_address=ammeter_address)
    orders = Orders(
        gyro, stand, server, token, method.value, platform.node() or "station",
        certificate, temperature, gyro_type, _places(positions), leave_out,
        sys.stdin.isatty() if attended is None else attended, release,
    )  # fmt: skip
    folder = spool or runs.folder_for(gyro, stand)
    typer.echo(f"run in {folder}")
    controls = Controls()
    if orders.attended:
        _listen_to_keyboard(controls)
    history = _lived(orders, described, folder, Clock(speed, poll), controls)
    _verdict(orders, history)


def _lived(orders: Orders, described: StationFile, folder: Path, clock: Clock, controls: Controls) -> History:
    try:
        with controls.on_signals():
            return live_through(orders, described, folder, clock, controls, _Teller().tell)
    except StopAsked as stopped:
        why = f"Stopped by {stopped.why}."
    except (NotFinished, InstrumentFault, InstrumentLost, EmergencyStop, SpoolFailed) as ended:
        why = ended.problems[0].text
    typer.echo(f"driftbook: {why} The same command goes on with {folder}.", err=True)
    raise typer.Exit(1)


def _listen_to_keyboard(controls: Controls) -> None:
    """Let Enter mean: go on."""

    def listen() -> None:
        for _ in sys.stdin:
            controls.resume()

    threading.Thread(target=listen, name="keyboard", daemon=True).start()


def _places(text: str | None) -> tuple[Place, ...]:
    if text is None:
        return ()
    if text in ("16", "8"):
        return SIXTEEN[: int(text)]
    return tuple(Place(*place) for place in listed_positions(text, "--positions"))


class _Teller:
    """Tells on the terminal what happens, as it happens."""

    def __init__(self) -> None:
        self._told: int | None = None

    def tell(self, entry: Entry, history: History) -> None:
        """Tell of an entry, and of the events that it made."""
        if self._told is None:
            self._told = len(history.events) if entry.kind == "resumed" else 0
        line = _line(entry, history)
        if line:
            typer.echo(line)
        # What was told when the run was over stands beside its result.
        for event in history.events[self._told :] if entry.kind != "finished" else ():
            place = f"{event.place.theta_deg:g}/{event.place.psi_deg:g}: " if event.place else ""
            typer.echo(
                f"{event.level}: {place}{event.said.text} [{event.said.code}]", err=event.level != "info"
            )
        self._told = len(history.events)


def _line(entry: Entry, history: History) -> str | None:
    match entry:
        case Planned():
            return f"{len(entry.places)} positions ({entry.source})"
        case Warmed():
            return "warm"
        case Acquiring():
            return f"{named(history.attempts[entry.attempt].target)} …"
        case Judged():
            left = sum(history.wanted(target) for target in history.targets)
            return f"{named(history.attempts[entry.attempt].target)} {entry.verdict}, {left} to go"
        case Sent():
            return f"{named(history.attempts[entry.attempt].target)} sent"
    return None


def _verdict(orders: Orders, history: History) -> None:
    """Print the calibration and what it lacks; say by the exit code whether all is well."""
    reasons = history.finished.reasons if history.finished else ()
    for reason in reasons:
        typer.echo(f"driftbook: {reason.text}", err=True)
    if history.result is None:
        typer.echo("driftbook: No calibration was asked for. Measure these positions again.", err=True)
        raise typer.Exit(1)
    with orders.service() as service:
        result = service.calibration(history.result)
        print_result(f"{orders.gyro} on {orders.stand}", result)
        typer.echo(service.page(history.result))
    against = list(_objections(result["least-squares"] if result["method"] == "both" else result))
    for line in against:
        typer.echo(f"driftbook: {line}", err=True)
    if against or reasons:
        raise typer.Exit(1)


def _objections(answer: dict[str, Any]) -> Iterator[str]:
    """What the answer itself says against its use: no solution, parameters not found, currents that do not fit."""
    if "error" in answer:
        yield f"There is no result: {answer['error']['message']}"
        return
    unknown = [name for name, entry in answer["parameters"].items() if entry["value"] is None]
    if unknown:
        yield f"Not determined from these positions: {', '.join(unknown)}. Measure more positions."
    p_value = answer["fit"]["p_value"]
    if answer["diagnosis"] or (p_value is not None and p_value < _BEYOND_CHANCE):
        yield (
            "The currents do not fit together as the currents of one gyro on this stand. Do not use the result "
            "before somebody has found out why."
        )


@station.command()
def check(
    config: Config = SIMULATED,
    stand_address: StandAddress = None,
    ammeter_address: AmmeterAddress = None,
) -> None:
    """Ask both instruments who they are and how they stand; nothing moves."""
    described = station_file(config, stand_address=stand_address, ammeter_address=ammeter_address)
    stand, ammeter = open_stand(described.stand), open_ammeter(described.ammeter)
    failed = False
    for name, ask in (("stand", partial(_stand, stand)), ("ammeter", partial(_ammeter, ammeter))):
        try:
            typer.echo(f"{name}: {ask()}")
        except AppError as error:
            failed = True
            typer.echo(f"{name}: {error.problems[0].text}", err=True)
    if failed:
        raise typer.Exit(1)


def _stand(stand: Any) -> str:
    identity, status = stand.identify(), stand.status()
    where = f"at {status.place.theta_deg:g}/{status.place.psi_deg:g}"
    homed = "reference known" if status.homed else "no reference"
    return f"{identity}; {where}, {homed}" + (", EMERGENCY STOP" if status.emergency_stop else "")


def _ammeter(ammeter: Any) -> str:
    identity, currents = ammeter.identify(), ammeter.reading()
    return f"{identity}; Jx {currents.jx_ma:.6g} mA, Jy {currents.jy_ma:.6g} mA"


@station.command()
def describe() -> None:
    """Print the simulated instruments' file, which explains itself: the beginning of one for other instruments."""
    typer.echo(SIMULATED.read_text(encoding="utf-8"), nl=False)
