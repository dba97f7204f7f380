"""The whole service, killed with SIGKILL at random moments: nothing acknowledged is lost, no job is stuck.

Clients do what a stand's computer does: open sessions, put positions (means and records), ask for
calibrations, and repeat what was not acknowledged. Meanwhile the service is killed and started
again, thirty times. What it acknowledged is written down by the clients and compared at the end.
"""

import random
import threading
import time
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import httpx
import numpy as np
import pytest

from app.exchange.record_files import write_record_parquet
from app.exchange.rows import CurrentRecord
from app.services import access, sessions
from app.services.access import SYSTEM
from app.services.opening import open_lab
from app.settings import Settings
from tests.chaos.processes import Service, free_port

KILLS = 30
SEED = 20261122
PLACES = [(theta, psi) for theta in (0, 90, 180, 270) for psi in (0, 90, 180, 270)]
PATIENCE_S = 120

pytestmark = pytest.mark.chaos


@dataclass
class Acknowledged:
    """What the service said it has, by session."""

    means: dict[int, dict[tuple[int, int], float]] = field(default_factory=dict)
    records: dict[int, dict[tuple[int, int], str]] = field(default_factory=dict)
    jobs: dict[str, int] = field(default_factory=dict)
    keys: dict[str, int] = field(default_factory=dict)


class Stand(threading.Thread):
    """One stand's computer. Stops when told, after a whole session."""

    def __init__(self, name: str, url: str, token: str, seed: int) -> None:
        super().__init__(name=name, daemon=True)
        self._name, self._random = name, random.Random(seed)
        headers = {"Authorization": f"Bearer {token}"}
        self._client = httpx.Client(base_url=url + "/api/v1", headers=headers, timeout=20)
        self.done = Acknowledged()
        self.stop, self.refused = threading.Event(), []

    def run(self) -> None:
        number = 0
        while not self.stop.is_set():
            self._session(f"{self._name}-{number}")
            number += 1
        self._client.close()

    def _session(self, key: str) -> None:
        said = {"gyro": self._name, "stand": "S1", "started_at": "2026-11-20T09:00:00Z"}
        opened = self._send("POST", "/sessions", json=said, headers={"Idempotency-Key": key})
        session = int(opened["id"])
        self.done.keys[key] = session
        for theta, psi in PLACES:
            place = f"/sessions/{session}/positions/{theta}/{psi}"
            if self._random.random() < 0.2:
                saved = self._send("PUT", place + "/currents", content=self._record(theta, psi),
                                   params={"filename": f"theta{theta:03}_psi{psi:03}.parquet"})  # fmt: skip
                self.done.records.setdefault(session, {})[theta, psi] = saved["record_sha256"]
            else:
                jx_ma = self._random.uniform(-5e-3, 5e-3)
                body = {
                    "jx_ma": jx_ma,
                    "jy_ma": self._random.uniform(-5e-3, 5e-3),
                    "duration_s": 60,
                    "rate_hz": 200,
                }
                self._send("PUT", place + "/means", json=body)
                self.done.means.setdefault(session, {})[theta, psi] = jx_ma
        job = self._send(
            "POST", f"/sessions/{session}/calibrations", json={"method": "both", "monte_carlo": 0}
        )
        self.done.jobs[job["id"]] = session

    def _record(self, theta: int, psi: int) -> bytes:
        rng = np.random.default_rng(self._random.randrange(2**32))
        t_s = np.arange(400) / 200.0
        jx_ma, jy_ma = rng.normal(1e-3, 1e-5, (2, 400))
        return write_record_parquet(CurrentRecord(theta, psi, t_s, jx_ma, jy_ma))

    def _send(self, verb: str, path: str, **what: object) -> dict[str, object]:
        """Until it is acknowledged."""
        for _ in range(6000):
            try:
                answer = self._client.request(verb, path, **what)
            except httpx.TransportError:
                time.sleep(0.05)
                continue
            if answer.status_code < 500:
                assert answer.is_success, answer.text
                return answer.json()
            self.refused.append(answer.text)
            time.sleep(0.05)
        raise AssertionError(f"{verb} {path} was never acknowledged")


def prepare(settings: Settings) -> str:
    with open_lab(settings) as lab, lab.write(SYSTEM) as work:
        return access.create_token(work, "stand-computer", ("read", "upload"))


