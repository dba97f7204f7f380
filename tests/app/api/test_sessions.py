import csv
import io
from datetime import UTC, datetime, timedelta

import httpx
import pytest
from serving import Service, opened

from app.services import gyros
from app.services.access import SYSTEM
from app.services.lookup import find_gyro


def test_a_session_takes_the_valid_certificate(stand: httpx.Client) -> None:
    made = stand.post("/sessions", json={"gyro": "0417", "stand": "S1"})
    assert made.status_code == 201
    session = made.json()
    assert made.headers["location"] == f"/api/v1/sessions/{session['id']}"
    assert (session["certificate"], session["latitude_deg"], session["start"]) == ("C-17", 55.7558, 1)
    assert session["origin"] == "api"
    assert (session["state"], session["positions_measured"], session["positions_total"]) == (
        "measuring",
        0,
        16,
    )
    detail = stand.get(f"/sessions/{session['id']}").json()
    assert {name: detail[name] for name in session} == session
    assert [(item["theta_deg"], item["psi_deg"]) for item in detail["positions"][:3]] == [
        (0, 0),
        (0, 90),
        (0, 180),
    ]


def test_without_a_valid_certificate(client: httpx.Client) -> None:
    client.post("/gyros", json={"serial": "0417", "type": "GVK-6"})
    client.post("/stands", json={"name": "S1", "latitude_deg": 55.7558})
    refused = client.post("/sessions", json={"gyro": "0417", "stand": "S1"})
    assert (refused.status_code, refused.json()["code"]) == (422, "no-valid-certificate")
    assert refused.json()["errors"][0]["pointer"] == "#/certificate"


def test_a_time_with_and_without_its_offset(stand: httpx.Client) -> None:
    for said in ("2026-03-01T12:30:00+03:00", "2026-03-01T09:30:00"):
        made = stand.post("/sessions", json={"gyro": "0417", "stand": "S1", "started_at": said})
        assert made.json()["started_at"] == "2026-03-01T09:30:00Z"


def test_a_repeat_with_the_same_key(stand: httpx.Client) -> None:
    body, key = {"gyro": "0417", "stand": "S1"}, {"idempotency-key": "morning-1"}
    made = stand.post("/sessions", json=body, headers=key)
    again = stand.post("/sessions", json=dict(reversed(body.items())), headers=key)
    assert (made.status_code, again.status_code) == (201, 200)
    assert again.json()["id"] == made.json()["id"]
    assert again.headers["location"] == made.headers["location"]
    assert len(stand.get("/sessions").json()["items"]) == 1


def test_the_same_key_with_other_content(stand: httpx.Client) -> None:
    key = {"idempotency-key": "morning-1"}
    stand.post("/sessions", json={"gyro": "0417", "stand": "S1"}, headers=key)
    other = stand.post("/sessions", json={"gyro": "0417", "stand": "S1", "note": "x"}, headers=key)
    assert (other.status_code, other.json()["code"]) == (409, "key-reused")


def test_a_key_belongs_to_its_account(service: Service, stand: httpx.Client) -> None:
    body, key = {"gyro": "0417", "stand": "S1"}, {"idempotency-key": "morning-1"}
    mine = stand.post("/sessions", json=body, headers=key)
    theirs = service.client("upload").post("/sessions", json=body, headers=key)
    assert (mine.status_code, theirs.status_code) == (201, 201)
    assert mine.json()["id"] != theirs.json()["id"]


def test_a_refused_request_leaves_its_key_free(stand: httpx.Client) -> None:
    key = {"idempotency-key": "morning-1"}
    assert stand.post("/sessions", json={"gyro": "0999", "stand": "S1"}, headers=key).status_code == 404
    assert stand.post("/sessions", json={"gyro": "0417", "stand": "S1"}, headers=key).status_code == 201


def test_starts_are_counted(stand: httpx.Client) -> None:
    numbers = [
        stand.post("/sessions", json={"gyro": "0417", "stand": "S1"} | said).json()["start"]
        for said in ({}, {}, {"new_start": True}, {"start": 1})
    ]
    assert numbers == [1, 1, 2, 1]
    assert stand.post("/sessions", json={"gyro": "0417", "stand": "S1", "start": 9}).status_code == 404


