import re
from datetime import UTC, datetime, timedelta

import pytest
from fastapi.testclient import TestClient

from app.exchange.rows import MeansRow
from app.services import access, calibrations, gyros, ingest, sessions, stands
from app.services.drift import alarms, events
from app.services.drift.alarms import Finding
from app.services.lab import Lab, Work
from app.services.lookup import find_gyro
from app.services.sessions import NewSession
from app.store.tables import Calibration, CalibrationParameter, DriftStudy
from solver.records import PARAMETERS


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


def _alarm(work: Work, gyro: str, kind: str, parameter: str, calibration: int) -> None:
    """As a study would leave it."""
    finding = Finding(parameter, kind, calibration, calibration, str(work.now), str(work.now), "Found.", {})
    study = DriftStudy(gyro_id=find_gyro(work, gyro).id, method="least-squares")
    alarms.take_in(work, study, [finding], [calibration])


def _result(work: Work, gyro: str, days_ago: float, value: float | None = 0.0) -> int:
    gyros.add_gyro(work, gyro, "GVK-6")
    new = NewSession(gyro, "S1", new_start=True, started_at=work.now - timedelta(days=days_ago))
    row = Calibration(
        session_id=sessions.open_session(work, new).id, revision=1, method="least-squares", solver_version="2.0.0",
        input_hash=gyro, certificate_id=1, inputs=[], result="{}", result_digest="", chi2=24.0, fit_dof=24,
        created_at=work.now, created_by="irina",
        parameters=[
            CalibrationParameter(method="least-squares", parameter=name, value=value, standard_uncertainty=0.004,
                                 coverage_factor=2.0, u_noise=0.003)
            for name in PARAMETERS
        ],
    )  # fmt: skip
    work.db.add(row)
    work.db.flush()
    return row.id


@pytest.fixture
def alarming(stocked: Lab) -> Lab:
    """Six gyros with a serious alarm each, a drifting one, and one that is ten days overdue."""
    with stocked.write(access.SYSTEM) as work:
        gyros.set_interval(work, "GVK-6", 90)
        gyros.set_limits(work, "GVK-6", {"w0x": (-6.0, 6.0)})
        for number in range(6):
            _alarm(work, f"05{number}", "step", "w0x", _result(work, f"05{number}", 1.0 + number))
        _alarm(work, "0600", "trend", "w0y", _result(work, "0600", 1.0))
        _result(work, "0700", 100.0)
        _result(work, "0800", 2.0, 7.0)
    return stocked


def test_every_finding_is_two_clicks_away_however_many_alarms_there_are(
    technician: TestClient, alarming: Lab
) -> None:
    page = technician.get("/").text
    assert page.count("#alarm-") == 5
    assert "2 more gyros or stands with alarms" in page
    for kind, gyro, count in (("trend", "0600", 1), ("step", "050", 6)):
        assert re.search(rf'<a href="/alarms\?kind={kind}">.*?<span class="n">{count}</span>', page)
        assert f'href="/gyros/{gyro}?' in technician.get(f"/alarms?kind={kind}").text


def test_what_is_overdue_stands_on_the_first_screen(technician: TestClient, alarming: Lab) -> None:
    page = technician.get("/").text
    overdue = page[page.index('id="overdue"') : page.index('id="queue"')]
    assert "10 days ago" in overdue
    assert 'href="/gyros/0700"' in overdue
    assert 'href="/gyros/0600"' not in overdue


@pytest.mark.parametrize(
    ("role", "parts"),
    [
        ("technician", ["now", "drift", "overdue", "queue"]),
        ("metrologist", ["results", "drift", "overdue", "now", "queue"]),
        ("quality", ["overdue", "drift", "acts", "now", "queue"]),
    ],
)
def test_the_queue_is_that_of_the_role(
    request: pytest.FixtureRequest, alarming: Lab, role: str, parts: list[str]
) -> None:
    with alarming.write(access.SYSTEM) as work:
        events.add(work, "repair", work.now, "lead resoldered", gyro="0600")
    page = request.getfixturevalue(role).get("/").text
    assert re.findall(r'<h2 id="(\w+)"', page) == parts
    assert page.count('class="btn primary') == 1


def test_a_metrologist_sees_the_worst_result_first(metrologist: TestClient, alarming: Lab) -> None:
    page = metrologist.get("/").text
    shown = page[page.index('id="results"') : page.index('id="drift"')]
    assert re.findall(r'class="id" href="/gyros/(\w+)"', shown)[0] == "0800"
    assert "0700" not in shown, "of the last 30 days"


def test_quality_sees_who_did_what(quality: TestClient, alarming: Lab) -> None:
    with alarming.write(access.SYSTEM) as work:
        made = events.add(work, "repair", work.now, "lead resoldered", gyro="0600")
        alarms.acknowledge(work, alarms.alarms(work, gyro="0600")[0].id, "repair", "see the order")
        events.withdraw(work, made.id)
    page = quality.get("/").text
    shown = page[page.index('id="acts"') : page.index('id="now"')]
    for said in ("event entered (Repair)", "event withdrawn (Repair)", "alarm acknowledged (Drifting)"):
        assert said in shown
    assert "see the order" in shown
