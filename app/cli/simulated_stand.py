"""Making the simulated stand, its certificate and its gyro known to a service."""

from collections.abc import Mapping
from dataclasses import asdict
from datetime import UTC, datetime, timedelta
from typing import Annotated, Any, Final

import httpx
import typer

from app.cli.scenario_options import Latitude, ScenarioName, Seed, scenario_bench
from app.services.simulated import certificate_lab, common_lab, errors_stated, nominal_values
from app.station.sending.client import ServerRefused, connected, send
from simdevice.bench import Bench
from simdevice.scenarios import SCENARIOS, GyroType
from solver.units import deg_from_rad

_YEAR: Final = timedelta(days=365)
_THERE_ALREADY: Final = 409


def register(
    server: Annotated[str, typer.Option("--server", help="Address of the service.")],
    token: Annotated[
        str, typer.Option("--token", envvar="DRIFTBOOK_TOKEN", help="With the scopes upload and read.")
    ],
    gyro: Annotated[str, typer.Option("--gyro", help="Serial number.")] = "SIM-1",
    gyro_type: Annotated[
        str | None, typer.Option("--type", help="Of the gyro (default: the scenario's).", show_default=False)
    ] = None,
    stand: Annotated[str, typer.Option("--stand", help="What the service shall call the stand.")] = "SIM",
    seed: Seed = 0,
    scenario: ScenarioName = "gvk-6",
    latitude: Latitude = None,
) -> None:
    """Tell a service of the stand, certificate and gyro that `serve` simulates; safe to repeat.

    With them go what is expected of the gyro's type, unless the service knows, and how far the scenario's ammeter
    and base are off, as their standard uncertainties.
    """
    bench = scenario_bench(scenario, seed, latitude)
    kind = SCENARIOS[scenario].kind
    gyro_type = gyro_type or kind.name
    latitude_deg = round(float(deg_from_rad(bench.stand.latitude)), 9)
    with connected(server, token) as client:
        _told(client, "/stands", {"name": stand, "latitude_deg": latitude_deg})
        _told(client, f"/stands/{stand}/certificates", _certificate(bench, f"SIM-{scenario}-{seed}"))
        _told(client, "/gyros", {"serial": gyro, "type": gyro_type})
        _state_errors(client, stand, errors_stated(bench))
        _expect(client, gyro_type, kind)
    typer.echo(f"{client.base_url.host} knows stand {stand}, its certificate and gyro {gyro}")


def _told(client: httpx.Client, path: str, body: dict[str, Any]) -> None:
    """Post it, unless it is there already."""
    try:
        send(client, "POST", path, json=body)
    except ServerRefused as refused:
        if refused.answered != _THERE_ALREADY:
            raise


def _state_errors(client: httpx.Client, stand: str, errors: Mapping[str, float]) -> None:
    """State the uncertainties, beside what is stated of the stand already."""
    stated = send(client, "GET", f"/stands/{stand}").json()["uncertainty"]
    if errors and stated != stated | errors:
        send(client, "PUT", f"/stands/{stand}/uncertainty", json=stated | errors)


def _expect(client: httpx.Client, name: str, kind: GyroType) -> None:
    """Enter what is expected of a type of which nothing is."""
    known = {item["name"]: item["nominals"] for item in send(client, "GET", "/types").json()["items"]}
    if not known.get(name):
        nominals = {
            parameter: {"value": item.value, "standard_uncertainty": item.u}
            for parameter, item in nominal_values(kind).items()
        }
        send(client, "PUT", f"/types/{name}/nominals", json={"nominals": nominals})


def _certificate(bench: Bench, number: str) -> dict[str, Any]:
    certificate, today = bench.stand.certificate, datetime.now(UTC).date()
    return {
        "number": number,
        "valid_from": today.isoformat(),
        "valid_until": (today + _YEAR).isoformat(),
        "issued_by": "simulated",
        "positions": [asdict(row) for row in certificate_lab(certificate)],
        **common_lab(certificate)._asdict(),
    }
