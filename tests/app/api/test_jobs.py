import json
import threading
import time
from typing import Any

import httpx
import pytest
import structlog
from serving import Service

from app.errors import problem
from app.services.ledger import JobLedger


@pytest.fixture
def job(stand: httpx.Client, session_id: int) -> dict[str, Any]:
    """A job that waits, because nobody works."""
    stand.put(f"/sessions/{session_id}/positions/0/0/means", json={"jx_ma": 0.1, "jy_ma": 0.2})
    asked: dict[str, Any] = stand.post(f"/sessions/{session_id}/calibrations", json={}).json()
    return asked


def test_a_job_that_waits(stand: httpx.Client, job: dict[str, Any]) -> None:
    assert stand.get(f"/jobs/{job['id']}").json() == job
    assert (job["state"], job["progress"], job["result"], job["error"]) == ("queued", 0.0, None, None)
    assert stand.get("/jobs").json()["items"] == [job]


def test_asked_twice_while_it_waits_it_is_one(stand: httpx.Client, job: dict[str, Any], noted: Any) -> None:
    again = stand.post(f"/sessions/{job['session']}/calibrations", json={})
    assert (again.status_code, again.json()["id"]) == (202, job["id"])
    assert noted.queued == [job["id"]]


def test_cancelling(stand: httpx.Client, job: dict[str, Any], noted: Any) -> None:
    cancelled = stand.post(f"/jobs/{job['id']}/cancel")
    assert (cancelled.status_code, cancelled.json()["state"]) == (200, "cancelled")
    assert noted.cancelled == [job["id"]]
    again = stand.post(f"/jobs/{job['id']}/cancel")
    assert again.json() == cancelled.json()
    assert noted.cancelled == [job["id"]]
    assert stand.get("/jobs").json()["items"] == []


def test_a_failure_is_a_problem_document(service: Service, stand: httpx.Client, job: dict[str, Any]) -> None:
    ledger = JobLedger(service.lab)
    ledger.begin(job["id"])
    ledger.fail(job["id"], [problem("bad", "Row %(n)d is bad.", file="a.csv", row=7, column="jx_ma", n=7)])
    error = stand.get(f"/jobs/{job['id']}").json()["error"]
    assert error == {
        "type": "/api/v1/docs#job-failed",
        "title": "The job failed",
        "status": 422,
        "detail": "a.csv, row 7, column jx_ma: Row 7 is bad.",
        "code": "bad",
        "errors": [{"detail": "Row 7 is bad.", "code": "bad", "file": "a.csv", "row": 7, "column": "jx_ma"}],
    }


def events(lines: list[str]) -> list[dict[str, str]]:
    """Server-sent events as the standard reads them: fields, ended by an empty line."""
    found: list[dict[str, str]] = [{}]
    for line in lines:
        if not line:
            found.append({})
        elif not line.startswith(":"):
            name, _, value = line.partition(": ")
            found[-1][name] = value
    return [event for event in found if event]


def test_events_follow_a_job_to_its_end(service: Service, stand: httpx.Client, job: dict[str, Any]) -> None:
    ledger = JobLedger(service.lab)

    def work() -> None:
        ledger.begin(job["id"])
        time.sleep(0.5)
        ledger.progress(job["id"], 0.5, "solving")
        time.sleep(0.5)
        ledger.fail(job["id"], [problem("bad", "It is bad.")])

    worker = threading.Thread(target=work)
    with stand.stream("GET", f"/jobs/{job['id']}/events") as stream:
        assert stream.headers["content-type"].startswith("text/event-stream")
        assert "no-cache" in stream.headers["cache-control"]
        lines = stream.iter_lines()
        received = [next(lines)]
        worker.start()
        received += list(lines)  # ends by itself
    worker.join()
    found = events(received)
    states = [json.loads(event["data"])["state"] for event in found]
    assert states[0] == "queued"
    assert states[-2:] == ["failed", "failed"]
    assert [event["event"] for event in found] == ["job"] * (len(found) - 1) + ["end"]
    assert "0.5" in {str(json.loads(event["data"])["progress"]) for event in found}
    assert len({event["id"] for event in found}) == len(found) - 1  # each state once, the end in the last one


def test_whoever_has_seen_a_state_is_not_told_again(stand: httpx.Client, job: dict[str, Any]) -> None:
    path = f"/jobs/{job['id']}/events"
    with stand.stream("GET", path) as stream:
        seen = events([next(lines) for lines in [stream.iter_lines()] for _ in range(3)])[0]["id"]
    stand.post(f"/jobs/{job['id']}/cancel")
    with stand.stream("GET", path, headers={"last-event-id": seen}) as stream:
        states = [json.loads(event["data"])["state"] for event in events(list(stream.iter_lines()))]
    assert states == ["cancelled", "cancelled"]


def test_a_stream_ends_when_its_reader_goes(stand: httpx.Client, job: dict[str, Any]) -> None:
    path = f"/jobs/{job['id']}/events"
    with structlog.testing.capture_logs() as lines:

        def over() -> bool:
            return any(line.get("path") == f"/api/v1{path}" for line in lines)

        with stand.stream("GET", path) as stream:
            received = stream.iter_lines()
            next(received)
            assert not over()  # a request is logged when it is over
        deadline = time.monotonic() + 10
        while not over():
            assert time.monotonic() < deadline, "the server goes on although nobody reads"
            time.sleep(0.05)


def test_simulations_are_asked_for(stand: httpx.Client, noted: Any) -> None:
    body, key = {"gyro": "0417", "stand": "S1", "seed": 7}, {"idempotency-key": "s"}
    first = stand.post("/simulations", json=body, headers=key)
    again = stand.post("/simulations", json=body, headers=key)
    other = stand.post("/simulations", json=body | {"seed": 8}, headers=key)
    assert [answer.status_code for answer in (first, again, other)] == [202, 200, 409]
    assert again.json()["id"] == first.json()["id"]
    assert noted.queued == [first.json()["id"]]
    refused = stand.post("/simulations", json=body | {"duration_s": 1e6, "rate_hz": 1e6})
    assert {error["pointer"] for error in refused.json()["errors"]} == {"#/duration_s", "#/rate_hz"}
    for seed in (-1, 2**63, 1.5, "7"):
        assert stand.post("/simulations", json=body | {"seed": seed}).status_code == 422
