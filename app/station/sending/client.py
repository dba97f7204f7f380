"""Requests to the service, which may be away: every one here may be repeated without doubling anything."""

import time
from typing import Any, Final

import httpx

from app.errors import AppError, Invalid, Problem, problem
from app.exchange.record_places import record_name

API: Final = "/api/v1"
_ATTEMPTS = 6
_FIRST_PAUSE_S = 0.5
_LATER: Final = frozenset({408, 425, 429})
"""Refusals that mean: not now."""


class ServerRefused(AppError):
    """The service answered, and said no; `answered` is its status."""

    def __init__(self, item: Problem, answered: int = 0) -> None:
        super().__init__(item)
        self.answered = answered


class Unreachable(AppError):
    """The service did not answer."""


def connected(server: str, token: str, timeout_s: float = 60.0) -> httpx.Client:
    """A client of the service at that address; to be closed.

    Raises
    ------
    Invalid
        That is no address: waiting would not help.
    """
    _require_address(server)
    headers = {"Authorization": f"Bearer {token}"}
    return httpx.Client(base_url=server.rstrip("/") + API, timeout=timeout_s, headers=headers)


def send_once(client: httpx.Client, verb: str, path: str, **what: Any) -> httpx.Response:
    """Send a request.

    Raises
    ------
    Unreachable
        No answer, or one that says nothing but that the service is in trouble.
    ServerRefused
        It says no.
    """
    said = {name: value for name, value in what.items() if value is not None}
    try:
        answer = client.request(verb, path, **said)
    except httpx.TransportError as error:
        raise _away(client, str(error) or type(error).__name__) from error
    if answer.status_code >= 500 or answer.status_code in _LATER:
        raise _away(client, f"status {answer.status_code}")
    if not answer.is_success:
        raise _refused(answer, client)
    return answer


def asked(client: httpx.Client, verb: str, path: str, *keys: str, **what: Any) -> dict[str, Any]:
    """Send a request and read the object that it is answered by, which has these keys.

    Raises
    ------
    Unreachable, ServerRefused
        As `send_once`; the former also when something else than the service answered (a proxy's page, say).
    """
    answer = send_once(client, verb, path, **what)
    try:
        said = answer.json()
    except ValueError:
        said = None
    if not isinstance(said, dict) or not said.keys() >= set(keys):
        raise _away(client, "what answers there is no Driftbook")
    return said


def send(client: httpx.Client, verb: str, path: str, **what: Any) -> httpx.Response:
    """Send a request, again and again for a while when the service is away; raises as `send_once`."""
    pause_s = _FIRST_PAUSE_S
    for _ in range(_ATTEMPTS - 1):
        try:
            return send_once(client, verb, path, **what)
        except Unreachable:
            time.sleep(pause_s)
            pause_s *= 2
    return send_once(client, verb, path, **what)


def currents_request(
    session: int, theta_deg: float, psi_deg: float, repeat: int
) -> tuple[str, dict[str, str | int]]:
    """Path and query under which a record (Parquet) of a position is put."""
    name = record_name(theta_deg, psi_deg, repeat, "parquet")
    path = f"/sessions/{session}/positions/{theta_deg:.15g}/{psi_deg:.15g}/currents"
    return path, {"repeat": repeat, "filename": name}


def followed(client: httpx.Client, job: dict[str, Any]) -> str:
    """Wait for a job; give the address of its result.

    Raises
    ------
    ServerRefused
        When it gives none.
    """
    while job["state"] in ("queued", "running"):
        time.sleep(0.2)
        job = send(client, "GET", f"/jobs/{job['id']}").json()
    return result_of(job)


def result_of(job: dict[str, Any]) -> str:
    """Address of what an ended job gave; raises as `followed`."""
    if job["state"] != "succeeded":
        detail = (job["error"] or {}).get("detail", job["state"])
        raise ServerRefused(
            problem("not-solved", "The calibration gave no result: %(detail)s", detail=detail)
        )
    return str(job["result"])


def _require_address(server: str) -> None:
    try:
        address = httpx.URL(server)
    except httpx.InvalidURL:
        address = httpx.URL()
    if address.scheme not in ("http", "https") or not address.host:
        raise Invalid(
            problem(
                "not-an-address",
                "“%(server)s” is not the address of a service. It looks like https://driftbook.example.",
                column="--server",
                server=server,
            )
        )


def _away(client: httpx.Client, reason: str) -> Unreachable:
    return Unreachable(
        problem(
            "unreachable",
            "%(server)s does not answer (%(reason)s). What was sent is kept there; run the same command again.",
            server=str(client.base_url),
            reason=reason,
        )
    )


def _refused(answer: httpx.Response, client: httpx.Client) -> ServerRefused:
    try:
        detail = answer.json()["detail"]
    except (ValueError, KeyError, TypeError):
        detail = f"status {answer.status_code}; is there a Driftbook at this address?"
    return ServerRefused(
        problem("refused", "%(server)s says: %(detail)s", server=str(client.base_url), detail=detail),
        answer.status_code,
    )