def register(url: str, token: str, names: list[str]) -> None:
    positions = [
        {"theta_deg": t, "psi_deg": p, "alpha_arcsec": 5, "beta_arcsec": -3, "gamma_arcsec": 2}
        for t, p in PLACES
    ]
    certificate = {
        "number": "C-1",
        "valid_from": "2026-01-01",
        "valid_until": "2027-01-01",
        "positions": positions,
    }
    with httpx.Client(base_url=url + "/api/v1", headers={"Authorization": f"Bearer {token}"}) as client:
        for name in names:
            client.post("/gyros", json={"serial": name, "type": "GVK-6"}).raise_for_status()
        client.post("/stands", json={"name": "S1", "latitude_deg": 55.7558}).raise_for_status()
        client.post("/stands/S1/certificates", json=certificate).raise_for_status()


@pytest.fixture
def service(tmp_path: Path) -> Iterator[Service]:
    """A service to be killed; it does not outlive the test."""
    service = Service(tmp_path / "data", free_port(), tmp_path / "log")
    yield service
    service.kill()


def test_thirty_kills_lose_nothing(tmp_path: Path, service: Service) -> None:
    settings = Settings(data=tmp_path / "data")
    token = prepare(settings)
    service.start()
    service.wait()
    names = ["G-1", "G-2"]
    register(service.url, token, names)
    stands = [Stand(name, service.url, token, SEED + n) for n, name in enumerate(names)]
    for stand in stands:
        stand.start()
    kill_at_random(service)
    for stand in stands:
        stand.stop.set()
    for stand in stands:
        stand.join(PATIENCE_S)
        assert not stand.is_alive(), "a client waits for ever"
    jobs = {job: session for stand in stands for job, session in stand.done.jobs.items()}
    states = wait_for_jobs(service.url, token, list(jobs))
    service.kill()

    assert set(states.values()) == {"succeeded"}, states
    assert len(jobs) >= 5, "the service was hardly ever up: too few sessions to prove anything"
    compare(settings, stands)


def kill_at_random(service: Service) -> None:
    """Thirty times: one in five while it starts, the others while it receives, queues and solves."""
    moments = random.Random(SEED)
    for _ in range(KILLS):
        if moments.random() < 0.2:
            time.sleep(moments.uniform(0.05, 2.0))
        else:
            service.wait()
            time.sleep(moments.uniform(0.05, 2.5))
        service.kill()
        service.start()
    service.wait()


def wait_for_jobs(url: str, token: str, jobs: list[str]) -> dict[str, str]:
    states: dict[str, str] = {}
    found: dict[str, dict[str, object]] = {}
    end = time.monotonic() + PATIENCE_S
    with httpx.Client(base_url=url + "/api/v1", headers={"Authorization": f"Bearer {token}"}) as client:
        while time.monotonic() < end:
            found = {job: client.get(f"/jobs/{job}").json() for job in jobs}
            states = {job: item["state"] for job, item in found.items()}
            if not {"queued", "running"} & set(states.values()):
                break
            time.sleep(0.5)
    reasons = [item["error"] for item in found.values() if item["error"]]
    assert not reasons, reasons
    return states


def compare(settings: Settings, stands: list[Stand]) -> None:
    with open_lab(settings) as lab, lab.read(SYSTEM) as work:
        keys = {key: session for stand in stands for key, session in stand.done.keys.items()}
        assert len(set(keys.values())) == len(keys), "a session was opened for two keys"
        listed = sessions.sessions(work, limit=1000).items
        assert {item.id for item in listed} == set(keys.values()), (
            "a repeated request opened a second session"
        )
        for stand in stands:
            for session, means in stand.done.means.items():
                kept = newest(work, session)
                assert {place: kept[place].jx_ma for place in means} == means
            for session, records in stand.done.records.items():
                kept = newest(work, session)
                for place, digest in records.items():
                    assert kept[place].record == digest
                    assert work.files.read(digest, "parquet"), "the record's bytes are those of its name"
            for job_session in stand.done.jobs.values():
                assert sessions.session(work, job_session).result is not None


def newest(work, session):
    return {
        (int(item.theta_deg), int(item.psi_deg)): item.measurement
        for item in sessions.detail(work, session).positions
        if item.measurement is not None
    }
