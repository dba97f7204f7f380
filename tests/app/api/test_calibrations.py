"""From means to a result, with the real job engine and the real solver."""

import csv
import io
import json
import random
from pathlib import Path
from typing import Any

import httpx
import pytest
from serving import GRID, Service, opened

from app.exchange.json_values import dumps
from app.exchange.result import calibration_json
from app.exchange.rows import CertificateRow, MeansRow
from app.exchange.si import observations
from solver.calibrate import calibrate

PARAMETERS = ["kx", "ky", "kxy", "kyx", "w0x", "w0y", "wg", "wk"]


def wait(client: httpx.Client, answer: httpx.Response) -> dict[str, Any]:
    """Follow a job's events to its end."""
    assert answer.status_code == 202, answer.text
    with client.stream("GET", answer.headers["location"].removeprefix("/api/v1") + "/events") as stream:
        lines = [line.removeprefix("data: ") for line in stream.iter_lines() if line.startswith("data: ")]
    job: dict[str, Any] = json.loads(lines[-1])
    return job


def put_all(client: httpx.Client, session_id: int, means: list[dict[str, float]]) -> None:
    for row in means:
        place = f"/sessions/{session_id}/positions/{row['theta_deg']}/{row['psi_deg']}/means"
        answer = client.put(place, json={"jx_ma": row["jx_ma"], "jy_ma": row["jy_ma"]})
        assert answer.status_code == 201, answer.text


def solved(client: httpx.Client, session_id: int, method: str = "both") -> dict[str, Any]:
    job = wait(client, client.post(f"/sessions/{session_id}/calibrations", json={"method": method}))
    assert (job["state"], job["progress"], job["error"]) == ("succeeded", 1.0, None), job
    found: dict[str, Any] = client.get(job["result"].removeprefix("/api/v1")).json()
    return found


@pytest.fixture
def client(solving: Service) -> httpx.Client:
    return solving.client()


@pytest.fixture(scope="module")
def means(solving: Service) -> list[dict[str, float]]:
    """Means of a simulated session, as its file gives them."""
    client = solving.client()
    wait(
        client, client.post("/simulations", json={"gyro": "0417", "stand": "S1", "seed": 1, "duration_s": 5})
    )
    number = client.get("/sessions?limit=1").json()["items"][0]["id"]
    table = client.get(f"/sessions/{number}/positions", headers={"accept": "text/csv"}).text
    names = ("theta_deg", "psi_deg", "jx_ma", "jy_ma")
    return [{name: float(row[name]) for name in names} for row in csv.DictReader(io.StringIO(table))]


def test_a_result_is_the_solvers_own(client: httpx.Client, means: list[dict[str, float]]) -> None:
    session_id = opened(client)
    put_all(client, session_id, means)
    found = solved(client, session_id)
    rows = [MeansRow(**row) for row in means]
    certificate = [CertificateRow(theta, psi, 6.9, -16.4, 6.6) for theta, psi in GRID]
    direct = json.loads(
        dumps(calibration_json(calibrate(observations(rows, certificate, 55.7558), "both"), "both"))
    )
    for method in ("least-squares", "paper"):
        assert {name: found[method][name] for name in direct[method]} == direct[method]
    assert found["input_hash"] == direct["input_hash"]
    assert (found["session"], found["gyro"], found["certificate"]) == (session_id, "0417", "C-17")
    assert (found["revision"], found["replaces"], found["replaced_by"]) == (1, None, None)


def test_one_method_stands_at_the_top(client: httpx.Client, means: list[dict[str, float]]) -> None:
    session_id = opened(client)
    put_all(client, session_id, means)
    found = solved(client, session_id, "least-squares")
    assert list(found["parameters"]) == PARAMETERS
    assert set(found["parameters"]["kx"]) == {
        "value", "standard_uncertainty", "unit", "value_si", "unit_si", "dof", "coverage_factor",
        "expanded_uncertainty", "dominated_by",
    }  # fmt: skip
    assert {"budget", "monte_carlo", "model", "diagnosis", "not_excluded", "stated"} <= set(found)
    assert len(found["covariance"]) == len(found["covariance"][0]) == 8
    assert len(found["residuals"]) == 16
    assert found["fit"]["dof"] == 24  # 32 equations, 8 unknowns
    assert "paper" not in found


