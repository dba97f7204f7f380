"""Drift, events, baselines and alarms over HTTP, as programs use them."""

import io
from datetime import UTC, datetime, timedelta

import drift_laboratory
import pyarrow.parquet as pq
import pytest
from serving import Service, ready

from app.services import access, gyros
from app.services.drift import studying
from app.services.sessions import NewSession, open_session
from app.store.tables import Calibration, CalibrationParameter
from solver.records import PARAMETERS

BEGIN = datetime(2024, 1, 1, 8, 0, tzinfo=UTC)
PARQUET = "application/vnd.apache.parquet"


@pytest.fixture
def judge(service: Service):
    """The client of a metrologist; twelve sessions of 0417 were studied, the last of which lies far off in w0x."""
    ready(service.client())
    with service.lab.write(access.SYSTEM) as work:
        access.add_account(work, "sokolov", "metrologist")
        service.tokens["judge"] = access.create_token(work, "sokolov", ("read", "upload"))
        for number in range(12):
            _session(work, number)
    _study(service)
    return service.client("judge")


def _session(work, number, lacking=""):
    at = BEGIN + number * timedelta(days=30)
    session = open_session(work, NewSession("0417", "S1", new_start=True, started_at=at))
    row = Calibration(
        session_id=session.id, revision=1, method="least-squares", solver_version="2.0.0", input_hash=str(number),
        certificate_id=1, inputs=[], result="{}", result_digest="", created_at=at, created_by="p",
        parameters=[
            CalibrationParameter(
                method="least-squares", parameter=name, standard_uncertainty=0.004, coverage_factor=2.0,
                value=None if name == lacking else _value(name, number), u_noise=0.003,
            )
            for name in PARAMETERS
        ],
    )  # fmt: skip
    work.db.add(row)
    work.db.flush()
    studying.following.changed(work, 1, methods=["least-squares"])


def _value(name, number):
    return 0.01 * (number % 3) + (5.0 if number == 11 and name == "w0x" else 0.0)


def _study(service):
    with service.lab.write(access.SYSTEM) as work:
        studying.follow_all_now(work)


def _freeze(judge, **how):
    body = {"parameters": ["w0x"], "calibrations": list(range(1, 11))} | how
    return judge.post("/gyros/0417/baselines", json=body)


def test_a_drift_has_points_with_charts_and_what_was_found(judge, service):
    assert _freeze(judge).status_code == 201
    assert judge.get("/gyros/0417/drift").json()["up_to_date"] is False
    _study(service)
    found = judge.get("/gyros/0417/drift", params={"parameter": "w0x"}).json()
    assert found["up_to_date"]
    assert found["sessions"] == 12
    (drift,) = found["parameters"]
    assert [point["session"] for point in drift["points"]] == list(range(1, 13))
    assert drift["points"][-1]["signals"][0] == "nelson-1"
    assert drift["points"][-1]["value"] > drift["points"][-1]["charts"]["individuals_high"]
    assert drift["study"]["status"] == "beyond-control"
    assert found["baselines"][0]["frozen_by"] == "sokolov"
    assert {alarm["kind"] for alarm in found["alarms"]} >= {"beyond-limits"}


def test_a_gyro_is_due_once(judge, service):
    """Session 12, of 26 November 2024, is sound; the one after it does not determine all."""
    with service.lab.write(access.SYSTEM) as work:
        gyros.set_interval(work, "GVK-6", 90)
        _session(work, 12, lacking="w0y")
    _study(service)
    (item,) = (item for item in judge.get("/due").json()["items"] if item["gyro"] == "0417")
    assert judge.get("/gyros/0417/drift").json()["due"] == item["due"] == "2025-02-24"


def test_a_period_a_grouping_and_fewer_points(judge):
    def points(**wanted):
        return judge.get("/gyros/0417/drift", params={"parameter": "w0y"} | wanted).json()["parameters"][0]

    assert len(points(**{"from": "2024-02-01", "to": "2024-03-31"})["points"]) == 2
    yearly = points(by="year")["points"]
    assert [point["sessions"] for point in yearly] == [12]
    fewer = points(points=4)
    assert 1 < len(fewer["points"]) <= 4
    assert (fewer["sessions"], fewer["reduced"]) == (12, True)


def test_files_hold_every_session(judge, service):
    """JSON gives so many as a chart shows, and says so."""
    with service.lab.write(access.SYSTEM) as work:
        drift_laboratory.lengthen(work, 150)
    (drift,) = judge.get("/gyros/0417/drift", params={"parameter": "w0y"}).json()["parameters"]
    assert (drift["sessions"], drift["reduced"]) == (150, True)
    for wanted, count in (({}, 150), ({"points": 4}, 4)):
        answer = judge.get(
            "/gyros/0417/drift", params={"parameter": "w0y"} | wanted, headers={"accept": "text/csv"}
        )
        assert 1 < len(answer.text.splitlines()) - 1 <= count
    whole = judge.get("/gyros/0417/drift", params={"parameter": "w0y"}, headers={"accept": "text/csv"})
    assert [int(row.split(",")[10]) for row in whole.text.splitlines()[1:]] == list(range(1, 151))


