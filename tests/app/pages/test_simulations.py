import pytest
from fastapi.testclient import TestClient

from app.services import access, jobs, sessions
from app.services.lab import Lab

SENT = {
    "gyro": "0417",
    "stand": "S1",
    "seed": "7",
    "duration_s": "60",
    "rate_hz": "200",
    "noise_deg_per_h": "0,005",
}


def test_a_simulation_is_queued_and_watched(technician: TestClient, stocked: Lab, queued: list[str]) -> None:
    answer = technician.post("/simulations/new", data=SENT)
    assert answer.status_code == 303
    (job_id,) = queued
    assert answer.headers["location"] == f"/jobs/{job_id}"
    with stocked.read(access.SYSTEM) as work:
        job = jobs.job(work, job_id)
        assert job.session is not None
        session = sessions.session(work, job.session)
    assert (session.gyro, session.stand, session.origin, session.created_by) == (
        "0417",
        "S1",
        "simulation",
        "irina",
    )


def test_every_wrong_field_is_said_at_once(technician: TestClient, stocked: Lab, queued: list[str]) -> None:
    sent = {**SENT, "seed": "-1", "duration_s": "long", "rate_hz": ""}
    answer = technician.post("/simulations/new", data=sent)
    assert answer.status_code == 422
    assert "“-1” is not a whole number." in answer.text
    assert "“long” is not a number." in answer.text
    assert "There is no number here." in answer.text
    described = 'aria-describedby="f-duration_s-problem f-duration_s-hint" autofocus'
    assert f'name="duration_s" aria-invalid="true" {described}' in answer.text
    assert 'value="0,005"' in answer.text
    assert queued == []


def test_what_the_simulator_cannot_do_stands_at_its_field(technician: TestClient, stocked: Lab) -> None:
    answer = technician.post("/simulations/new", data={**SENT, "rate_hz": "5000"})
    assert answer.status_code == 422
    assert 'id="f-rate_hz-problem">The rate lies between' in answer.text


def test_an_unknown_gyro_is_said(technician: TestClient, stocked: Lab) -> None:
    answer = technician.post("/simulations/new", data={**SENT, "gyro": "9999"})
    assert answer.status_code == 404
    assert "There is no gyro 9999." in answer.text


@pytest.mark.parametrize("language", ["en", "ru"])
def test_without_gyros_the_way_is_shown(technician: TestClient, lab: Lab, language: str) -> None:
    page = technician.get("/simulations/new", headers={"accept-language": language}).text
    assert 'href="/gyros/new"' in page
    assert "<form method" not in page.split("<main")[1]


def test_seeds_offered_differ(technician: TestClient, stocked: Lab) -> None:
    pages = [technician.get("/simulations/new").text for _ in range(5)]
    seeds = {page.split('name="seed"')[1].split('value="')[1].split('"')[0] for page in pages}
    # Five draws out of a million: the same twice has a probability of 1e-5.
    assert len(seeds) > 1
