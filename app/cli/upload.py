"""What the stand's computer runs: bring a session to the server, as often as it takes."""

import hashlib
from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Annotated, Any

import httpx
import typer
from rich.progress import track

from app.cli.sessions_on_disk import Item, items
from app.cli.solve import Method
from app.errors import Invalid, problem
from app.exchange.record_files import write_record_parquet
from app.exchange.rows import Facts, MeansRow
from app.exchange.session_folder import SessionFiles
from app.station.sending.client import connected, currents_request, followed, send


@dataclass(frozen=True, slots=True)
class _Part:
    """One request of an upload: a position's means or its record."""

    path: str
    params: dict[str, Any]
    json: dict[str, Any] | None = None
    content: bytes | None = None


def upload(
    path: Annotated[Path, typer.Argument(help="Session folder, ZIP archive, or file of means or records.")],
    server: Annotated[str, typer.Option("--server", help="Address of the service.")],
    token: Annotated[str, typer.Option("--token", envvar="DRIFTBOOK_TOKEN", help="With the scope upload.")],
    gyro: Annotated[
        str | None, typer.Option("--gyro", help="Serial number, if session.json has none.")
    ] = None,
    stand: Annotated[str | None, typer.Option("--stand", help="Stand, if session.json has none.")] = None,
    certificate: Annotated[
        str | None,
        typer.Option("--certificate", help="Number of the stand's certificate, if not the valid one."),
    ] = None,
    method: Annotated[
        Method | None, typer.Option("--solve", help="Ask for the calibration and wait for it.")
    ] = None,
) -> None:
    """Upload a session; safe to repeat: what the server has already is not doubled."""
    for item in items([path]):
        session = item.read()
        with connected(server, token) as client:
            number = _open_session(client, item, session, gyro, stand, certificate)
            parts = list(_parts(session, number))
            for part in track(parts, description=f"session {number}", transient=True):
                send(client, "PUT", part.path, params=part.params, json=part.json, content=part.content)
            typer.echo(f"{item.name}: session {number}, {len(parts)} positions")
            opened = send(client, "GET", f"/sessions/{number}").json()
            for text in (*(warning.text for warning in session.warnings), *_differences(session, opened)):
                typer.echo(f"warning: {text}", err=True)
            if method:
                _solve(client, number, method)


def _open_session(
    client: httpx.Client,
    item: Item,
    session: SessionFiles,
    gyro: str | None,
    stand: str | None,
    certificate: str | None,
) -> int:
    body: dict[str, Any] = {
        "gyro": gyro or session.facts.gyro,
        "stand": stand or session.facts.stand,
        "certificate": certificate,
        "started_at": _started_at(session.facts),
        "temperature_c": session.facts.temperature_c,
    }
    for name in ("gyro", "stand"):
        if not body[name]:
            raise Invalid(
                problem(
                    f"no-{name}",
                    "The session does not say which %(name)s it is of. Name it with --%(name)s.",
                    file=item.name,
                    name=name,
                )
            )
    said = {name: value for name, value in body.items() if value is not None}
    answer = send(client, "POST", "/sessions", json=said, headers={"Idempotency-Key": _key(session, said)})
    return int(answer.json()["id"])


def _started_at(facts: Facts) -> str | None:
    return None if facts.started_at is None else facts.started_at.isoformat()


def _key(session: SessionFiles, said: dict[str, Any]) -> str:
    """The same session uploaded again has the same key, so the server opens no second one."""
    digest = hashlib.sha256(repr(sorted(said.items())).encode())
    for part in _parts(session, 0):
        digest.update(repr((part.path, part.params, part.json)).encode())
        digest.update(part.content or b"")
    return "upload-" + digest.hexdigest()


def _parts(session: SessionFiles, number: int) -> Iterator[_Part]:
    recorded = set()
    for record in session.records:
        recorded.add((record.theta_deg, record.psi_deg))
        path, params = currents_request(number, record.theta_deg, record.psi_deg, record.repeat)
        yield _Part(path, params, content=write_record_parquet(record))
    for row in session.means:
        if (row.theta_deg, row.psi_deg) not in recorded:
            place = f"/sessions/{number}/positions/{row.theta_deg:.15g}/{row.psi_deg:.15g}/means"
            yield _Part(place, {"repeat": row.repeat}, json=_means_body(row))


def _means_body(row: MeansRow) -> dict[str, Any]:
    body = {
        "jx_ma": row.jx_ma, "jy_ma": row.jy_ma, "u_jx_ma": row.u_jx_ma, "u_jy_ma": row.u_jy_ma,
        "duration_s": row.duration_s, "rate_hz": row.rate_hz, "temperature_c": row.temperature_c,
        "started_at": None if row.started_at is None else row.started_at.isoformat(),
    }  # fmt: skip
    return {name: value for name, value in body.items() if value is not None}


def _differences(session: SessionFiles, opened: Mapping[str, Any]) -> Iterator[str]:
    """Where the laboratory's book, which counts, says something else than the files."""
    facts, certificate = session.facts, opened["certificate"]
    if facts.latitude_deg is not None and facts.latitude_deg != opened["latitude_deg"]:
        yield (
            f"The files give the latitude {facts.latitude_deg:g}°; that of stand {opened['stand']}, "
            f"{opened['latitude_deg']:g}°, is used."
        )
    ours = {_angles(item["certified"]) for item in opened["positions"]}
    if session.certificate and {_angles(asdict(row)) for row in session.certificate} != ours:
        yield (
            f"The certificate among the files is not certificate {certificate} of stand {opened['stand']}, "
            "which is used."
        )


def _angles(row: Mapping[str, Any]) -> tuple[float, ...]:
    """A certified position with what was certified of it."""
    names = ("theta_deg", "psi_deg", "alpha_arcsec", "beta_arcsec", "gamma_arcsec")
    return tuple(float(row[name]) for name in names)


def _solve(client: httpx.Client, number: int, method: Method) -> None:
    job = send(client, "POST", f"/sessions/{number}/calibrations", json={"method": method.value}).json()
    typer.echo(f"{client.base_url.copy_with(path=followed(client, job))}")
