import io
import json
import zipfile
from typing import Any

import httpx
import pytest
from serving import GRID, Service

from app.services import uploads

HEADER = "theta_deg,psi_deg,jx_ma,jy_ma"


def means_csv(means: list[dict[str, float]]) -> str:
    return "\n".join([HEADER, *(",".join(str(value) for value in row.values()) for row in means)]) + "\n"


def packed(files: dict[str, str | bytes]) -> bytes:
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in files.items():
            archive.writestr(zipfile.ZipInfo(name, (2026, 1, 1, 0, 0, 0)), content)
    return stream.getvalue()


def described(**said: Any) -> str:
    return json.dumps(
        {"gyro": "0417", "stand": "S1", "started_at": "2026-03-01T09:30:00Z", "positions": []} | said
    )


ZIP = {"content-type": "application/zip"}


def test_a_zip_of_records(stand: httpx.Client, record_csv: bytes, noted: Any) -> None:
    files = {f"theta{theta:03}_psi{psi:03}.csv": record_csv for theta, psi in GRID[:4]}
    made = stand.post(
        "/sessions/upload", params={"gyro": "0417", "stand": "S1"}, content=packed(files), headers=ZIP
    )
    assert made.status_code == 201, made.text
    shown = made.json()
    assert made.headers["location"] == f"/api/v1/sessions/{shown['session']['id']}"
    assert [(item["theta_deg"], item["psi_deg"]) for item in shown["measured"]] == GRID[:4]
    assert all(item["record_sha256"] and item["origin"] == "upload" for item in shown["measured"])
    assert shown["session"]["positions_measured"] == 4
    assert (shown["job"], noted.queued) == (None, [])


def test_what_the_session_says_of_itself(stand: httpx.Client, means: Any) -> None:
    files: dict[str, str | bytes] = {
        "means.csv": means_csv(means),
        "session.json": described(temperature_c=21.5),
    }
    made = stand.post("/sessions/upload", params={"method": "both"}, content=packed(files), headers=ZIP)
    assert made.status_code == 201, made.text
    session, job = made.json()["session"], made.json()["job"]
    assert (session["gyro"], session["stand"], session["temperature_c"]) == ("0417", "S1", 21.5)
    assert session["started_at"] == "2026-03-01T09:30:00Z"
    assert (job["kind"], job["state"]) == ("calibrate", "queued")


def test_a_form_of_files(stand: httpx.Client, means: Any) -> None:
    files = [("files", ("means.csv", means_csv(means[:8]))), ("files", ("session.json", described()))]
    made = stand.post("/sessions/upload", files=files, data={"gyro": "0417", "method": "least-squares"})
    assert made.status_code == 201, made.text
    assert len(made.json()["measured"]) == 8
    assert made.json()["job"]["kind"] == "calibrate"


def test_a_form_of_one_file(stand: httpx.Client, means: Any) -> None:
    for name, content in (
        ("day.zip", packed({"means.csv": means_csv(means)})),
        ("day.csv", means_csv(means)),
    ):
        data = {"gyro": "0417", "stand": "S1"}
        made = stand.post("/sessions/upload", files={"file": (name, content)}, data=data)
        assert made.status_code == 201, made.text
        assert len(made.json()["measured"]) == 16


def test_differences_are_told(client: httpx.Client, stand: httpx.Client, means: Any) -> None:
    client.post("/gyros", json={"serial": "0418", "type": "GVK-6"})
    files: dict[str, str | bytes] = {
        "means.csv": means_csv(means),
        "session.json": described(latitude_deg=59.9, certificate="certificate.csv"),
        "certificate.csv": "theta_deg,psi_deg,alpha_arcsec,beta_arcsec,gamma_arcsec\n0,0,1,2,3\n",
    }
    made = stand.post("/sessions/upload", params={"gyro": "0418"}, content=packed(files), headers=ZIP).json()
    assert made["session"]["gyro"] == "0418"
    codes = {item["code"] for item in made["warnings"]}
    assert {"differs", "latitude-differs", "certificate-differs"} <= codes


def test_gyro_and_stand_have_to_be_said(stand: httpx.Client, means: Any) -> None:
    refused = stand.post("/sessions/upload", content=packed({"means.csv": means_csv(means)}), headers=ZIP)
    assert refused.status_code == 422
    assert [error["parameter"] for error in refused.json()["errors"]] == ["gyro", "stand"]


