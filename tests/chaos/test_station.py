"""One automated cycle, and 50 kills of station, service and instruments: the session is that of an undisturbed cycle.

Kills strike at random moments, two or three while each of the seventeen records is made, and two while
the last one is forwarded and the calibration asked for. Whoever was killed is started again with the
same command, as a supervisor or a person would. The instruments of the undisturbed cycle run faster.
"""

import io
import random
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from pathlib import Path

import httpx
import numpy as np
import pyarrow.parquet as pq
import pytest

from app.services import access, sessions
from app.services.access import SYSTEM
from app.services.opening import open_lab
from app.settings import Settings
from app.station.instruments.description import SIMULATED
from app.station.keeping.spool import history_in
from simdevice.scenarios import scenario
from solver.units import arcsec_from_rad, deg_from_rad
from tests.chaos.processes import Program, Service, free_port

SEED = 20261122
KILLS = 50
RECORDS = 17
SPEED, FAST = 30.0, 1000.0
"""Seconds of the laboratory in one: a record of 60 s lasts 2 s while there are kills."""
ON_FOR_S = 7200.0
"""The gyro is warm at the beginning."""
PATIENCE_S = 420.0

pytestmark = pytest.mark.chaos


class Laboratory:
    """A service, two instruments and a station on folders of their own."""

    def __init__(self, folder: Path, speed: float) -> None:
        folder.mkdir()
        self.settings = Settings(data=folder / "data")
        self.spool = folder / "spool"
        with open_lab(self.settings) as lab, lab.write(SYSTEM) as work:
            token = access.create_token(work, "stand-computer", ("read", "upload"))
        ports = [free_port() for _ in range(3)]
        stand, ammeter = (f"TCPIP0::127.0.0.1::{port}::SOCKET" for port in ports[1:])
        powered_on = datetime.now(UTC) - timedelta(seconds=ON_FOR_S / speed)
        self.service = Service(folder / "data", ports[0], folder / "service.log")
        self.instruments = Program(
            folder / "instruments.log", "simdevice", "serve", "--stand-port", ports[1], "--ammeter-port", ports[2],
            "--seed", SEED, "--speed", speed, "--powered-on", powered_on.isoformat(),
        )  # fmt: skip
        self.station = Program(
            folder / "station.log", "station", "run", "--config", _config(folder), "--gyro", "0417", "--stand", "S1",
            "--server", self.service.url, "--token", token, "--spool", self.spool, "--speed", speed, "--unattended",
            "--stand-address", stand, "--ammeter-address", ammeter,
        )  # fmt: skip
        self.ended_by_itself = 0
        self.service.start()
        self.service.wait()
        _register(self.service.url, token)
        self.instruments.start()
        self.station.start()

    def kept(self) -> int:
        """Records that are whole on the station's disk."""
        return len(list((self.spool / "records").glob("*.parquet")))

    def look_after(self) -> bool:
        """Start a station that gave up; tell whether it has finished."""
        if self.station.ended == 0:
            return True
        if self.station.ended is not None:
            self.ended_by_itself += 1
            self.station.start()
        return False

    def kill(self) -> None:
        for program in (self.station, self.instruments, self.service):
            program.kill()


def _config(folder: Path) -> Path:
    """The simulated instruments' file, but for times that matter little here: kills are in the records."""
    text = SIMULATED.read_text(encoding="utf-8")
    for times, old, new in (
        (2, "\ntimeout_s = 5\n", "\ntimeout_s = 2\n"),
        (1, "\nblock_samples = 2000\n", "\nblock_samples = 500\n"),
        (1, "\nwindow_s = 600\nlimit_na_per_s = 0.01\n", "\nwindow_s = 60\nlimit_na_per_s = 1\n"),
    ):
        assert text.count(old) == times, old
        text = text.replace(old, new)
    path = folder / "station.toml"
    path.write_text(text, encoding="utf-8")
    return path


def _register(url: str, token: str) -> None:
    certificate = scenario("gvk-6").bench(SEED).stand.certificate
    angles = ("alpha_arcsec", "beta_arcsec", "gamma_arcsec")
    positions = [
        {"theta_deg": round(deg_from_rad(theta), 6), "psi_deg": round(deg_from_rad(psi), 6)}
        | dict(zip(angles, np.round(arcsec_from_rad(row), 3).tolist(), strict=True))
        for theta, psi, row in zip(certificate.theta, certificate.psi, certificate.angles, strict=True)
    ]
    said = {"number": "C-1", "valid_from": "2000-01-01", "valid_until": "2100-01-01", "positions": positions}
    with httpx.Client(base_url=url + "/api/v1", headers={"Authorization": f"Bearer {token}"}) as client:
        client.post("/gyros", json={"serial": "0417", "type": "GVK-6"}).raise_for_status()
        client.post("/stands", json={"name": "S1", "latitude_deg": 55.7558}).raise_for_status()
        client.post("/stands/S1/certificates", json=said).raise_for_status()


