import csv
import io
from typing import Any

import httpx
import pytest
from serving import Service

DATES = {"number": "C-18", "valid_from": "2026-01-01", "valid_until": "2027-01-01"}
POSITION = {"theta_deg": 0, "psi_deg": 90, "alpha_arcsec": 6.9, "beta_arcsec": 16.4, "gamma_arcsec": -6.6}
CSV = b"theta_deg,psi_deg,alpha_arcsec,beta_arcsec,gamma_arcsec\n0,90,6.9,16.4,-6.6\n"
AS_CSV = {"content-type": "text/csv"}


def test_a_stand_is_registered(client: httpx.Client) -> None:
    made = client.post("/stands", json={"name": "S1", "latitude_deg": -33.5})
    assert made.status_code == 201
    assert made.headers["location"] == "/api/v1/stands/S1"
    assert client.get("/stands/S1").json() == made.json()
    assert made.json()["certificate"] is None
    assert client.post("/stands", json={"name": "S1", "latitude_deg": 0}).status_code == 409
    beyond = client.post("/stands", json={"name": "S2", "latitude_deg": 90.001})
    assert beyond.json()["errors"][0]["pointer"] == "#/latitude_deg"


def test_stands_come_in_parts(client: httpx.Client) -> None:
    for name in ("b", "a", "c"):
        client.post("/stands", json={"name": name, "latitude_deg": 0})
    first = client.get("/stands?limit=2").json()
    second = client.get(first["next"].removeprefix("/api/v1")).json()
    assert [item["name"] for item in first["items"] + second["items"]] == ["a", "b", "c"]
    assert second["next"] is None


def test_a_certificate_as_json(stand: httpx.Client) -> None:
    made = stand.post("/stands/S1/certificates", json=DATES | {"positions": [POSITION]})
    assert made.status_code == 201, made.text
    assert made.headers["location"] == "/api/v1/stands/S1/certificates/C-18"
    shown = stand.get("/stands/S1/certificates/C-18").json()
    assert (shown["version"], shown["valid_from"], shown["valid_until"]) == (2, "2026-01-01", "2027-01-01")
    uncertainties = dict.fromkeys(("u_alpha_arcsec", "u_beta_arcsec", "u_gamma_arcsec"))
    assert shown["positions"] == [POSITION | uncertainties]
    assert stand.get("/stands/S1").json()["certificate"]["number"] == "C-18"


def test_the_same_certificate_as_json_and_as_csv(stand: httpx.Client) -> None:
    one = stand.post("/stands/S1/certificates", json=DATES | {"positions": [POSITION]}).json()
    answer = stand.post(
        "/stands/S1/certificates", params=DATES | {"number": "C-19"}, content=CSV, headers=AS_CSV
    )
    assert answer.status_code == 201, answer.text
    other = answer.json()
    assert other["positions"] == one["positions"]
    assert other["digest"] == one["digest"]
    given = stand.get("/stands/S1/certificates/C-19", headers={"accept": "text/csv"})
    assert given.content == CSV


def test_a_file_without_its_number(stand: httpx.Client) -> None:
    refused = stand.post("/stands/S1/certificates", content=CSV, headers=AS_CSV)
    assert refused.status_code == 422
    assert {error["parameter"] for error in refused.json()["errors"]} == set(DATES)


def test_a_file_with_a_fault_is_named_by_row_and_column(stand: httpx.Client) -> None:
    text = CSV + b"0,180,six,16.4,6.6\n"
    params = DATES | {"filename": "S1 2026.csv"}
    refused = stand.post("/stands/S1/certificates", params=params, content=text, headers=AS_CSV)
    assert refused.status_code == 422
    error = refused.json()["errors"][0]
    assert (error["file"], error["row"], error["column"]) == ("S1 2026.csv", 3, "alpha_arcsec")


def test_warnings_of_a_file_come_back(stand: httpx.Client) -> None:
    text = b"theta_deg,psi_deg,alpha_arcsec,beta_arcsec,gamma_arcsec,operator\n0,90,6.9,16.4,-6.6,me\n"
    made = stand.post("/stands/S1/certificates", params=DATES, content=text, headers=AS_CSV).json()
    assert ["operator" in item["message"] for item in made["warnings"]] == [True]