@pytest.mark.parametrize(
    ("moments", "starts"),
    [
        (["2026-03-02T09:00Z", "2026-03-02T14:00Z", "2026-03-02T20:00Z"], [1, 1, 1]),  # a working day
        (
            ["2026-03-02T09:00Z", "2026-04-02T09:00Z", "2026-05-02T09:00Z"],
            [1, 2, 3],
        ),  # months later it was off
        (["2026-05-02T09:00Z", "2026-03-02T09:00Z", "2026-05-02T07:30Z"], [1, 2, 1]),  # in any order
        (["2026-03-02T09:00Z", "2026-03-02T21:00:01Z"], [1, 2]),
    ],
)
def test_a_session_that_names_no_start_has_the_one_of_its_day(stand: httpx.Client, moments, starts) -> None:
    body = {"gyro": "0417", "stand": "S1"}
    found = [stand.post("/sessions", json=body | {"started_at": at}).json()["start"] for at in moments]
    assert found == starts
    later = body | {
        "started_at": "2026-09-02T09:00Z",
        "new_start": False,
    }  # somebody says that it was left on
    assert stand.post("/sessions", json=later).json()["start"] == max(starts)


def test_a_power_up_that_was_counted_is_the_start_of_what_follows(
    service: Service, stand: httpx.Client
) -> None:
    at = datetime(2026, 3, 2, 9, tzinfo=UTC)
    with service.lab.write(SYSTEM) as work:
        gyros.add_start(work, find_gyro(work, "0417"), at)
        gyros.add_start(work, find_gyro(work, "0417"), at + timedelta(hours=3))
    body = {"gyro": "0417", "stand": "S1", "started_at": "2026-03-02T13:00Z"}
    assert stand.post("/sessions", json=body).json()["start"] == 2


def test_newest_first_in_parts(stand: httpx.Client) -> None:
    numbers = [opened(stand) for _ in range(5)]
    path, found = "/sessions?limit=2&gyro=0417", []
    while path:
        part = stand.get(path.removeprefix("/api/v1")).json()
        found += [item["id"] for item in part["items"]]
        path = part["next"]
    assert found == numbers[::-1]


def test_the_last_one_measured_comes_first_whenever_it_was_entered(stand: httpx.Client) -> None:
    days = [3, 9, 1, 9, 5]
    for day in days:
        opened(stand, started_at=f"2026-03-0{day}T12:00:00Z")
    path, found = "/sessions?limit=2", []
    while path:
        part = stand.get(path.removeprefix("/api/v1")).json()
        found += [(int(item["started_at"][8:10]), item["id"]) for item in part["items"]]
        path = part["next"]
    assert found == sorted(zip(days, range(1, 6), strict=True), reverse=True)


@pytest.mark.parametrize(
    ("query", "days"),
    [
        ({}, [3, 2, 1]),
        ({"from": "2026-03-02"}, [3, 2]),
        ({"to": "2026-03-02"}, [2, 1]),
        ({"from": "2026-03-02", "to": "2026-03-02"}, [2]),
        ({"from": "2026-03-02T12:00:01Z", "to": ""}, [3]),
        ({"gyro": "0418"}, []),
        ({"stand": "S1"}, [3, 2, 1]),
    ],
)
def test_filters(stand: httpx.Client, query: dict[str, str], days: list[int]) -> None:
    for day in (1, 2, 3):
        opened(stand, started_at=f"2026-03-0{day}T12:00:00Z")
    found = stand.get("/sessions", params=query).json()["items"]
    assert [int(item["started_at"][8:10]) for item in found] == days


def test_sessions_as_csv(stand: httpx.Client) -> None:
    number = opened(stand)
    table = stand.get("/sessions", headers={"accept": "text/csv"}).text
    row = next(csv.DictReader(io.StringIO(table)))
    assert (row["id"], row["gyro"], row["state"], row["verdict"]) == (str(number), "0417", "measuring", "")
