"""What runs on a stand's computer uses nothing that only POSIX has: the commands, whole, in a process without it."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest
from serving import ready, running
from simulated_laboratory import instruments

from app.exchange.certificate import write_certificate_csv
from app.main import working_lab
from app.services.simulated import certificate_lab
from app.settings import Settings
from simdevice.scenarios import scenario

SCRIPT = Path(__file__).with_name("windows_like.py")
PROJECT = Path(__file__).parents[3]
SEED = 7


def windows_like(folder: Path, *said: str | list[object]) -> list:
    """What comes of commands (lists), or of lines of code of the project's (texts)."""
    orders = [one if isinstance(one, str) else [str(word) for word in one] for one in said]
    done = subprocess.run(
        [sys.executable, str(SCRIPT), json.dumps(orders)],
        capture_output=True,
        text=True,
        env=os.environ | {"DRIFTBOOK_DATA": str(folder / "user"), "PYTHONPATH": str(PROJECT)},
        timeout=300,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return [json.loads(line) for line in done.stdout.splitlines()]


@pytest.fixture(scope="module")
def laboratory(tmp_path_factory):
    head = {"number": "C", "valid_from": "2000-01-01", "valid_until": "2100-01-01"}
    bench = scenario("gvk-6").bench(SEED)
    content = write_certificate_csv(certificate_lab(bench.stand.certificate))
    with running(Settings(data=tmp_path_factory.mktemp("data")), working_lab) as service:
        with service.client() as client:
            ready(client)
            client.post("/stands", json={"name": "SIM", "latitude_deg": 55.7558}).raise_for_status()
            client.post("/stands/SIM/certificates", params=head, content=content,
                        headers={"content-type": "text/csv"}).raise_for_status()  # fmt: skip
        yield service, bench


def test_what_only_posix_has_is_hidden_from_the_project(tmp_path):
    lines = {
        "import fcntl": "ModuleNotFoundError",
        "from termios import tcgetattr": "ModuleNotFoundError",
        "import os; os.fork": "AttributeError",
        "import signal; signal.SIGKILL": "AttributeError",
        "import socket; socket.AF_UNIX": "AttributeError",
        "import os; assert os.name == 'nt' and not hasattr(os, 'getuid')": "done",
        "import os, signal; os.replace, signal.SIGINT": "done",
    }
    assert dict(zip(lines, windows_like(tmp_path, *lines), strict=True)) == lines


def test_simulate_solve_upload_and_the_whole_cycle(laboratory, tmp_path):
    """Half a minute on a busy machine: five commands, of which one is a cycle of nine records."""
    service, bench = laboratory
    folder, token = tmp_path / "session", service.tokens["both"]
    with instruments(bench) as served:
        addresses = ("--stand-address", served.stand, "--ammeter-address", served.ammeter)
        simulated, solved, uploaded, checked, measured = windows_like(
            tmp_path,
            ["simulate", "--out", folder, "--seed", SEED, "--duration", 2, "--gyro", "0417", "--stand", "S1"],
            ["solve", folder, "--json"],
            ["upload", folder, "--server", service.url, "--token", token],
            ["station", "check", *addresses],
            ["station", "run", "--gyro", "0417", "--stand", "SIM", "--server", service.url, "--token", token,
             "--spool", tmp_path / "spool", "--positions", 8, "--speed", 1000, *addresses],
        )  # fmt: skip
    for outcome in (simulated, solved, uploaded, checked, measured):
        assert outcome["code"] == 0, outcome["err"]
    # Ten percent: a short record at 55.76° must only show that it is a result at all.
    assert json.loads(solved["out"])["parameters"]["kx"]["value"] == pytest.approx(2062.65, rel=0.1)
    assert "16 positions" in uploaded["out"]
    assert "SIM-STAND" in checked["out"]
    assert f"{service.url}/results/" in measured["out"]
