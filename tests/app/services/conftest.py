"""A laboratory of one gyro, one stand and one certificate, with the real ledger and no processes."""

import shutil
from collections.abc import Callable, Iterator
from datetime import date
from pathlib import Path
from typing import Any

import pytest

from app.exchange.rows import CertificateRow, MeansRow
from app.services import access, gyros, stands
from app.services.access import SYSTEM
from app.services.lab import Lab
from app.services.opening import open_lab
from app.services.sessions import NewSession, open_session
from app.services.simulated import Conditions, bench_for
from app.settings import Settings
from simdevice.bench import Bench

PLACES = [(theta, psi) for theta in (0.0, 90.0, 180.0, 270.0) for psi in (0.0, 90.0, 180.0, 270.0)]


class HandQueue:
    """Notes jobs; the test runs them itself."""

    def __init__(self) -> None:
        self.queued: list[str] = []
        self.cancelled: list[str] = []

    def enqueue(self, session: Any, job_id: str, *, priority: int = 100) -> None:
        self.queued.append(job_id)

    def cancel(self, job_id: str) -> None:
        self.cancelled.append(job_id)


@pytest.fixture
def queue() -> HandQueue:
    return HandQueue()


@pytest.fixture(scope="session")
def prepared(tmp_path_factory: pytest.TempPathFactory, empty_data: Path) -> Path:
    """The laboratory's folder, to be copied: hashing a password is slow on purpose."""
    data = Path(shutil.copytree(empty_data, tmp_path_factory.mktemp("prepared") / "data"))
    with open_lab(Settings(data=data)) as opened, opened.write(SYSTEM) as work:
        access.add_account(work, "petrova", "technician", "a good password")
        gyros.add_gyro(work, "0417", "GVK-6")
        stands.add_stand(work, "S1", 55.7558)
        rows = [CertificateRow(theta, psi, 6.9, -16.4, 6.6, 0.5, 0.5, 0.5) for theta, psi in PLACES]
        stands.add_certificate(work, "S1", "C-17", date(2000, 1, 1), date(2100, 1, 1), rows)
    return data


@pytest.fixture
def lab(tmp_path: Path, queue: HandQueue, prepared: Path) -> Iterator[Lab]:
    data = Path(shutil.copytree(prepared, tmp_path / "data"))
    with open_lab(Settings(data=data), queue) as opened:
        yield opened


@pytest.fixture
def session_id(lab: Lab) -> int:
    """An open session of gyro 0417 on stand S1."""
    with lab.write(SYSTEM) as work:
        return open_session(work, NewSession("0417", "S1")).id


@pytest.fixture
def currents() -> Callable[..., MeansRow]:
    """Makes plausible means of the n-th position, different for each."""

    def make(place: int, **changes: Any) -> MeansRow:
        theta, psi = PLACES[place]
        values = {
            "jx_ma": 1e-3 * (place + 1),
            "jy_ma": -5e-4 * (place + 2),
            "duration_s": 60.0,
            "rate_hz": 200.0,
        }
        return MeansRow(theta, psi, **(values | changes))

    return make


@pytest.fixture
def bench() -> Bench:
    """A simulated bench whose certificate is the laboratory's C-17, to the arcsecond."""
    rows = [CertificateRow(theta, psi, 6.9, -16.4, 6.6, 0.5, 0.5, 0.5) for theta, psi in PLACES]
    return bench_for(Conditions("GVK-6", "0417", "S1", 1, seed=5), rows, 55.7558)