@pytest.mark.parametrize(
    "address",
    ["gyros/0417/drift", "gyros/0417/drift/components", "gyros/0417/drift/replaced", "gyros/0417/events",
     "gyros/0417/baselines", "alarms", "gyros/0417/history"],
)  # fmt: skip
def test_everything_as_csv_and_parquet(judge, address):
    text = judge.get(address, headers={"accept": "text/csv"})
    assert text.headers["content-type"].startswith("text/csv")
    names = text.text.split("\n")[0].split(",")
    table = pq.read_table(io.BytesIO(judge.get(address, headers={"accept": PARQUET}).content))
    assert table.column_names == names
    assert len(table) == len(text.text.splitlines()) - 1


def test_events_are_entered_listed_and_withdrawn(judge):
    made = judge.post("/gyros/0417/events", json={"kind": "repair", "happened_at": "2024-05-01T00:00:00Z"})
    assert made.status_code == 201
    moved = judge.post("/stands/S1/events", json={"kind": "moved", "happened_at": "2024-06-01T00:00:00Z"})
    listed = judge.get("/gyros/0417/events").json()["items"]
    assert [item["id"] for item in listed] == [made.json()["id"], moved.json()["id"]]
    number = made.json()["id"]
    assert judge.post(f"/events/{number}/withdrawal").json()["withdrawn_by"] == "sokolov"
    assert judge.post(f"/events/{number}/withdrawal").status_code == 409
    assert len(judge.get("/gyros/0417/events").json()["items"]) == 1
    assert len(judge.get("/gyros/0417/events", params={"withdrawn": True}).json()["items"]) == 2
    assert judge.get("/stands/S1/events").json()["items"] == [moved.json()]


def test_a_refused_event_names_its_field(judge):
    refused = judge.post("/gyros/0417/events", json={"kind": "storm", "happened_at": "2024-05-01T00:00:00Z"})
    assert refused.status_code == 422
    assert refused.json()["errors"][0]["pointer"] == "#/kind"
    later = judge.post("/gyros/0417/events", json={"kind": "repair", "happened_at": "2150-01-01T00:00:00Z"})
    assert later.json()["errors"][0]["pointer"] == "#/happened_at"


def test_a_baseline_is_proposed_frozen_and_retired(judge):
    proposal = judge.get("/gyros/0417/baselines/proposal").json()
    assert proposal["calibrations"] == list(range(1, 13))
    made = _freeze(judge, calibrations=proposal["calibrations"][:10], reason="first year").json()
    assert [item["reason"] for item in made] == ["first year"]
    assert judge.get("/gyros/0417/baselines").json()["items"] == made
    number = made[0]["id"]
    assert judge.post(f"/baselines/{number}/retirement").json()["retired_by"] == "sokolov"
    assert judge.get("/gyros/0417/baselines").json()["items"] == []
    assert len(judge.get("/gyros/0417/baselines", params={"retired": True}).json()["items"]) == 1


def test_an_alarm_is_answered(judge, service):
    _freeze(judge)
    _study(service)
    alarms = judge.get("/alarms").json()["items"]
    alarm = next(item for item in alarms if item["kind"] == "beyond-limits")
    assert "beyond the control limits" in alarm["detail"]
    address = f"/alarms/{alarm['id']}"
    assert judge.post(f"{address}/acknowledgement", json={"cause": "other"}).status_code == 422
    answered = judge.post(f"{address}/acknowledgement", json={"cause": "gyro", "note": "bearing"})
    assert answered.json()["state"] == "acknowledged"
    assert judge.get(address).json() == answered.json()
    assert judge.post(f"{address}/acknowledgement", json={"cause": "gyro"}).status_code == 409
    assert alarm["id"] not in [item["id"] for item in judge.get("/alarms").json()["items"]]
    assert alarm["id"] in [
        item["id"] for item in judge.get("/alarms", params={"state": "any"}).json()["items"]
    ]


def test_alarms_come_in_parts(judge, service):
    _freeze(judge)
    _study(service)
    whole = [item["id"] for item in judge.get("/alarms").json()["items"]]
    assert len(whole) > 1
    part = judge.get("/alarms", params={"limit": 1}).json()
    found = [item["id"] for item in part["items"]]
    while part["next"]:
        part = judge.get(part["next"].removeprefix("/api/v1")).json()
        found += [item["id"] for item in part["items"]]
    assert found == whole


@pytest.mark.parametrize("token", ["both", "read"])
def test_a_machines_token_judges_nothing(judge, service, token):
    client = service.client(token)
    assert _freeze(client).status_code == 403
    assert client.post("/alarms/1/acknowledgement", json={"cause": "gyro"}).status_code == 403


def test_nobody_known(judge):
    for address in ("/gyros/0999/drift", "/gyros/0999/events", "/stands/S9/events", "/alarms/99"):
        assert judge.get(address).status_code == 404
