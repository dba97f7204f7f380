import math
import shutil
import warnings
from collections.abc import Callable, Iterator
from datetime import date, timedelta
from pathlib import Path

import drift_laboratory
import pytest
from fastapi import FastAPI
from fastapi.exceptions import RequestValidationError
from sqlalchemy.orm import Session
from starlette.exceptions import HTTPException, StarletteDeprecationWarning

from app import pages
from app.errors import AppError
from app.exchange.rows import CertificateRow, MeansRow
from app.services import access, calibrations, computing, gyros, ingest, sessions, stands
from app.services.lab import Lab
from app.services.sessions import NewSession, open_session
from app.settings import Settings
from app.store.database import Database
from app.store.migrate import upgrade
from app.store.records import RecordFiles

with warnings.catch_warnings():
    # Starlette's client would rather have a successor of httpx; ours is the one the product itself uses.
    warnings.simplefilter("ignore", StarletteDeprecationWarning)
    from fastapi.testclient import TestClient

PASSWORD = "correct horse battery"
GRID = [(theta, psi) for theta in (0.0, 90.0, 180.0, 270.0) for psi in (0.0, 90.0, 180.0, 270.0)]


class Notebook:
    """Stands for the job engine: notes what it is asked for."""

    def __init__(self) -> None:
        self.queued: list[str] = []
        self.cancelled: list[str] = []

    def enqueue(self, session: Session, job_id: str, *, priority: int = 100) -> None:
        self.queued.append(job_id)

    def cancel(self, job_id: str) -> None:
        self.cancelled.append(job_id)


@pytest.fixture
def queue() -> Notebook:
    return Notebook()


@pytest.fixture
def queued(queue: Notebook) -> list[str]:
    """Jobs that were put in the queue."""
    return queue.queued


@pytest.fixture
def cancelled(queue: Notebook) -> list[str]:
    """Jobs that were taken out of it."""
    return queue.cancelled


