"""A laboratory, the service on it with a queue that only notes, and clients."""

import shutil
import sys
from collections.abc import Iterator
from pathlib import Path

import httpx
import pytest
import sqlalchemy as sa

sys.path.insert(0, str(Path(__file__).parent))  # for `serving`: test modules are no package

from serving import NotingQueue, Server, Service, opened, ready, running, served, visited

from app.main import Opening
from app.services.opening import open_lab
from app.settings import Settings
from app.store import database

UPLOAD_LIMIT_BYTES = 16 * 2**20


@pytest.fixture(scope="session", autouse=True)
def compiled_once() -> Iterator[None]:
    """SQL compiled for one test's database serves the next one's, as in a process with one database.

    SQLAlchemy keeps what it compiled by engine and dialect; every test has an engine of its own, and
    compiling anew took a third of its time.
    """
    first = sa.create_engine("sqlite://")
    with first.connect():  # asks the driver what it can do
        dialect, compiled = first.dialect, {}
    first.dispose()

    def make_engine(url: str) -> sa.Engine:
        engine = made(url)
        if engine.dialect.name == dialect.name:
            engine.dialect = dialect
            engine.update_execution_options(compiled_cache=compiled)
        return engine

    with pytest.MonkeyPatch.context() as patch:
        made = database.make_engine
        patch.setattr(database, "make_engine", make_engine)
        yield


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
    return Settings(
        data=Path(shutil.copytree(empty_data, tmp_path / "data")), upload_limit_bytes=UPLOAD_LIMIT_BYTES
    )


@pytest.fixture
def noted() -> NotingQueue:
    """What the service of `service` asks of its job engine."""
    return NotingQueue()


@pytest.fixture
def noting(noted: NotingQueue) -> Opening:
    """Opens the laboratory without a job engine."""
    return lambda settings: open_lab(settings, noted)


@pytest.fixture(scope="session")
def server(tmp_path_factory: pytest.TempPathFactory, empty_data: Path) -> Iterator[Server]:
    """The server that every test's laboratory is shown by in turn."""
    data = Path(shutil.copytree(empty_data, tmp_path_factory.mktemp("served") / "data"))
    settings = Settings(data=data, upload_limit_bytes=UPLOAD_LIMIT_BYTES)
    with served(settings, lambda settings: open_lab(settings, NotingQueue())) as found:
        yield found


@pytest.fixture
def service(server: Server, settings: Settings, noting: Opening) -> Iterator[Service]:
    """The service of a laboratory of the test's own, without a job engine."""
    before = server.app.state.lab
    with noting(settings) as lab:
        server.show(lab)
        try:
            with visited(server.url, lab) as found:
                yield found
        finally:
            server.show(before)


@pytest.fixture(scope="session")
def shared_service(tmp_path_factory: pytest.TempPathFactory, empty_data: Path) -> Iterator[Service]:
    """One service for tests that only ask, or leave nothing that another test could see."""
    data = shutil.copytree(empty_data, tmp_path_factory.mktemp("shared") / "data")
    with running(Settings(data=Path(data)), lambda settings: open_lab(settings, NotingQueue())) as found:
        yield found


@pytest.fixture
def client(service: Service) -> httpx.Client:
    """May read and upload."""
    return service.client()


@pytest.fixture
def stand(client: httpx.Client) -> httpx.Client:
    """The client of a laboratory with gyro 0417, stand S1 and its certificate C-17 of sixteen positions."""
    return ready(client)


@pytest.fixture
def session_id(stand: httpx.Client) -> int:
    """A session of gyro 0417 on stand S1."""
    return opened(stand)
