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


def test_register_states_the_ammeters_errors_and_what_is_expected_of_the_type(
    driftbook: Callable[..., Any], service: Service
) -> None:
    """Gains of 1.0003 and 0.9998, zeros of 4 and −3 nA, in `simdevice.scenarios`; a GVK-6 has 10 rad/(s·A)."""
    access = ("--server", service.url, "--token", service.tokens["both"], "--stand", "SIM-P")
    client = service.client()
    for scenario in ("poor-ammeter", "gvk-6"):  # what is stated once is not taken back by the other bench
        told = driftbook("simdevice", "register", "--scenario", scenario, *access)
        assert told.code == 0, told.err
        assert client.get("/stands/SIM-P").json()["uncertainty"] == {
            "u_gain_x_ppm": 300, "u_gain_y_ppm": 300, "u_offset_x_ma": 4e-6, "u_offset_y_ma": 4e-6,
        }  # fmt: skip
    told = driftbook("simdevice", "register", "--scenario", "dtg-4", *access, "--gyro", "SIM-D")
    assert told.code == 0, told.err
    assert client.get("/gyros/SIM-D").json()["type"] == "DTG-4"
    nominals = {item["name"]: item["nominals"] for item in client.get("/types").json()["items"]}
    scales = {name: nominals[name]["kx"]["value"] for name in ("GVK-6", "DTG-4")}
    # 1 rad/(s·A) is 180/π·3600/1000 = 206.265 °/h/mA.
    assert scales == {"GVK-6": 2062.65, "DTG-4": 825.06}
    assert nominals["GVK-6"]["kx"]["standard_uncertainty"] == 21


def test_a_type_that_the_laboratory_knows_keeps_its_expectations(
    driftbook: Callable[..., Any], service: Service
) -> None:
    client = service.client()
    own = {"kx": {"value": 2000.0, "standard_uncertainty": 5.0, "per_kelvin": None}}
    assert client.put("/types/OWN/nominals", json={"nominals": own}).status_code == 200
    told = driftbook(
        "simdevice", "register", "--server", service.url, "--token", service.tokens["both"],
        "--stand", "SIM-O", "--gyro", "SIM-O", "--type", "OWN",
    )  # fmt: skip
    assert told.code == 0, told.err
    assert client.get("/gyros/SIM-O").json()["type"] == "OWN"
    (kept,) = (item for item in client.get("/types").json()["items"] if item["name"] == "OWN")
    assert kept["nominals"] == own


def test_register_says_what_the_service_refuses(driftbook: Callable[..., Any], service: Service) -> None:
    told = driftbook("simdevice", "register", "--server", service.url, "--token", service.tokens["read"])
    assert told.code == 2
    line = told.err.splitlines()[-1]  # before it stands the log of the service in this process
    assert line.startswith("driftbook: ")
    assert "needs the scope" in line
