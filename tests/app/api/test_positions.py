import gzip
import hashlib
import io
import socket
import threading
from typing import Any

import httpx
import numpy as np
import pyarrow.parquet as pq
import pytest
import structlog
from serving import Service, wait_until

MEANS = {"jx_ma": 0.004536, "jy_ma": -0.002117, "duration_s": 60, "rate_hz": 200}
CSV, PARQUET = {"content-type": "text/csv"}, {"content-type": "application/vnd.apache.parquet"}


def place(session_id: int, what: str, theta: str = "0", psi: str = "90") -> str:
    return f"/sessions/{session_id}/positions/{theta}/{psi}/{what}"


def test_means_once_again_and_corrected(stand: httpx.Client, session_id: int) -> None:
    path = place(session_id, "means")
    answers = [stand.put(path, json=MEANS | change) for change in ({}, {}, {"jx_ma": 0.0046}, {})]
    assert [answer.status_code for answer in answers] == [201, 200, 201, 201]
    assert [answer.json()["revision"] for answer in answers] == [1, 1, 2, 3]
    assert answers[0].json() == answers[1].json()
    position = stand.get(f"/sessions/{session_id}").json()["positions"][1]
    assert position["measurement"] == answers[3].json()
    assert stand.get(f"/sessions/{session_id}").json()["positions_measured"] == 1


def test_numbers_come_back_to_the_last_bit(stand: httpx.Client, session_id: int) -> None:
    said = {"jx_ma": 0.1 + 0.2, "jy_ma": -5e-324, "u_jx_ma": 1 / 3, "u_jy_ma": 2.2250738585072014e-308}
    made = stand.put(place(session_id, "means"), json=said).json()
    assert {name: made[name].hex() for name in said} == {name: value.hex() for name, value in said.items()}


@pytest.mark.parametrize(
    ("theta", "psi"), [("90", "270"), ("090", "270.0"), ("450", "-90"), ("90.0000001", "270")]
)
def test_one_position_by_several_names(stand: httpx.Client, session_id: int, theta: str, psi: str) -> None:
    made = stand.put(place(session_id, "means", theta, psi), json=MEANS)
    assert made.status_code == 201
    assert (made.json()["theta_deg"], made.json()["psi_deg"]) == (90.0, 270.0)


def test_a_position_that_is_not_certified(stand: httpx.Client, session_id: int) -> None:
    refused = stand.put(place(session_id, "means", "45", "0"), json=MEANS)
    assert (refused.status_code, refused.json()["code"]) == (422, "position-not-certified")


def test_repeats_are_measurements_of_their_own(stand: httpx.Client, session_id: int) -> None:
    path = place(session_id, "means")
    assert stand.put(path, json=MEANS).status_code == 201
    assert stand.put(path, json=MEANS | {"repeat": 1}).status_code == 201
    assert stand.put(path, json=MEANS, params={"repeat": 1}).status_code == 200
    found = [
        item for item in stand.get(f"/sessions/{session_id}/positions").json()["items"] if item["measurement"]
    ]
    assert [item["repeat"] for item in found] == [0, 1]