def test_the_same_means_by_every_way_give_the_same_bits(
    client: httpx.Client, means: list[dict[str, float]]
) -> None:
    shuffled = random.Random(7).sample(means, len(means))
    by_json = opened(client)
    put_all(client, by_json, shuffled)
    results = [solved(client, by_json)]
    in_ma = "theta_deg,psi_deg,jx_ma,jy_ma\n" + "".join(
        f"{row['theta_deg']},{row['psi_deg']},{row['jx_ma']!r},{row['jy_ma']!r}\n" for row in means
    )
    with_commas = in_ma.replace(",", ";").replace(".", ",")
    for text in (in_ma, with_commas):
        made = client.post(
            "/sessions/upload",
            params={"gyro": "0417", "stand": "S1", "filename": "means.csv"},
            content=text.encode(),
        )
        assert made.status_code == 201, made.text
        results.append(solved(client, made.json()["session"]["id"]))
    assert len({item["input_hash"] for item in results}) == 1
    # What each is judged against, the gyro's calibration before, differs; what follows from the means does not.
    for name in ("parameters", "covariance", "residuals", "fit", "budget", "monte_carlo", "model"):
        assert len({json.dumps(item["least-squares"][name]) for item in results}) == 1, name


def test_asking_again_changes_nothing(client: httpx.Client, means: list[dict[str, float]]) -> None:
    session_id = opened(client)
    put_all(client, session_id, means)
    first, again = solved(client, session_id), solved(client, session_id)
    assert again == first
    client.put(f"/sessions/{session_id}/positions/0/0/means", json={"jx_ma": means[0]["jx_ma"], "jy_ma": 0.0})
    corrected = solved(client, session_id)
    assert (corrected["revision"], corrected["replaces"]) == (2, first["id"])
    assert client.get(f"/calibrations/{first['id']}").json()["replaced_by"] == corrected["id"]


def test_a_calibration_of_nothing(client: httpx.Client) -> None:
    session_id = opened(client)
    refused = client.post(f"/sessions/{session_id}/calibrations", json={})
    assert (refused.status_code, refused.json()["code"]) == (422, "nothing-measured")
    refused = client.post(f"/sessions/{session_id}/calibrations", json={"method": "best"})
    assert refused.json()["errors"][0]["pointer"] == "#/method"
    assert client.post("/sessions/999/calibrations", json={}).status_code == 404


def test_a_simulation_is_solved_and_near_its_truth(client: httpx.Client) -> None:
    asked = client.post("/simulations", json={"gyro": "0417", "stand": "S1", "seed": 7, "duration_s": 10})
    job = wait(client, asked)
    assert job["state"] == "succeeded", job
    found = client.get(job["result"].removeprefix("/api/v1")).json()
    session = client.get(f"/sessions/{found['session']}").json()
    assert (session["origin"], session["state"], session["positions_measured"]) == (
        "simulation",
        "solved",
        16,
    )
    assert list(session["truth"]["parameters"]) == PARAMETERS
    for name, truth in session["truth"]["parameters"].items():
        estimate = found["least-squares"]["parameters"][name]
        # Six standard uncertainties: eight parameters of one seeded session, and u itself is estimated.
        assert truth["unit"] == estimate["unit"]
        assert abs(estimate["value"] - truth["value"]) < 6 * estimate["standard_uncertainty"], name


