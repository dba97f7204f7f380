"""A station's file: which instruments there are, how to speak with them, and what is expected of a record.

`simulated.toml`, beside this module, is a complete file whose comments say what every key means.
"""

import re
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

from app.exchange.problems import Problems, refuse
from app.station.instruments.commands_toml import Form, command, errors, pattern
from app.station.instruments.dialogue import Errors
from app.station.instruments.exchanges import Command
from app.station.instruments.toml_tables import Table, load_toml
from app.station.instruments.visa import Connection, attribute_names
from app.station.judgement.expectations import Expectations, Thresholds
from app.station.judgement.settling import RestRule
from solver.errors import Message

SIMULATED: Final = Path(__file__).with_name("simulated.toml")
"""The file of the simulated instruments (``driftbook simdevice serve``)."""

_IDENTIFY: Final = Form(gives=frozenset({"identity"}))
_PLAIN: Final = Form()
_ANGLES: Final = {f"{axis}_{unit}": 90.0 for axis in ("theta", "psi") for unit in ("deg", "arcsec", "rad")}
_MOVE: Final = Form(
    places=_ANGLES,
    sends=tuple(frozenset(name for name in _ANGLES if name.startswith(axis)) for axis in ("theta", "psi")),
)
_STAND_STATUS: Final = Form(
    gives=frozenset({"theta", "psi", "homed", "emergency_stop"}), may_give=frozenset({"moving"})
)
_READING: Final = Form(gives=frozenset({"jx", "jy"}))
_START: Final = Form(
    places={
        "label": 1,
        "take": 0,
        "samples": 12000,
        "rate_hz": 200.0,
        "interval_s": 0.005,
        "duration_s": 60.0,
    },
    sends=(frozenset({"samples", "duration_s"}),),
)
_AMMETER_STATUS: Final = Form(
    gives=frozenset({"running", "samples", "overload"}), may_give=frozenset({"label"})
)
_FETCH: Final = Form(
    places={"first": 0, "most": 100, "last": 99, "first_from_one": 1, "last_from_one": 100},
    sends=(frozenset({"first", "first_from_one"}), frozenset({"most", "last", "last_from_one"})),
    gives=frozenset({"jx", "jy"}),
    may_give=frozenset({"t", "index"}),
)

_RECORDING: Final = {"duration_s": (0.01, 86400.0), "rate_hz": (0.001, 1e6), "block_samples": (1.0, 1e6)}
_REST: Final = {"window_s": (0.001, 1e5), "limit_na_per_s": (1e-9, 1e9), "confidence": (0.5, 0.999999)}
_CHECKS: Final = {"false_alarm": (1e-12, 0.5), "noise_factor": (1.0, 1e3)}


@dataclass(frozen=True, slots=True)
class Travel:
    """How far an axis turns, deg."""

    smallest_deg: float
    largest_deg: float


@dataclass(frozen=True, slots=True)
class StandDescription:
    """A stand: how it is reached and spoken with, and what it can.

    Attributes
    ----------
    identity
        Matches all of what it says to `identify`.
    theta, psi
        Travel of the axes.
    homing_s, moving_s
        Longest time for seeking the reference, and for any movement.
    arrival_deg
        The encoders must come so near to where it was sent.
    rest_deg
        A stand that does not tell whether it moves is at rest when two looks differ by less.
    """

    connection: Connection
    identity: re.Pattern[str]
    identify: Command
    home: Command
    move: Command
    stop: Command
    status: Command
    release: Command | None
    errors: Errors | None
    theta: Travel
    psi: Travel
    homing_s: float
    moving_s: float
    arrival_deg: float
    rest_deg: float


@dataclass(frozen=True, slots=True)
class AmmeterDescription:
    """An ammeter: how it is reached and spoken with, and its largest current, mA."""

    connection: Connection
    identity: re.Pattern[str]
    identify: Command
    reading: Command
    start: Command
    status: Command
    fetch: Command
    stop: Command
    errors: Errors | None
    largest_ma: float


@dataclass(frozen=True, slots=True)
class Recording:
    """How each position is recorded: s, Hz, and samples fetched at once."""

    duration_s: float = 60.0
    rate_hz: float = 200.0
    block_samples: float = 2000.0


@dataclass(frozen=True, slots=True)
class StationFile:
    """All that a station's file says."""

    stand: StandDescription
    ammeter: AmmeterDescription
    recording: Recording
    settling: RestRule
    warm_up: RestRule
    checks: Thresholds
    types: Mapping[str, Expectations]