def test_two_clients_at_once(service: Service, stand: httpx.Client, session_id: int) -> None:
    path, ready, answers = place(session_id, "means"), threading.Barrier(8), []

    def put(number: int) -> None:
        client = service.client()
        ready.wait()
        answers.append(client.put(path, json=MEANS | {"jx_ma": 0.001 * number}))

    threads = [threading.Thread(target=put, args=(number,)) for number in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert [answer.status_code for answer in answers] == [201] * 8
    assert sorted(answer.json()["revision"] for answer in answers) == list(range(1, 9))
    last = max(answers, key=lambda answer: answer.json()["revision"]).json()
    assert stand.get(f"/sessions/{session_id}").json()["positions"][1]["measurement"] == last


def test_means_as_the_file_that_they_are(stand: httpx.Client, session_id: int) -> None:
    stand.put(place(session_id, "means"), json=MEANS)
    stand.put(place(session_id, "means", "90", "0"), json={"jx_ma": 0.1, "jy_ma": 0.2})
    table = stand.get(f"/sessions/{session_id}/positions", headers={"accept": "text/csv"}).text
    assert table.splitlines() == [
        "theta_deg,psi_deg,jx_ma,jy_ma,duration_s,rate_hz",
        "0,90,0.004536,-0.002117,60,200",
        "90,0,0.1,0.2,,",
    ]


def test_a_record_as_csv(
    service: Service, stand: httpx.Client, session_id: int, record_csv: bytes, currents: dict[str, Any]
) -> None:
    made = stand.put(place(session_id, "currents"), content=record_csv, headers=CSV)
    assert made.status_code == 201, made.text
    shown = made.json()
    # The mean of 12,000 float64 numbers: summation in another order differs by some 1e-16 relative.
    assert shown["jx_ma"] == pytest.approx(np.mean(currents["jx_ma"]), rel=1e-13)
    assert shown["jy_ma"] == pytest.approx(np.mean(currents["jy_ma"]), rel=1e-13)
    assert (shown["rate_hz"], shown["warnings"]) == (pytest.approx(200, rel=1e-9), [])
    # White noise: u is near s/√n; between half and twice for any sensible estimate of the correlation.
    assert 0.5e-6 / 12_000**0.5 < shown["u_jx_ma"] < 2e-6 / 12_000**0.5
    stored = io.BytesIO(service.lab.files.read(shown["record_sha256"], "parquet"))
    assert pq.read_table(stored)["jx_ma"].to_numpy().tobytes() == currents["jx_ma"].tobytes()
    assert service.lab.files.read(hashlib.sha256(record_csv).hexdigest(), "csv") == record_csv
    assert list(service.lab.settings.uploads.iterdir()) == []


def test_the_same_record_in_every_format(
    stand: httpx.Client, session_id: int, record_csv: bytes, record_parquet: bytes, currents: dict[str, Any]
) -> None:
    packed = io.BytesIO()
    np.savez_compressed(packed, **currents)
    bodies = [record_csv, record_parquet, packed.getvalue(), gzip.compress(record_csv, mtime=0)]
    answers = [stand.put(place(session_id, "currents"), content=body).json() for body in bodies]
    assert len({(item["jx_ma"], item["jy_ma"], item["u_jx_ma"]) for item in answers}) == 1
    assert len({item["record_sha256"] for item in answers}) == 1


def test_the_same_bytes_again(stand: httpx.Client, session_id: int, record_parquet: bytes) -> None:
    path = place(session_id, "currents")
    first = stand.put(path, content=record_parquet, headers=PARQUET)
    again = stand.put(path, content=record_parquet, headers=PARQUET)
    assert (first.status_code, again.status_code) == (201, 200)
    assert again.json()["id"] == first.json()["id"]


def test_a_fault_in_a_record_is_named(stand: httpx.Client, session_id: int) -> None:
    text = b"t_s,jx_ma,jy_ma\n0,0.1,0.1\n0.005,nan,0.1\n0.01,0.1,0.1\n"
    refused = stand.put(place(session_id, "currents"), content=text, params={"filename": "run7.csv"})
    assert refused.status_code == 422
    error = refused.json()["errors"][0]
    assert (error["file"], error["row"], error["column"]) == ("run7.csv", 3, "jx_ma")
    assert stand.get(f"/sessions/{session_id}").json()["positions_measured"] == 0


def test_a_record_of_another_position(stand: httpx.Client, session_id: int, record_csv: bytes) -> None:
    refused = stand.put(place(session_id, "currents", "45", "0"), content=record_csv, headers=CSV)
    assert (refused.status_code, refused.json()["code"]) == (422, "position-not-certified")


def test_a_record_longer_than_the_limit(service: Service, session_id: int) -> None:
    def pieces() -> Any:
        for _ in range(service.lab.settings.upload_limit_bytes // 2**20 + 1):
            yield b"0" * 2**20

    refused = service.client().put(place(session_id, "currents"), content=pieces(), headers=CSV)
    assert refused.status_code == 413
    assert refused.json()["code"] == "too-big"
    assert list(service.lab.settings.uploads.iterdir()) == []


def test_a_client_that_goes_away_leaves_nothing(service: Service, session_id: int) -> None:
    address, path = service.url.removeprefix("http://").split(":"), place(session_id, "currents")
    with (
        structlog.testing.capture_logs() as lines,
        socket.create_connection((address[0], int(address[1])), timeout=10) as connection,
    ):
        head = (
            f"PUT /api/v1{path} HTTP/1.1\r\nhost: lab\r\nauthorization: Bearer {service.tokens['both']}\r\n"
        )
        connection.sendall(f"{head}content-length: 1000\r\n\r\nt_s,jx_ma,jy_ma\n".encode())
        wait_until(lambda: list(service.lab.settings.uploads.iterdir()))
        connection.close()
        wait_until(lambda: [line for line in lines if line["event"] == "request"])
    assert list(service.lab.settings.uploads.iterdir()) == []
    assert [line for line in lines if line["log_level"] == "error"] == []


def test_the_noise_of_a_record(
    stand: httpx.Client, session_id: int, record_parquet: bytes, currents: dict[str, Any]
) -> None:
    made = stand.put(place(session_id, "currents"), content=record_parquet, headers=PARQUET).json()
    answer = stand.get(place(session_id, "noise"))
    assert answer.status_code == 200, answer.text
    noise = answer.json()
    assert (noise["measurement"], noise["session"], noise["repeat"]) == (made["id"], session_id, 0)
    assert (noise["jx"]["mean_ma"], noise["jx"]["samples"]) == (
        pytest.approx(made["jx_ma"], rel=1e-12),
        12_000,
    )
    # The stored u, computed in A instead of mA.
    assert noise["jx"]["u_ma"] == pytest.approx(made["u_jx_ma"], rel=1e-6)
    # σ at one sample is the scatter itself, known to 1/√(2·8000) = 0.8 %; four of those.
    assert noise["jx"]["allan"][0] == pytest.approx(
        noise["jx"]["allan"][0] | {"tau_s": 0.005, "deviation_ma": 1e-6, "exponent": 0}, rel=0.032
    )
    walk = noise["jx"]["coefficients"]["angle_random_walk_ma_sqrt_s"]
    # 1e-6 mA·√(5 ms), within four of its own uncertainty.
    assert walk["value"] == pytest.approx(1e-6 * 0.005**0.5, abs=4 * walk["u"])
    assert noise["jx"]["coefficients"]["angle_random_walk_deg_per_sqrt_h"] is None
    assert noise["scales_from_calibration"] is None
    assert [item["code"] for item in noise["jx"]["findings"]] == ["steady"]


def test_no_noise_without_a_record(stand: httpx.Client, session_id: int) -> None:
    missing = stand.get(place(session_id, "noise"))
    assert (missing.status_code, missing.json()["errors"][0]["code"]) == (404, "not-measured")
    stand.put(place(session_id, "means"), json=MEANS)
    typed = stand.get(place(session_id, "noise"))
    assert (typed.status_code, typed.json()["errors"][0]["code"]) == (404, "no-record")
    assert stand.get(place(999_999, "noise")).status_code == 404


def test_a_records_note_stands_with_its_measurement(
    stand: httpx.Client, session_id: int, record_parquet: bytes
) -> None:
    path, said = place(session_id, "currents"), {"note": "suspicious: Jx scatters."}
    first = stand.put(path, params=said, content=record_parquet, headers=PARQUET)
    assert (first.status_code, first.json()["note"]) == (201, said["note"])
    assert stand.put(path, params=said, content=record_parquet, headers=PARQUET).status_code == 200