@pytest.mark.parametrize(
    ("change", "pointer", "code"),
    [
        ({"valid_until": "2025-12-31"}, "#/valid_until", "bad-validity"),
        ({"valid_from": "01.01.2026"}, "#/valid_from", "bad-day"),
        ({"positions": []}, "#/positions", "too-few"),
        (
            {"positions": [POSITION, POSITION | {"alpha_arcsec": None}]},
            "#/positions/1/alpha_arcsec",
            "not-a-number",
        ),
        ({"positions": [POSITION, POSITION]}, "#/positions/1/theta_deg", "duplicate-position"),
        (
            {"positions": [POSITION, POSITION | {"psi_deg": -270}]},
            "#/positions/1/theta_deg",
            "duplicate-position",
        ),
        ({"positions": [POSITION | {"u_beta_arcsec": -1}]}, "#/positions/0/u_beta_arcsec", "too-small"),
    ],
)
def test_a_certificate_that_cannot_be(
    stand: httpx.Client, change: dict[str, Any], pointer: str, code: str
) -> None:
    refused = stand.post("/stands/S1/certificates", json=DATES | {"positions": [POSITION]} | change)
    assert refused.status_code == 422, refused.text
    assert [(error["pointer"], error["code"]) for error in refused.json()["errors"]] == [(pointer, code)]


def test_a_certificate_never_changes(stand: httpx.Client) -> None:
    again = stand.post("/stands/S1/certificates", json=DATES | {"number": "C-17", "positions": [POSITION]})
    assert (again.status_code, again.json()["code"]) == (409, "certificate-exists")


def test_angles_are_brought_into_one_turn(stand: httpx.Client) -> None:
    turned = POSITION | {"theta_deg": 360, "psi_deg": -90}
    made = stand.post("/stands/S1/certificates", json=DATES | {"positions": [turned]}).json()
    assert (made["positions"][0]["theta_deg"], made["positions"][0]["psi_deg"]) == (0.0, 270.0)


COMMON = {"u_alpha_common_arcsec": 0.3, "u_beta_common_arcsec": 0.0, "u_gamma_common_arcsec": None}


def test_what_the_angles_share_comes_as_json_or_beside_a_file(stand: httpx.Client) -> None:
    body = DATES | {"positions": [POSITION], "u_alpha_common_arcsec": 0.3, "u_beta_common_arcsec": 0}
    one = stand.post("/stands/S1/certificates", json=body)
    beside = DATES | {"number": "C-19", "u_alpha_common_arcsec": "0.3", "u_beta_common_arcsec": "0"}
    other = stand.post("/stands/S1/certificates", params=beside, content=CSV, headers=AS_CSV)
    for answer in (one, other):
        assert answer.status_code == 201, answer.text
        shown = stand.get(answer.headers["location"].removeprefix("/api/v1")).json()
        for place in (answer.json(), shown):
            assert {key: place[key] for key in COMMON} == COMMON
    heads = stand.get("/stands/S1/certificates").json()["items"]
    assert [head["u_alpha_common_arcsec"] for head in heads] == [0.3, 0.3, None]
    table = stand.get("/stands/S1/certificates", headers={"accept": "text/csv"}).text
    assert [row["u_alpha_common_arcsec"] for row in csv.DictReader(io.StringIO(table))] == ["0.3", "0.3", ""]


@pytest.mark.parametrize("value", [-0.1, "0.3", 1e10])
def test_what_the_angles_cannot_share(stand: httpx.Client, value: Any) -> None:
    body = DATES | {"positions": [POSITION], "u_beta_common_arcsec": value}
    refused = stand.post("/stands/S1/certificates", json=body)
    assert refused.status_code == 422
    assert [item["pointer"] for item in refused.json()["errors"]] == ["#/u_beta_common_arcsec"]


@pytest.mark.parametrize("value", ["-0.1", "nan", "inf", "some", "1e10"])
def test_what_the_angles_of_a_file_cannot_share(stand: httpx.Client, value: str) -> None:
    params = DATES | {"u_beta_common_arcsec": value}
    refused = stand.post("/stands/S1/certificates", params=params, content=CSV, headers=AS_CSV)
    assert refused.status_code == 422, refused.text
    assert [item["parameter"] for item in refused.json()["errors"]] == ["u_beta_common_arcsec"]


