"""Running the service, and keeping its database up to date."""

import socket
from collections.abc import Callable
from contextlib import nullcontext
from dataclasses import replace
from typing import Annotated

import typer
import uvicorn

from app.cli.options import Data, settings
from app.errors import Conflict, problem
from app.main import create_app, working_lab
from app.services.lab import Lab
from app.services.opening import open_lab
from app.settings import Settings

Port = Annotated[int, typer.Option("--port", min=0, max=65535, help="Port; 0 takes any that is free.")]
_GRACE_S = 3


def serve(
    host: Annotated[str, typer.Option("--host", help="Address to listen on.")] = "127.0.0.1",
    port: Port = 8000,
    workers: Annotated[int, typer.Option("--workers", min=1, help="Jobs that compute at once.")] = 2,
    data: Data = None,
) -> None:
    """Run the service with its workers: pages, API and jobs."""
    listening = listen(host, port)
    run(replace(settings(data), workers=workers), listening, lambda url: typer.echo(f"Driftbook is on {url}"))


def migrate(data: Data = None) -> None:
    """Bring the database up to date."""
    with open_lab(settings(data)) as lab:
        typer.echo(f"{lab.settings.data} is up to date.")


def run(lab_settings: Settings, listening: socket.socket, ready: Callable[[str], None]) -> None:
    """Serve until interrupted; `ready` is called with the address once requests are answered."""
    host, port = listening.getsockname()[:2]
    url = f"http://[{host}]:{port}" if ":" in host else f"http://{host}:{port}"
    # Opened here, not inside the server: what forbids it (a second service on the folder) is one line.
    with listening, working_lab(lab_settings) as lab:
        app = create_app(lab_settings, lambda _: nullcontext(lab))
        config = uvicorn.Config(
            app, log_config=None, timeout_graceful_shutdown=_GRACE_S, access_log=False, ws="none"
        )
        _Server(config, lab, lambda: ready(url)).run(sockets=[listening])


class _Server(uvicorn.Server):
    """Tells when it answers, and not before; and tells streams of events when it is about to end."""

    def __init__(self, config: uvicorn.Config, lab: Lab, ready: Callable[[], None]) -> None:
        super().__init__(config)
        self._lab = lab
        self._ready = ready

    async def startup(self, sockets: list[socket.socket] | None = None) -> None:
        """Start, then tell."""
        await super().startup(sockets)
        if self.started:
            self._ready()

    async def shutdown(self, sockets: list[socket.socket] | None = None) -> None:
        """Let the streams end, then wait for what is being answered."""
        self._lab.stopping = True
        await super().shutdown(sockets)


def listen(host: str, port: int) -> socket.socket:
    """Take the port.

    Raises
    ------
    Conflict
        Somebody else has it.
    """
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    listening = socket.socket(family, socket.SOCK_STREAM)
    listening.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    try:
        listening.bind((host, port))
    except OSError as error:
        listening.close()
        raise Conflict(
            problem(
                "port-taken",
                "Port %(port)d of %(host)s cannot be used (%(why)s). Choose another one with --port.",
                port=port,
                host=host,
                why=error.strerror or str(error),
            )
        ) from error
    return listening
