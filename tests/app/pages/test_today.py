from datetime import UTC, datetime

import pytest
from fastapi.testclient import TestClient

from app.exchange.rows import MeansRow
from app.services import access, calibrations, gyros, ingest, sessions, stands
from app.services.lab import Lab
from app.services.sessions import NewSession


def _open(lab: Lab, measured: int, **given: float) -> int:
    with lab.write(access.SYSTEM) as work:
        session = sessions.open_session(work, NewSession("0417", "S1"))
        for position in sessions.detail(work, session.id).positions[:measured]:
            row = MeansRow(position.theta_deg, position.psi_deg, 0.004579, -0.0005163, **given)
            ingest.save_means(work, session.id, row, ingest.Source("typed"))
    return session.id


def test_an_empty_laboratory_says_what_comes_first(technician: TestClient, lab: Lab) -> None:
    page = technician.get("/").text
    assert "Before the first session" in page
    assert 'class="btn primary big" href="/gyros/new"' in page
    with lab.write(access.SYSTEM) as work:
        gyros.add_gyro(work, "0417", "GVK-6")
    assert 'class="btn primary big" href="/stands/new"' in technician.get("/").text
    with lab.write(access.SYSTEM) as work:
        stands.add_stand(work, "S1", 55.0)
    assert 'class="btn primary big" href="/certificates/new"' in technician.get("/").text


def test_free_stands_lead_to_a_session(technician: TestClient, stocked: Lab) -> None:
    page = technician.get("/").text
    assert "The stands are free" in page
    assert 'class="btn primary big" href="/sessions/new"' in page
    assert "No sessions yet" in page


def test_the_open_session_names_the_next_position(technician: TestClient, stocked: Lab) -> None:
    number = _open(stocked, 10)
    page = technician.get("/").text
    assert "<h1>Position 11 of 16</h1>" in page
    assert "10 recorded, 6 to do" in page
    assert f'href="/sessions/{number}/entry#position-11">Enter position 11' in page
    assert page.count('class="cell ok"') == 10
    assert page.count('class="cell todo"') == 5
    assert page.count('class="cell running"') == 1
    assert "4.5790" in page  # jx in µA, four decimals as no uncertainty was given
    assert "−0.5163" in page
    assert "10 of 16" in page  # the stand in the navigation


def test_a_reading_below_the_method_stands_out(technician: TestClient, stocked: Lab) -> None:
    _open(stocked, 3, duration_s=45.0, rate_hz=200.0)
    page = technician.get("/").text
    assert page.count('class="cell attention"') == 3
    assert "below method" in page


def test_a_reading_at_the_edge_of_the_rule_does_not(technician: TestClient, stocked: Lab) -> None:
    # The measurement rule allows 0.1 % on duration and rate: 59.94 s and 199.8 Hz.
    _open(stocked, 1, duration_s=59.95, rate_hz=199.9)
    assert 'class="cell attention"' not in technician.get("/").text


def test_with_every_position_measured_solving_comes_next(technician: TestClient, stocked: Lab) -> None:
    number = _open(stocked, 16)
    page = technician.get("/").text
    assert "All 16 positions measured" in page
    assert f'class="btn primary big" href="/sessions/{number}">Check and solve' in page


def test_a_solving_session_refreshes_its_list(technician: TestClient, stocked: Lab) -> None:
    number = _open(stocked, 16)
    assert "hx-trigger" not in technician.get("/").text
    with stocked.write(access.SYSTEM) as work:
        job = calibrations.request(work, number)
    page = technician.get("/").text
    assert 'hx-trigger="every 3s" hx-select="#sessions"' in page
    assert f'<a href="/jobs/{job.id}">Watch</a>' in page


@pytest.mark.parametrize(("language", "day"), [("en", "%A"), ("ru", "2026")])
def test_the_day_is_written_out(technician: TestClient, lab: Lab, language: str, day: str) -> None:
    page = technician.get("/", headers={"accept-language": language}).text
    now = datetime.now(UTC).astimezone()
    assert (now.strftime(day) if language == "en" else str(now.year)) in page
