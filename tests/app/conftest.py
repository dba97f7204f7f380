"""The whole service over real HTTP, in a folder of the test's own, with a queue that only notes."""

import shutil
import threading
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass, field
from pathlib import Path

import httpx
import pytest
import uvicorn
from sqlalchemy.orm import Session

from app.main import Opening, create_app
from app.services import access
from app.services.lab import Lab
from app.services.opening import open_lab
from app.settings import Settings

API = "/api/v1"


class NotingQueue:
    """Stands for the job engine: notes what it is asked for, in order."""

    def __init__(self) -> None:
        self.queued: list[str] = []
        self.cancelled: list[str] = []

    def enqueue(self, session: Session, job_id: str, *, priority: int = 100) -> None:
        self.queued.append(job_id)

    def cancel(self, job_id: str) -> None:
        self.cancelled.append(job_id)


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
        client = httpx.Client(base_url=self.url + path, headers=headers, timeout=30)
        self.clients.append(client)
        return client


@contextmanager
def running(settings: Settings, opening: Opening) -> Iterator[Service]:
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
        service = Service(f"http://127.0.0.1:{port}", app.state.lab, {})
        with service.lab.write(access.SYSTEM) as work:
            for name, scopes in {"both": ("read", "upload"), "read": ("read",), "upload": ("upload",)}.items():
                service.tokens[name] = access.create_token(work, f"stand-{name}", scopes)
        try:
            yield service
        finally:
            for client in service.clients:
                client.close()
    finally:
        server.should_exit = True
        thread.join()


@pytest.fixture(scope="session")
def empty_data(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A data folder with all migrations applied, to be copied."""
    settings = Settings(data=tmp_path_factory.mktemp("empty"))
    with open_lab(settings):
        pass
    return settings.data


@pytest.fixture
def settings(tmp_path: Path, empty_data: Path) -> Settings:
    """A laboratory with nothing in it."""
    return Settings(data=Path(shutil.copytree(empty_data, tmp_path / "data")), upload_limit_bytes=16 * 2**20)


@pytest.fixture
def noted() -> NotingQueue:
    """What the service of `service` asks of its job engine."""
    return NotingQueue()


@pytest.fixture
def noting(noted: NotingQueue) -> Callable[[Settings], AbstractContextManager[Lab]]:
    """Opens the laboratory without a job engine."""
    return lambda settings: open_lab(settings, noted)


@pytest.fixture
def service(settings: Settings, noting: Opening) -> Iterator[Service]:
    """The service without a job engine."""
    with running(settings, noting) as found:
        yield found


@pytest.fixture
def client(service: Service) -> httpx.Client:
    """May read and upload."""
    return service.client()


@pytest.fixture
def stand(client: httpx.Client) -> httpx.Client:
    """The client of a laboratory with gyro 0417, stand S1 and its certificate C-17 of sixteen positions."""
    assert client.post("/gyros", json={"serial": "0417", "type": "GVK-6"}).status_code == 201
    assert client.post("/stands", json={"name": "S1", "latitude_deg": 55.7558}).status_code == 201
    certificate = {"number": "C-17", "valid_from": "2000-01-01", "valid_until": "2100-01-01"}
    positions = [
        {"theta_deg": theta, "psi_deg": psi, "alpha_arcsec": 6.9, "beta_arcsec": -16.4, "gamma_arcsec": 6.6}
        for theta in (0, 90, 180, 270)
        for psi in (0, 90, 180, 270)
    ]
    made = client.post("/stands/S1/certificates", json=certificate | {"positions": positions})
    assert made.status_code == 201, made.text
    return client


@pytest.fixture
def session_id(stand: httpx.Client) -> int:
    """A session of gyro 0417 on stand S1."""
    made = stand.post("/sessions", json={"gyro": "0417", "stand": "S1"})
    assert made.status_code == 201, made.text
    return int(made.json()["id"])
