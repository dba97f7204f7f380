"""The page of the validation pack."""

import json
import re

import pytest
from fastapi.testclient import TestClient

from app.services import access, jobs, validation
from app.services.lab import Lab
from app.services.validating import validate
from app.validation.pack import suites

TAG = re.compile(r"<[^>]+>")


@pytest.fixture
def quick(monkeypatch: pytest.MonkeyPatch) -> None:
    """Only what takes no time."""
    chosen = {"nist-strd": suites(False, 0)["nist-strd"]}
    monkeypatch.setattr("app.validation.pack.suites", lambda full, seed: chosen)


@pytest.fixture
def validated(lab: Lab, quick: None) -> str:
    """A laboratory with one report; its name."""
    with lab.read(access.SYSTEM) as work:
        payload = validation.prepare(work, None, {"full": False, "seed": 7})
    validate(payload, lambda fraction, what: None)
    with lab.read(access.SYSTEM) as work:
        return validation.names(work)[0]


def words(text: str) -> str:
    return " ".join(TAG.sub(" ", text[text.index("<main") :]).split())


def test_nothing_yet_offers_to_run_it(technician: TestClient) -> None:
    text = technician.get("/validation").text
    assert "Nothing has been validated here yet." in text
    assert 'action="/validation"' in text


def test_whoever_may_only_read_cannot_run_it(designer: TestClient, queued: list[str]) -> None:
    assert 'action="/validation"' not in designer.get("/validation").text
    assert designer.post("/validation").status_code == 403
    assert queued == []


def test_running_it_leads_to_its_job_and_twice_is_once(
    technician: TestClient, lab: Lab, queued: list[str]
) -> None:
    first = technician.post("/validation")
    assert first.status_code == 303
    assert first.headers["location"] == f"/jobs/{queued[0]}"
    assert technician.post("/validation").headers["location"] == first.headers["location"]
    assert len(queued) == 1
    text = technician.get("/validation").text
    assert "A validation is on its way." in text
    assert 'action="/validation"' not in text


def test_the_report_shows_what_was_expected_and_obtained(technician: TestClient, validated: str) -> None:
    text = words(technician.get("/validation").text)
    assert "All 12 cases passed." in text
    assert "−0.262323073774029" in text
    assert "digits, 10 required" in text
    assert "solver.least_squares.solve" in text
    assert "Seed 7 " in text


def test_in_russian(technician: TestClient, validated: str) -> None:
    text = words(technician.get("/validation", headers={"accept-language": "ru"}).text)
    assert "−0,262323073774029" in text
    assert "Пройдены все 12 проверок." in text


def test_for_printing_every_case_is_open(technician: TestClient, validated: str) -> None:
    assert technician.get("/validation").text.count("<details") == 12
    assert "open>" not in technician.get("/validation").text
    assert technician.get(f"/validation/{validated}?every=true").text.count(" open>") == 12


def test_a_failed_case_is_open_and_says_so(technician: TestClient, lab: Lab, validated: str) -> None:
    with lab.read(access.SYSTEM) as work:
        content = json.loads(json.dumps(validation.report(work, validated).content))
        path = work.files.folder.parent / "validation" / "20990101T000000000000Z.json"
    case = content["groups"][0]["cases"][3]
    case["verdict"] = content["verdict"] = case["checks"][0]["verdict"] = "fail"
    content["cases_failed"] = 1
    path.write_text(json.dumps(content), encoding="utf-8")
    text = technician.get("/validation").text
    assert "1 case of 12 failed." in words(text)
    assert text.count(" open>") == 1
    assert f'href="/validation/{validated}"' in text


def test_a_report_of_an_earlier_version_is_still_shown(
    technician: TestClient, lab: Lab, validated: str
) -> None:
    """The first reports had no `detail` beside a check's name."""
    with lab.read(access.SYSTEM) as work:
        path = work.files.folder.parent / "validation" / f"{validated}.json"
    content = json.loads(path.read_text(encoding="utf-8"))
    for case in content["groups"][0]["cases"]:
        for check in case["checks"]:
            del check["detail"]
    path.write_text(json.dumps(content), encoding="utf-8")
    assert "All 12 cases passed." in words(technician.get("/validation").text)


def test_the_report_as_json(technician: TestClient, validated: str) -> None:
    found = technician.get(f"/validation/{validated}.json").json()
    assert found["verdict"] == "pass"
    assert found["groups"][0]["key"] == "nist-strd"


@pytest.mark.parametrize("name", ["20200101T000000000000Z", "..%2F..%2Fdriftbook", "x"])
def test_an_unknown_report_is_not_there(technician: TestClient, validated: str, name: str) -> None:
    assert technician.get(f"/validation/{name}").status_code == 404
    assert technician.get(f"/validation/{name}.json").status_code == 404


def test_a_job_that_ended_leads_back(technician: TestClient, lab: Lab, queued: list[str]) -> None:
    technician.post("/validation")
    with lab.write(access.SYSTEM) as work:
        jobs.cancel(work, queued[0])
    text = technician.get(f"/jobs/{queued[0]}").text
    assert "It was cancelled." in text
    assert "from the session" not in text
    assert 'href="/validation"' in text
