"""The whole service over real HTTP, in a folder of the test's own."""

import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import cache
from typing import Any

import httpx
import uvicorn
from fastapi import FastAPI
from sqlalchemy.orm import Session
from starlette.routing import Mount

from app import api
from app.main import Opening, create_app
from app.services import access
from app.services.lab import Lab
from app.settings import Settings

API = "/api/v1"
GRID = [(theta, psi) for theta in (0, 90, 180, 270) for psi in (0, 90, 180, 270)]


class NotingQueue:
    """Stands for the job engine: notes what it is asked for, in order."""

    def __init__(self) -> None:
        self.queued: list[str] = []
        self.cancelled: list[str] = []

    def enqueue(self, session: Session, job_id: str, *, priority: int = 100) -> None:
        self.queued.append(job_id)

    def cancel(self, job_id: str) -> None:
        self.cancelled.append(job_id)


@cache
def described() -> dict[str, Any]:
    """The API's description; a second or two of work."""
    return api.create().openapi()


@dataclass
class Service:
    """A running service. `tokens` holds secrets by name: ``both``, ``read``, ``upload``."""

    url: str
    lab: Lab
    tokens: dict[str, str]
    clients: list[httpx.Client] = field(default_factory=list)

    def client(self, token: str | None = "both", path: str = API) -> httpx.Client:
        """A client with that token; its addresses begin under `path`."""
        secret = self.tokens.get(token, token) if token else None
        headers = {"authorization": f"Bearer {secret}"} if secret else {}
        # Nothing is encrypted; reading the list of authorities would take longer than a test.
        client = httpx.Client(base_url=self.url + path, headers=headers, timeout=30, verify=False)
        self.clients.append(client)
        return client


def ready(client: httpx.Client) -> httpx.Client:
    """Register gyro 0417, stand S1 and its certificate C-17 of sixteen positions."""
    said = {"number": "C-17", "valid_from": "2000-01-01", "valid_until": "2100-01-01"}
    angles = {"alpha_arcsec": 6.9, "beta_arcsec": -16.4, "gamma_arcsec": 6.6}
    positions = [{"theta_deg": theta, "psi_deg": psi} | angles for theta, psi in GRID]
    for path, body in (
        ("/gyros", {"serial": "0417", "type": "GVK-6"}),
        ("/stands", {"name": "S1", "latitude_deg": 55.7558}),
        ("/stands/S1/certificates", said | {"positions": positions}),
    ):
        made = client.post(path, json=body)
        assert made.status_code == 201, made.text
    return client


def wait_until(happened: Callable[[], Any]) -> None:
    """Wait for what the service does after its answer."""
    deadline = time.monotonic() + 10
    while not happened():
        assert time.monotonic() < deadline
        time.sleep(0.01)


def opened(client: httpx.Client, **said: Any) -> int:
    """Open a session of gyro 0417 on stand S1."""
    made = client.post("/sessions", json={"gyro": "0417", "stand": "S1"} | said)
    assert made.status_code == 201, made.text
    return int(made.json()["id"])


@dataclass
class Server:
    """A server at its address."""

    url: str
    app: FastAPI

    def show(self, lab: Lab) -> None:
        """Serve this laboratory from now on: an application takes longer to build than a laboratory."""
        self.app.state.lab = lab
        programs = next(route for route in self.app.routes if isinstance(route, Mount) and route.path == API)
        programs.app.state.lab = lab


@contextmanager
def served(settings: Settings, opening: Opening) -> Iterator[Server]:
    """Serve in a thread, on a free port, until the block ends."""
    app = create_app(settings, opening)
    config = uvicorn.Config(
        app, port=0, log_config=None, access_log=False, timeout_graceful_shutdown=1, ws="none"
    )
    server = uvicorn.Server(config)
    thread = threading.Thread(target=server.run)
    thread.start()
    try:
        while not server.started:
            assert thread.is_alive(), "the service did not start"
            thread.join(0.01)
        port = server.servers[0].sockets[0].getsockname()[1]
        yield Server(f"http://127.0.0.1:{port}", app)
    finally:
        server.should_exit = True
        thread.join()


@contextmanager
def visited(url: str, lab: Lab) -> Iterator[Service]:
    """Tokens for a laboratory that is served there, and clients until the block ends."""
    service = Service(url, lab, {})
    with lab.write(access.SYSTEM) as work:
        for name, scopes in {"both": ("read", "upload"), "read": ("read",), "upload": ("upload",)}.items():
            service.tokens[name] = access.create_token(work, f"stand-{name}", scopes)
    try:
        yield service
    finally:
        for client in service.clients:
            client.close()


@contextmanager
def running(settings: Settings, opening: Opening) -> Iterator[Service]:
    """A service of one's own."""
    with served(settings, opening) as server, visited(server.url, server.app.state.lab) as service:
        yield service