@contextmanager
def laboratory(folder: Path, speed: float) -> Iterator[Laboratory]:
    """A laboratory at work; it does not outlive the block."""
    lab = Laboratory(folder, speed)
    try:
        yield lab
    finally:
        lab.kill()


def finish(lab: Laboratory) -> None:
    deadline = time.monotonic() + PATIENCE_S
    while not lab.look_after():
        assert time.monotonic() < deadline, f"{lab.kept()} records, then:\n{lab.station.said}"
        time.sleep(0.05)


def kill_at_random(lab: Laboratory) -> int:
    """All kills but the last two while records are made, those when all are on the station's disk; how many."""
    moments = random.Random(SEED)
    victims = [name for name in ("station", "service", "instruments") for _ in range((KILLS - 2) // 3)]
    moments.shuffle(victims)
    extra = set(moments.sample(range(RECORDS), len(victims) - 2 * RECORDS))
    done = 0
    for record in range(RECORDS):
        wait_for(lab, record)
        for _ in range(2 + (record in extra)):
            time.sleep(moments.uniform(0.05, 1.8))
            strike(lab, victims.pop(), moments.uniform(0.0, 0.3))
            done += 1
    wait_for(lab, RECORDS)
    strike(lab, "service", 0.2)
    time.sleep(moments.uniform(0.0, 1.0))
    strike(lab, "station", 0.0)
    return done + 2


def strike(lab: Laboratory, victim: str, away_s: float) -> None:
    program: Program = getattr(lab, victim)
    assert not lab.look_after(), "the cycle was over before all kills"
    program.kill()
    time.sleep(away_s)
    program.start()


def wait_for(lab: Laboratory, records: int) -> None:
    """Until so many records are on the station's disk."""
    deadline = time.monotonic() + PATIENCE_S
    while lab.kept() < records:
        assert not lab.look_after(), "the cycle was over before all kills"
        assert time.monotonic() < deadline, f"{lab.kept()} records, then:\n{lab.station.said}"
        time.sleep(0.02)


@dataclass
class Found:
    """A finished session: its records in the order in which they came, and its results."""

    places: list[tuple[float, float, int]]
    revisions: list[int]
    columns: list[np.ndarray]
    parameters: list[dict[str, float | None]]


def found(settings: Settings) -> Found:
    with open_lab(settings) as lab, lab.read(SYSTEM) as work:
        items = sessions.sessions(work, limit=10).items
        assert len(items) == 1, "a run has opened more than one session"
        detail = sessions.detail(work, items[0].id)
        tables = [
            pq.read_table(io.BytesIO(work.files.read(item.record, "parquet"))) for item in detail.revisions
        ]
        return Found(
            [(item.theta_deg, item.psi_deg, item.repeat) for item in detail.revisions],
            [item.revision for item in detail.revisions],
            [np.array([table[name].to_numpy() for name in ("t_s", "jx_ma", "jy_ma")]) for table in tables],
            [{name: item.value for name, item in one.parameters.items()} for one in detail.results],
        )


def test_fifty_kills_change_no_sample(tmp_path: Path) -> None:
    with laboratory(tmp_path / "undisturbed", FAST) as lab:
        finish(lab)
        assert lab.ended_by_itself == 0, lab.station.said
        expected = found(lab.settings)
    with laboratory(tmp_path / "disturbed", SPEED) as lab:
        assert kill_at_random(lab) == KILLS
        finish(lab)
        lab.kill()
        session = found(lab.settings)
        history = history_in(lab.spool)
    # A third of the kills hit the station, a third the instruments, and most of these an acquisition.
    assert history.starts > 10
    assert sum(attempt.verdict is None for attempt in history.attempts) >= 3

    assert len(expected.places) == RECORDS
    assert session.places == expected.places, "a record is missing, doubled or out of order"
    assert session.revisions == expected.revisions
    for place, ours, theirs in zip(session.places, session.columns, expected.columns, strict=True):
        np.testing.assert_array_equal(ours, theirs, err_msg=str(place))
    assert all(columns.shape == (3, 12_000) for columns in expected.columns)
    assert len(expected.parameters) == 1
    assert session.parameters == expected.parameters