def test_results_in_a_list_and_over_time(client: httpx.Client, means: list[dict[str, float]]) -> None:
    client.post("/gyros", json={"serial": "0500", "type": "GVK-9"})
    client.put("/types/GVK-9/limits", json={"limits": {"wg": {"low": -1e9, "high": 1e9}}})
    values = []
    for day in (1, 2):
        session_id = opened(client, gyro="0500", started_at=f"2026-03-0{day}T09:30:00Z")
        put_all(client, session_id, [row | {"jx_ma": row["jx_ma"] * (1 + day * 1e-6)} for row in means])
        values.append(solved(client, session_id)["least-squares"]["parameters"]["wg"]["value"])
    history = client.get("/gyros/0500/history", params={"parameter": "wg"}).json()["series"][0]
    assert [point["value"] for point in history["points"]] == values
    assert (history["low"], history["high"]) == (-1e9, 1e9)
    later = client.get("/gyros/0500/history", params={"parameter": "wg", "from": "2026-03-02"}).json()
    assert [point["value"] for point in later["series"][0]["points"]] == values[1:]
    table = client.get("/gyros/0500/history?parameter=wg", headers={"accept": "text/csv"}).text
    assert [float(row["value"]) for row in csv.DictReader(io.StringIO(table))] == values
    listed = client.get("/calibrations", params={"gyro": "0500", "limit": 1}).json()
    assert listed["items"][0]["parameters"]["wg"]["value"] == values[1]
    assert listed["items"][0]["parameters"]["wg"]["verdict"] in ("conforms", "conditional")
    rest = client.get(listed["next"].removeprefix("/api/v1"), headers={"accept": "text/csv"}).text
    assert [float(row["wg_deg_per_h_per_g"]) for row in csv.DictReader(io.StringIO(rest))] == values[:1]
    assert client.get("/gyros/0500").json()["last_result"]["id"] == listed["items"][0]["id"]


def test_a_long_session_is_imported(
    client: httpx.Client, record_csv: bytes, record_parquet: bytes, monkeypatch: pytest.MonkeyPatch
) -> None:
    from app.services import uploads

    monkeypatch.setattr(uploads, "LARGEST_AT_ONCE", 100_000)
    params = {"gyro": "0417", "stand": "S1", "filename": "theta090_psi180.csv"}
    made = client.post("/sessions/upload", params=params, content=record_csv)
    job = wait(client, made)
    session_id = made.json()["session"]["id"]
    assert (job["state"], job["result"]) == ("succeeded", f"/api/v1/sessions/{session_id}")
    imported = client.get(f"/sessions/{session_id}/positions").json()["items"][6]["measurement"]
    at_once = client.put(f"/sessions/{session_id}/positions/90/180/currents", content=record_parquet).json()
    assert imported["record_sha256"] == at_once["record_sha256"]
    assert imported["jx_ma"] == at_once["jx_ma"]


def test_an_import_that_fails_says_why(
    client: httpx.Client, record_csv: bytes, monkeypatch: pytest.MonkeyPatch
) -> None:
    from app.services import uploads

    monkeypatch.setattr(uploads, "LARGEST_AT_ONCE", 0)
    for name, content, code, place in (
        ("theta045_psi000.csv", record_csv, "position-not-certified", {}),
        (
            "theta000_psi000.csv",
            b"t_s,jx_ma,jy_ma\n0,1,1\n1,x,1\n",
            "not-a-number",
            {"row": 3, "column": "jx_ma"},
        ),
    ):
        params = {"gyro": "0417", "stand": "S1", "filename": name}
        job = wait(client, client.post("/sessions/upload", params=params, content=content))
        assert (job["state"], job["result"]) == ("failed", None)
        assert job["error"]["code"] == code
        assert {key: job["error"]["errors"][0].get(key) for key in place} == place
        assert client.get(f"/sessions/{job['session']}").json()["state"] == "failed"


def test_records_are_on_disk_under_their_names(solving: Service) -> None:
    for digest, path in solving.lab.files:
        assert solving.lab.files.read(digest, path.name.split(".", 1)[1])
    assert Path(solving.lab.settings.data, "driftbook.sqlite").exists()
