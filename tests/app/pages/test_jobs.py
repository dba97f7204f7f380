import queue
import re
import threading
from collections.abc import Callable
from datetime import UTC, datetime
from typing import Any

import pytest
from fastapi.testclient import TestClient

from app.errors import Problem, problem
from app.i18n import speaking
from app.pages import jobs as job_pages
from app.pages import labels
from app.services import access, computing, jobs, simulations
from app.services.lab import Lab
from app.services.ledger import JobLedger
from app.services.simulations import NewSimulation


@pytest.fixture
def job_id(stocked: Lab) -> str:
    with stocked.write(access.SYSTEM) as work:
        _, job = simulations.request(work, NewSimulation("0417", "S1", seed=1))
    return job.id


def _fail(lab: Lab, job_id: str, *problems: Problem) -> None:
    JobLedger(lab).fail(job_id, problems)


def test_a_waiting_job_is_followed(technician: TestClient, job_id: str) -> None:
    page = technician.get(f"/jobs/{job_id}").text
    assert "Waiting" in page
    assert f'sse-connect="/jobs/{job_id}/events" sse-close="end"' in page
    assert '<noscript><meta http-equiv="refresh" content="2"></noscript>' in page
    assert "hx-sse-2.min.js" in page


def test_a_running_job_tells_how_far_it_is(technician: TestClient, stocked: Lab, job_id: str) -> None:
    ledger = JobLedger(stocked)
    assert ledger.begin(job_id) is not None
    ledger.progress(job_id, 0.4, "simulating")
    page = technician.get(f"/jobs/{job_id}", headers={"accept-language": "ru"}).text
    assert '<progress max="1" value="0.4"' in page
    assert "40 %" in page
    assert "моделируется" in page


def test_a_failed_job_says_why_and_what_to_do(technician: TestClient, stocked: Lab, job_id: str) -> None:
    _fail(stocked, job_id, problem("nothing-measured", "No position of this session has been measured yet."))
    page = technician.get(f"/jobs/{job_id}").text
    assert "No position of this session has been measured yet." in page
    assert "Correct it in the session and solve it again." in page
    assert re.search(r'class="btn primary" href="/sessions/\d+">Go to the session', page)
    assert "sse-connect" not in page
    russian = technician.get(f"/jobs/{job_id}", headers={"accept-language": "ru"}).text
    assert "Ни одно положение этого сеанса ещё не измерено." in russian


def test_a_job_is_cancelled_once(
    technician: TestClient, stocked: Lab, job_id: str, cancelled: list[str]
) -> None:
    for _ in range(2):
        answer = technician.post(f"/jobs/{job_id}/cancel")
        assert (answer.status_code, answer.headers["location"]) == (303, f"/jobs/{job_id}")
    assert cancelled == [job_id]
    assert "It was cancelled." in technician.get(f"/jobs/{job_id}").text


def test_whoever_may_only_read_cancels_nothing(
    designer: TestClient, stocked: Lab, job_id: str, cancelled: list[str]
) -> None:
    page = designer.get(f"/jobs/{job_id}").text
    assert f'action="/jobs/{job_id}/cancel"' not in page
    assert designer.post(f"/jobs/{job_id}/cancel").status_code == 403
    assert cancelled == []


def test_an_unknown_job_is_not_there(technician: TestClient, anonymous: TestClient, job_id: str) -> None:
    assert technician.get("/jobs/none").status_code == 404
    assert technician.get("/jobs/none/events").status_code == 404
    assert anonymous.get(f"/jobs/{job_id}/events").status_code == 303


def _events(text: str) -> list[tuple[str, str]]:
    found = []
    for block in text.replace("\r\n", "\n").split("\n\n"):
        lines = block.split("\n")
        name = next((line[7:] for line in lines if line.startswith("event: ")), None)
        if name:
            found.append((name, "\n".join(line[5:].strip() for line in lines if line.startswith("data:"))))
    return found


@pytest.fixture
def seen(monkeypatch: pytest.MonkeyPatch) -> Callable[[str], None]:
    """Waits until the stream of events has seen the job in a state and phase."""
    looks: queue.Queue[str] = queue.Queue()
    look = job_pages._look

    def noted(*arguments: Any) -> Any:
        job, session = look(*arguments)
        looks.put(f"{job.state} {job.phase}".strip())
        return job, session

    def wait(state: str) -> None:
        while looks.get(timeout=30) != state:
            pass

    monkeypatch.setattr(job_pages, "_look", noted)
    return wait


def test_events_follow_the_job_to_its_end(
    technician: TestClient, stocked: Lab, job_id: str, seen: Callable[[str], None]
) -> None:
    ledger = JobLedger(stocked)

    def live() -> None:
        seen("queued")
        ledger.begin(job_id)
        ledger.progress(job_id, 0.5, "solving")
        seen("running solving")
        _fail(stocked, job_id, problem("any", "The file is empty. Export it again, or choose another file."))

    worker = threading.Thread(target=live)
    worker.start()
    answer = technician.get(f"/jobs/{job_id}/events", headers={"accept-language": "ru"})
    worker.join()
    assert answer.headers["content-type"].startswith("text/event-stream")
    events = _events(answer.text)
    assert [text for name, text in events if name == "said"] == ["Ожидает", "Идёт", "Отказ"]
    states = [text for name, text in events if name == "state"]
    assert "решается" in states[-2]
    assert "Файл пуст." in states[-1]  # in the language of the page
    assert events[-1][0] == "end"


def test_a_job_that_has_ended_is_told_at_once(technician: TestClient, stocked: Lab, job_id: str) -> None:
    with stocked.write(access.SYSTEM) as work:
        jobs.cancel(work, job_id)
    began = datetime.now(UTC)
    names = [name for name, _ in _events(technician.get(f"/jobs/{job_id}/events").text)]
    assert names == ["said", "state", "end"]
    # No look is waited for: far below what a stuck stream would take.
    assert (datetime.now(UTC) - began).total_seconds() < 5


def test_every_phase_of_a_simulation_has_a_name(stocked: Lab, job_id: str) -> None:
    task, phases = JobLedger(stocked).begin(job_id), set[str]()
    assert task is not None
    computing.simulate(task.payload, lambda _fraction, phase: phases.add(phase))
    assert phases == {"simulating", "keeping", "solving"}
    with speaking("ru"):
        assert {labels.job_phase(phase) for phase in phases}.isdisjoint(phases)
