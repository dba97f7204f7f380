"""``driftbook simdevice register``: what is simulated, made known to a service."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

from serving import Service

from app.exchange.certificate import read_certificate


def test_register_makes_the_simulated_stand_known(
    driftbook: Callable[..., Any], service: Service, tmp_path: Path
) -> None:
    bench = ("--seed", 7, "--scenario", "south")
    access = ("--server", service.url, "--token", service.tokens["both"])
    for _ in range(2):  # the second time everything is there
        told = driftbook("simdevice", "register", *bench, *access, "--gyro", "SIM-7")
        assert told.code == 0, told.err
    assert "stand SIM" in told.out
    assert driftbook("simulate", "--out", tmp_path / "s", *bench, "--duration", 0.1).code == 0
    client = service.client()
    stand = client.get("/stands/SIM").json()
    assert (stand["latitude_deg"], stand["certificate"]["number"]) == (-33.9, "SIM-south-7")
    assert client.get("/gyros/SIM-7").json()["type"] == "GVK-6"
    kept = client.get("/stands/SIM/certificates/SIM-south-7", headers={"accept": "text/csv"}).content
    written = (tmp_path / "s" / "certificate.csv").read_bytes()
    assert read_certificate(kept, "kept")[0] == read_certificate(written, "written")[0]


def test_register_says_what_the_service_refuses(driftbook: Callable[..., Any], service: Service) -> None:
    told = driftbook("simdevice", "register", "--server", service.url, "--token", service.tokens["read"])
    assert told.code == 2
    line = told.err.splitlines()[-1]  # before it stands the log of the service in this process
    assert line.startswith("driftbook: ")
    assert "needs the scope" in line