@pytest.fixture(scope="session")
def prepared(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A database with its tables and accounts, to be copied: hashing a password is slow on purpose."""
    return _made(tmp_path_factory.mktemp("prepared"), lambda _: None)


@pytest.fixture(scope="session")
def laid(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The same with gyro 0417, a year of its results and a study: for modules whose `prepared` this is."""
    return _made(tmp_path_factory.mktemp("laid"), drift_laboratory.studied_laboratory)


def _made(folder: Path, furnish: Callable[[Lab], object]) -> Path:
    settings = Settings(data=folder)
    database = Database(settings.url)
    upgrade(database)
    lab = Lab(settings, database, RecordFiles(settings.records), Notebook())
    with lab.write(access.SYSTEM) as work:
        access.add_account(work, "irina", "technician", PASSWORD, "I. Petrova")
        access.add_account(work, "dmitri", "designer", None, "D. Ivanov")
        access.add_account(work, "natalia", "quality", None, "N. Orlova")
    furnish(lab)
    database.close()
    return settings.data / "driftbook.sqlite"


@pytest.fixture
def lab(tmp_path: Path, queue: Notebook, prepared: Path) -> Iterator[Lab]:
    settings = Settings(data=tmp_path)
    shutil.copy(prepared, tmp_path)
    database = Database(settings.url)
    yield Lab(settings, database, RecordFiles(settings.records), queue)
    database.close()


@pytest.fixture(scope="session")
def all_pages() -> FastAPI:
    """The pages, made once: their routes are put together at the first request, which takes a while."""
    app = FastAPI(openapi_url=None)
    for kind in (AppError, RequestValidationError, HTTPException, Exception):
        app.add_exception_handler(kind, pages.errors.page)
    pages.mount(app)
    return app


@pytest.fixture
def application(all_pages: FastAPI, lab: Lab) -> FastAPI:
    all_pages.state.lab = lab
    return all_pages


@pytest.fixture
def anonymous(application: FastAPI) -> TestClient:
    return TestClient(application, follow_redirects=False, raise_server_exceptions=False)


def _signed_in(application: FastAPI, lab: Lab, name: str) -> TestClient:
    client = TestClient(application, follow_redirects=False, raise_server_exceptions=False)
    with lab.write(access.SYSTEM) as work:
        secret = access.make_sign_in_link(work, name, timedelta(minutes=5))
    assert client.get(f"/sign-in/link/{secret}").status_code == 303
    return client


@pytest.fixture
def technician(application: FastAPI, lab: Lab) -> TestClient:
    """May read and upload."""
    return _signed_in(application, lab, "irina")


@pytest.fixture
def designer(application: FastAPI, lab: Lab) -> TestClient:
    """May only read."""
    return _signed_in(application, lab, "dmitri")


@pytest.fixture
def quality(application: FastAPI, lab: Lab) -> TestClient:
    """May judge as well: freeze baselines, answer for alarms."""
    return _signed_in(application, lab, "natalia")


@pytest.fixture
def metrologist(application: FastAPI, lab: Lab) -> TestClient:
    """Judges too, and answers for the results."""
    with lab.write(access.SYSTEM) as work:
        access.add_account(work, "anna", "metrologist", None, "A. Sokolova")
    return _signed_in(application, lab, "anna")


@pytest.fixture
def stocked(lab: Lab) -> Lab:
    """A laboratory with a gyro, its type's limits, a stand and its certificate."""
    with lab.write(access.SYSTEM) as work:
        gyros.set_limits(work, "GVK-6", {"w0x": (-2.0, 2.0), "w0y": (-0.8, 0.8)})
        gyros.add_gyro(work, "0417", "GVK-6", "first of the series")
        stands.add_stand(work, "S1", 55.7558, "room 12")
        rows = [CertificateRow(theta, psi, 6.9, -16.4, 6.6) for theta, psi in GRID]
        stands.add_certificate(work, "S1", "C-17", date(2020, 1, 1), date(2100, 1, 1), rows, "Metrology")
    return lab


def currents_ma(theta_deg: float, psi_deg: float) -> tuple[float, float]:
    """Torquer currents of a gyro without misalignment at 55.7558° (paper, eq. (7) to (15)), with a little noise.

    K = 2063 °/h/mA on both axes, no cross-coupling, ω0 = (1.5, −0.75) °/h, ωg = 0.9, ωк = −0.2 °/h/g.
    """
    theta, psi, latitude = (math.radians(angle) for angle in (theta_deg, psi_deg, 55.7558))
    north, up = 15.041067 * math.cos(latitude), 15.041067 * math.sin(latitude)
    a, b = math.sin(psi) * math.cos(theta), math.cos(psi) * math.cos(theta)
    c, d = math.sin(psi) * math.sin(theta), math.cos(psi) * math.sin(theta)
    noise = 2e-3 * math.sin(7.0 * theta_deg + 3.0 * psi_deg + 1.0)
    jx = (north * a + up * c - 1.5 - 0.9 * c - 0.2 * d + noise) / 2063.0
    jy = (north * b + up * d + 0.75 + 0.2 * c - 0.9 * d - noise) / 2063.0
    return jx, jy


@pytest.fixture
def opened(stocked: Lab) -> int:
    """A session of gyro 0417 on stand S1 in which nothing is measured."""
    with stocked.write(access.SYSTEM) as work:
        return open_session(work, NewSession("0417", "S1", temperature_c=21.5)).id


@pytest.fixture
def measured(stocked: Lab, opened: int) -> int:
    """A session in which every position is typed."""
    with stocked.write(access.SYSTEM) as work:
        for theta, psi in GRID:
            row = MeansRow(theta, psi, *currents_ma(theta, psi), 1e-6, 1e-6, 60.0, 200.0)
            ingest.save_means(work, opened, row, ingest.Source("typed"))
    return opened


def solve(lab: Lab, session_id: int, method: str = "both") -> int:
    """Solve a session here and now, as the job would, and keep its result."""
    with lab.write(access.SYSTEM) as work:
        inputs = [item.measurement.id for item in sessions.detail(work, session_id).positions
                  if item.measurement and not item.measurement.withdrawn]  # fmt: skip
        wanted = {"method": method, "inputs": inputs}
        output = computing.calibrate(calibrations.prepare(work, session_id, wanted), lambda part, phase: None)
        return calibrations.store(work, session_id, wanted, output)


@pytest.fixture
def result(stocked: Lab, measured: int) -> int:
    """The result of a session by both methods."""
    return solve(stocked, measured)


@pytest.fixture
def solving() -> Callable[..., int]:
    """Solves a session here and now."""
    return solve
