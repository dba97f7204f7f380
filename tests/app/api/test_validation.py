"""The validation pack over the API."""

import httpx
import pytest
from serving import NotingQueue, Service

from app.services import access, validation
from app.services.ledger import JobLedger
from app.services.validating import validate
from app.validation.pack import suites


@pytest.fixture
def quick(monkeypatch: pytest.MonkeyPatch) -> None:
    """Only what takes no time."""
    chosen = {"nist-strd": suites(False, 0)["nist-strd"]}
    monkeypatch.setattr("app.validation.pack.suites", lambda full, seed: chosen)


def test_from_the_request_to_the_report(
    client: httpx.Client, service: Service, noted: NotingQueue, quick: None
) -> None:
    assert client.get("/validation").status_code == 404
    asked = client.post("/validation", json={"seed": 5})
    assert asked.status_code == 202
    assert asked.headers["location"] == f"/api/v1/jobs/{noted.queued[0]}"
    assert client.post("/validation", json={}).json()["id"] == asked.json()["id"]
    assert len(noted.queued) == 1

    ledger = JobLedger(service.lab)  # as the engine does it
    task = ledger.begin(noted.queued[0])
    assert task is not None
    assert task.function == "app.services.validating:validate"
    ledger.succeed(noted.queued[0], validate(task.payload, lambda fraction, what: None))

    job = client.get(f"/jobs/{noted.queued[0]}").json()
    assert (job["state"], job["kind"], job["session"]) == ("succeeded", "validate", None)
    assert job["result"] == "/api/v1/validation"
    report = client.get("/validation").json()
    assert report["verdict"] == "pass"
    assert report["seed"] == 5
    assert report["groups"][0]["cases"][0]["checks"][0]["expected"] == -0.262323073774029


def test_a_report_that_is_being_written_is_not_seen(service: Service) -> None:
    with service.lab.read(access.SYSTEM) as work:
        folder = work.files.folder.parent / "validation"
        folder.mkdir()
        (folder / ".20260101T000000000000Z.json.part").write_text("{")
        (folder / "notes.json").write_text("{}")
        assert validation.names(work) == ()