def station_file(
    path: Path, *, stand_address: str | None = None, ammeter_address: str | None = None
) -> StationFile:
    """Read a station's file.

    Parameters
    ----------
    path
        A TOML file; `SIMULATED` for the simulated instruments.
    stand_address, ammeter_address
        VISA addresses that hold instead of the file's.

    Raises
    ------
    Invalid
        With every mistake, each under the dotted name of its key.
    """
    try:
        data = path.read_bytes()
    except OSError as error:
        raise refuse(
            "not-readable",
            "This file cannot be read: %(why)s. Check its name.",
            file=str(path),
            why=error.strerror or str(error),
        ) from error
    read = read_station(data, path.name)
    stand, ammeter = read.stand, read.ammeter
    if stand_address:
        stand = replace(stand, connection=replace(stand.connection, address=stand_address))
    if ammeter_address:
        ammeter = replace(ammeter, connection=replace(ammeter.connection, address=ammeter_address))
    return replace(read, stand=stand, ammeter=ammeter)


def read_station(data: bytes, filename: str) -> StationFile:
    """Read the content of a station's file; raises as `station_file`."""
    problems = Problems(filename)
    whole = Table(load_toml(data, filename), problems)
    read = StationFile(
        stand=_stand(whole.table("stand", required=True)),
        ammeter=_ammeter(whole.table("ammeter", required=True)),
        recording=whole.table("recording").numbers_into(Recording, _RECORDING),
        settling=whole.table("settling", required=True).numbers_into(RestRule, _REST),
        warm_up=whole.table("warm_up", required=True).numbers_into(RestRule, _REST),
        checks=whole.table("checks").numbers_into(Thresholds, _CHECKS),
        types={
            name: table.numbers_into(Expectations) for name, table in whole.table("types").tables().items()
        },
    )
    whole.finish()
    problems.raise_if_any()
    return read


def _stand(table: Table) -> StandDescription:
    says, limits, times = (table.table(key, required=True) for key in ("commands", "limits", "times"))
    read = StandDescription(
        connection=_connection(table, "stand"),
        identity=pattern(table, "identity"),
        identify=command(says, "identify", _IDENTIFY),
        home=command(says, "home", _PLAIN),
        move=command(says, "move", _MOVE),
        stop=command(says, "stop", _PLAIN),
        status=command(says, "status", _STAND_STATUS),
        release=command(says, "release", _PLAIN) if says.has("release") else None,
        errors=errors(says, "errors"),
        theta=Travel(*limits.interval("theta_deg")),
        psi=Travel(*limits.interval("psi_deg")),
        homing_s=times.number("homing_s"),
        moving_s=times.number("moving_s"),
        arrival_deg=limits.number("arrival_deg", 0.01),
        rest_deg=limits.number("rest_deg", 0.001),
    )
    for part in (says, limits, times, table):
        part.finish()
    return read


def _ammeter(table: Table) -> AmmeterDescription:
    says, limits = (table.table(key, required=True) for key in ("commands", "limits"))
    read = AmmeterDescription(
        connection=_connection(table, "ammeter"),
        identity=pattern(table, "identity"),
        identify=command(says, "identify", _IDENTIFY),
        reading=command(says, "reading", _READING),
        start=command(says, "start", _START),
        status=command(says, "status", _AMMETER_STATUS),
        fetch=command(says, "fetch", _FETCH),
        stop=command(says, "stop", _PLAIN),
        errors=errors(says, "errors"),
        largest_ma=limits.number("largest_ma"),
    )
    for part in (says, limits, table):
        part.finish()
    return read


def _connection(table: Table, name: str) -> Connection:
    address = table.text("address")
    end = table.text("read_termination", "\n")
    if not end and address.upper().endswith("::SOCKET"):
        table.wrong(
            "read_termination",
            Message("no-termination", "A socket does not tell where an answer ends. Give what ends a line."),
        )
    return Connection(
        name=name,
        address=address,
        write_termination=table.text("write_termination", "\n"),
        read_termination=end,
        timeout_s=table.number("timeout_s", 5.0, smallest=0.01, largest=600.0),
        visa_library=table.text("visa_library", "@py"),
        attributes=_attributes(table.table("visa_attributes")),
    )


def _attributes(table: Table) -> dict[str, int | bool]:
    found: dict[str, int | bool] = {}
    known = attribute_names() if table.names else frozenset()
    for key in table.names:
        value = table.value(key)
        if key not in known:
            table.unknown(key, sorted(known))
        elif isinstance(value, int):
            found[key] = value
        else:
            table.wrong(key, Message("not-a-flag", "This must be true, false or a whole number."))
    return found
