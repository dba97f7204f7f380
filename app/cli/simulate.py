"""A simulated session on disk."""

from dataclasses import replace
from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from app.cli import signal_options as signal
from app.cli.scenario_options import Latitude, ScenarioName, Seed, scenario_bench
from app.errors import Conflict, Invalid, problem
from app.exchange.archive import save
from app.exchange.numbers import typed
from app.exchange.rows import Facts
from app.services.simulated import celsius
from app.services.simulated_facts import simulation_facts
from app.services.simulated_files import simulated_files
from simdevice.bench import Bench, SimulatedSession, run_session
from simdevice.certificate import Position, sixteen_positions
from simdevice.scenarios import SCENARIOS
from solver.units import rad_from_deg


class Format(StrEnum):
    """Formats of record files."""

    CSV = "csv"
    PARQUET = "parquet"


def simulate(
    out: Annotated[Path, typer.Option("--out", help="Folder to write; it must be empty or new.")],
    seed: Seed = 0,
    latitude: Latitude = None,
    positions: Annotated[
        str, typer.Option("--positions", help="16, 8, or a list such as 0/0,0/90,90/180.")
    ] = "16",
    duration: Annotated[float, typer.Option("--duration", min=0.01, max=3600, help="Of a record, s.")] = 60.0,
    rate: Annotated[float, typer.Option("--rate", min=1, max=20000, help="Samples per second.")] = 200.0,
    file_format: Annotated[Format, typer.Option("--format", help="Of the record files.")] = Format.CSV,
    scenario: ScenarioName = "gvk-6",
    repeats: Annotated[
        int, typer.Option("--repeats", min=1, max=100, help="How often each position is measured.")
    ] = 1,
    fault: signal.FaultTexts = None,
    noise: signal.NoiseOfMean = None,
    angle_random_walk: signal.AngleRandomWalk = None,
    bias_instability: signal.BiasInstability = None,
    rate_random_walk: signal.RateRandomWalk = None,
    turn_on: signal.TurnOn = None,
    warm_up: signal.WarmUpText = None,
    temperature: signal.TemperatureText = None,
    since_power_up: signal.SincePowerUp = None,
    mains: signal.Mains = None,
    ripple: signal.Ripple = None,
    jitter: signal.Jitter = None,
    gyro: Annotated[str | None, typer.Option("--gyro", help="Serial number for session.json.")] = None,
    stand: Annotated[str | None, typer.Option("--stand", help="Stand for session.json.")] = None,
) -> None:
    """Simulate a session: records of currents, certificate, session.json, truth.json."""
    _refuse_full(out)
    options = signal.SignalOptions(
        noise, angle_random_walk, bias_instability, rate_random_walk, turn_on, warm_up, temperature,
        since_power_up, mains, ripple, jitter, tuple(fault or ()),
    )  # fmt: skip
    places = _positions(positions)
    bench = signal.with_signal(
        _bench(scenario, seed, places, latitude, rate, duration), SCENARIOS[scenario], options
    )
    session = run_session(bench, [replace(place, repeat=n) for n in range(repeats) for place in places])
    facts = Facts(
        gyro=gyro, stand=stand, latitude_deg=_latitude_deg(latitude, bench),
        temperature_c=_mean_temperature_c(session), further={"simulation": simulation_facts(bench, scenario)},
    )  # fmt: skip
    save(simulated_files(session, facts, file_format.value), out)
    typer.echo(f"{len(session.positions)} records in {out}")


def _mean_temperature_c(session: SimulatedSession) -> float | None:
    known = [item.temperature for item in session.positions if item.temperature is not None]
    return celsius(sum(known) / len(known)) if known else None


def _latitude_deg(latitude: float | None, bench: Bench) -> float:
    return latitude if latitude is not None else round(bench.stand.latitude / rad_from_deg(1.0), 9)


def _bench(
    name: str, seed: int, places: tuple[Position, ...], latitude: float | None, rate: float, duration: float
) -> Bench:
    bench = scenario_bench(name, seed, latitude, places)
    with signal.blaming("--rate"):
        return replace(bench, rate=rate, duration=duration)


def _positions(text: str) -> tuple[Position, ...]:
    if text == "16":
        return sixteen_positions()
    if text == "8":
        return sixteen_positions()[:8]
    places = [_position(part) for part in text.split(",")]
    if len({place.key for place in places}) < len(places):
        raise Invalid(problem("duplicate-position", "A position is listed twice.", column="--positions"))
    return tuple(places)


def _position(text: str) -> Position:
    theta, slash, psi = text.partition("/")
    if not slash:
        raise Invalid(
            problem(
                "bad-position",
                "“%(text)s” is no position; write θ/ψ in degrees, such as 90/180.",
                column="--positions",
                text=text,
            )
        )
    theta_deg, psi_deg = (typed(angle, "deg", column="--positions") for angle in (theta, psi))
    return Position(rad_from_deg(theta_deg), rad_from_deg(psi_deg))


def _refuse_full(folder: Path) -> None:
    if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
        raise Conflict(
            problem(
                "not-empty",
                "%(folder)s is not an empty folder; nothing there is overwritten. Name a new one.",
                column="--out",
                folder=str(folder),
            )
        )