@pytest.mark.parametrize(
    ("field", "value", "code"),
    [
        ("gyros", "0417", "unknown-field"),
        ("method", "best", "unknown-choice"),
        ("started_at", "noon", "bad-time"),
    ],
)
def test_fields_that_cannot_be(stand: httpx.Client, means: Any, field: str, value: str, code: str) -> None:
    file = {"files": ("means.csv", means_csv(means))}
    refused = stand.post("/sessions/upload", files=file, data={field: value})
    assert refused.status_code == 422
    assert [(error["pointer"], error["code"]) for error in refused.json()["errors"]] == [(f"#/{field}", code)]


def test_a_fault_leaves_nothing_behind(service: Service, stand: httpx.Client, means: Any) -> None:
    wrong = means_csv(means).replace("0.0022", "much", 1)
    params = {"gyro": "0417", "stand": "S1"}
    refused = stand.post("/sessions/upload", params=params, content=packed({"means.csv": wrong}), headers=ZIP)
    assert refused.status_code == 422
    error = refused.json()["errors"][0]
    assert (error["file"], error["row"], error["column"]) == ("means.csv", 3, "jx_ma")
    uncertified = f"{HEADER}\n45,0,0.1,0.1\n"
    body = packed({"means.csv": uncertified})
    refused = stand.post("/sessions/upload", params=params, content=body, headers=ZIP)
    assert refused.json()["code"] == "position-not-certified"
    assert stand.get("/sessions").json()["items"] == []
    assert list(service.lab.settings.uploads.iterdir()) == []


@pytest.mark.parametrize("body", [b"", b"PK\x03\x04 cut short", b"\x1f\x8bnot gzip", b"hello"])
def test_what_is_no_session(stand: httpx.Client, body: bytes) -> None:
    refused = stand.post(
        "/sessions/upload", params={"gyro": "0417", "stand": "S1"}, content=body, headers=ZIP
    )
    assert refused.status_code == 422, refused.text
    assert refused.json()["errors"][0]["file"] == "session.zip"


def test_a_form_without_a_file(stand: httpx.Client) -> None:
    refused = stand.post("/sessions/upload", files={"gyro": (None, "0417"), "stand": (None, "S1")})
    assert (refused.status_code, refused.json()["code"]) == (422, "no-measurement")


def test_a_form_cut_short(stand: httpx.Client) -> None:
    refused = stand.post(
        "/sessions/upload",
        content=b"--x\r\nnothing",
        headers={"content-type": "multipart/form-data; boundary=x"},
    )
    assert refused.status_code in (400, 422), refused.text
    assert refused.headers["content-type"] == "application/problem+json"


def test_a_repeat_with_the_same_key(stand: httpx.Client, means: Any) -> None:
    params, key = {"gyro": "0417", "stand": "S1"}, {"idempotency-key": "day-7"}
    bodies = [packed({"means.csv": means_csv(means)}), packed({"means.csv": means_csv(means[:9])})]
    first, again, other = (
        stand.post("/sessions/upload", params=params, content=body, headers=ZIP | key)
        for body in (bodies[0], bodies[0], bodies[1])
    )
    assert [answer.status_code for answer in (first, again, other)] == [201, 200, 409]
    assert again.json()["session"]["id"] == first.json()["session"]["id"]
    assert again.json()["measured"] == first.json()["measured"]


def test_a_long_one_is_read_in_the_background(
    stand: httpx.Client, noted: Any, record_csv: bytes, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(uploads, "LARGEST_AT_ONCE", 100_000)
    files: dict[str, str | bytes] = {"theta000_psi000.csv": record_csv, "session.json": described()}
    del files["session.json"]
    params = {"gyro": "0417", "stand": "S1"}
    made = stand.post("/sessions/upload", params=params, content=packed(files), headers=ZIP)
    assert made.status_code == 202, made.text
    job = made.json()["job"]
    assert made.headers["location"] == f"/api/v1/jobs/{job['id']}"
    assert (job["kind"], job["state"], noted.queued) == ("import", "queued", [job["id"]])
    assert made.json()["session"]["state"] == "solving"