STATEMENT = {
    "u_gain_x_ppm": 50,
    "u_gain_y_ppm": 50.5,
    "u_azimuth_arcsec": 10,
    "correlations": [{"between": ["gain_x", "gain_y"], "coefficient": 0.9}],
    "dof": {"azimuth": 8},
}


def test_the_uncertainty_of_a_stand_is_stated_shown_and_cleared(stand: httpx.Client) -> None:
    assert stand.get("/stands/S1").json()["uncertainty"] == {}
    stated = stand.put("/stands/S1/uncertainty", json=STATEMENT)
    assert stated.status_code == 200, stated.text
    assert stated.json()["uncertainty"] == STATEMENT
    assert stand.get("/stands/S1").json() == stated.json()
    assert stand.get("/stands").json()["items"] == [stated.json()]
    replaced = stand.put("/stands/S1/uncertainty", json={"u_gravity_ppm": 5, "u_gain_x_ppm": None})
    assert replaced.json()["uncertainty"] == {"u_gravity_ppm": 5}
    assert stand.put("/stands/S1/uncertainty", json={}).json()["uncertainty"] == {}
    assert stand.get("/stands/S1").json()["uncertainty"] == {}


@pytest.mark.parametrize(
    ("change", "pointer", "code"),
    [
        ({"u_gain_ppm": 1}, "#/u_gain_ppm", "unknown-key"),
        ({"a/b": 1}, "#/a~1b", "unknown-key"),
        ({"u_gain_x_ppm": -1}, "#/u_gain_x_ppm", "not-a-number"),
        ({"u_gain_x_ppm": "50"}, "#/u_gain_x_ppm", "not-a-number"),
        ({"dof": {"azimuth": 0}}, "#/dof/azimuth", "not-a-number"),
        ({"correlations": [{"between": [[], "gain_y"]}]}, "#/correlations/0", "bad-correlation"),
    ],
)
def test_an_uncertainty_that_cannot_be(
    stand: httpx.Client, change: dict[str, Any], pointer: str, code: str
) -> None:
    stand.put("/stands/S1/uncertainty", json=STATEMENT)
    refused = stand.put("/stands/S1/uncertainty", json=STATEMENT | change)
    assert refused.status_code == 422, refused.text
    assert [(item["pointer"], item["code"]) for item in refused.json()["errors"]] == [(pointer, code)]
    assert stand.get("/stands/S1").json()["uncertainty"] == STATEMENT


@pytest.mark.parametrize("body", [b"[]", b"1", b'"text"'])
def test_an_uncertainty_is_an_object(stand: httpx.Client, body: bytes) -> None:
    headers = {"content-type": "application/json"}
    refused = stand.put("/stands/S1/uncertainty", content=body, headers=headers)
    assert (refused.status_code, refused.json()["code"]) == (422, "not-an-object")


def test_an_uncertainty_needs_its_stand_and_a_token_that_reaches(
    stand: httpx.Client, service: Service
) -> None:
    assert stand.put("/stands/S9/uncertainty", json=STATEMENT).status_code == 404
    reading = service.client("read")
    assert reading.put("/stands/S1/uncertainty", json=STATEMENT).status_code == 403
    assert reading.put("/types/GVK-6/nominals", json={"nominals": {}}).status_code == 403
    assert service.client(None).put("/stands/S1/uncertainty", json=STATEMENT).status_code == 401
    assert reading.get("/stands/S1").json()["uncertainty"] == {}


def test_certificates_newest_first(stand: httpx.Client) -> None:
    stand.post("/stands/S1/certificates", json=DATES | {"positions": [POSITION]})
    first = stand.get("/stands/S1/certificates?limit=1").json()
    second = stand.get(first["next"].removeprefix("/api/v1")).json()
    assert [item["number"] for item in first["items"] + second["items"]] == ["C-18", "C-17"]
    assert "positions" not in first["items"][0]
    table = stand.get("/stands/S1/certificates", headers={"accept": "text/csv"}).text
    assert [row["number"] for row in csv.DictReader(io.StringIO(table))] == ["C-18", "C-17"]
