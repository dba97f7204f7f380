import csv
import io
import json
import re

import pytest
from fastapi.testclient import TestClient
from starlette.datastructures import URL

from app.services import access, sessions
from app.services.lab import Lab


def detail(lab: Lab, number: int) -> sessions.SessionDetail:
    with lab.read(access.SYSTEM) as work:
        return sessions.detail(work, number)


def test_nobody_sees_sessions_without_signing_in(anonymous: TestClient, opened: int) -> None:
    for path in (
        "/sessions",
        "/sessions/new",
        f"/sessions/{opened}",
        f"/sessions/{opened}/entry",
        "/sessions.csv",
    ):
        answer = anonymous.get(path)
        assert answer.status_code == 303
        assert URL(answer.headers["location"]).path == "/sign-in"


def test_whoever_only_reads_opens_and_solves_nothing(designer: TestClient, measured: int, queue) -> None:
    assert designer.get(f"/sessions/{measured}").status_code == 200
    assert designer.get("/sessions/new").status_code == 403
    assert designer.post("/sessions/new", data={"gyro": "0417", "stand": "S1"}).status_code == 403
    assert designer.post(f"/sessions/{measured}/solve").status_code == 403
    assert queue.queued == []


def test_the_empty_list_says_what_would_stand_there(technician: TestClient, stocked: Lab) -> None:
    page = technician.get("/sessions").text
    assert "No sessions yet" in page
    assert 'href="/sessions/new"' in page


def test_the_list_answers_without_a_click(technician: TestClient, result: int, measured: int) -> None:
    page = technician.get("/sessions").text
    assert f'href="/sessions/{measured}"' in page
    assert "16&nbsp;/&nbsp;16" in page
    assert re.search(
        r'1<span class="fr">\.\d+</span> <span class="pm">± 0<span class="fr">\.00\d+', page
    )  # ω0x = 1.5 °/h
    assert f'href="/results/{result}"' in page


def test_facets_count_and_narrow(technician: TestClient, opened: int) -> None:
    page = technician.get("/sessions").text
    assert 'href="/sessions?state=measuring"' in page
    narrowed = technician.get("/sessions", params={"state": "solved"}).text
    assert "No session fits this selection" in narrowed
    assert 'aria-current="true"' in narrowed


def test_the_list_as_csv_and_json(technician: TestClient, result: int, measured: int) -> None:
    rows = list(csv.DictReader(io.StringIO(technician.get("/sessions.csv").text)))
    assert [row["session"] for row in rows] == [str(measured)]
    # u(J) is stated without degrees of freedom: k of the normal distribution for 95 %, from tables
    assert float(rows[0]["coverage_factor_w0x"]) == pytest.approx(1.959964, abs=1e-6)
    assert float(rows[0]["w0x_deg_per_h"]) == technician.get("/sessions.json").json()[0]["w0x_deg_per_h"]


def test_older_sessions_are_a_link_away(technician: TestClient, stocked: Lab) -> None:
    with stocked.write(access.SYSTEM) as work:
        numbers = [sessions.open_session(work, sessions.NewSession("0417", "S1")).id for _ in range(51)]
    first = technician.get("/sessions").text
    assert f'href="/sessions?before={numbers[1]}"' in first
    older = technician.get("/sessions", params={"before": numbers[1]}).text
    assert f'href="/sessions/{numbers[0]}"' in older
    assert f'href="/sessions/{numbers[1]}"' not in older


def test_opening_a_session_leads_to_its_grid(technician: TestClient, stocked: Lab) -> None:
    form = {
        "gyro": "0417",
        "stand": "S1",
        "certificate": "",
        "power": "new",
        "temperature_c": "21,6",
        "note": "n",
    }
    answer = technician.post("/sessions/new", data=form)
    assert answer.status_code == 303
    number = int(answer.headers["location"].split("/")[2])
    assert answer.headers["location"] == f"/sessions/{number}/entry"
    opened = detail(stocked, number).session
    assert (opened.gyro, opened.stand, opened.certificate) == ("0417", "S1", "C-17")
    assert (opened.start, opened.temperature_c, opened.note, opened.created_by) == (1, 21.6, "n", "irina")


def test_the_same_start_is_not_counted_again(technician: TestClient, stocked: Lab) -> None:
    starts = []
    for power in ("new", "same", "new"):
        form = {"gyro": "0417", "stand": "S1", "certificate": "S1/C-17", "power": power}
        address = technician.post("/sessions/new", data=form).headers["location"]
        starts.append(detail(stocked, int(address.split("/")[2])).session.start)
    assert starts == [1, 1, 2]


def test_a_form_that_cannot_be_used_keeps_what_was_typed(technician: TestClient, stocked: Lab) -> None:
    form = {"gyro": "0417", "stand": "S1", "temperature_c": "warm", "note": "by the window"}
    answer = technician.post("/sessions/new", data=form)
    assert answer.status_code == 422
    assert 'value="warm"' in answer.text
    assert "by the window" in answer.text
    assert "“warm” is not a number" in answer.text
    assert '<option value="0417" selected>' in answer.text


def test_an_unknown_gyro_is_said_beside_its_field(technician: TestClient, stocked: Lab) -> None:
    answer = technician.post("/sessions/new", data={"gyro": "9999", "stand": "S1"})
    assert answer.status_code == 422
    assert "There is no gyro 9999" in answer.text


def test_a_session_shows_its_positions_and_what_to_do_next(technician: TestClient, opened: int) -> None:
    page = technician.get(f"/sessions/{opened}").text
    assert "0 of 16 positions" in page
    assert f'<a class="btn primary" href="/sessions/{opened}/entry">Enter currents</a>' in page
    assert page.count('class="cell ') == 16
    assert all(f'id="position-{number}"' in page for number in range(1, 17))


def test_a_complete_session_asks_to_be_solved(technician: TestClient, measured: int, queue) -> None:
    assert "Ready to solve" in technician.get(f"/sessions/{measured}").text
    answer = technician.post(f"/sessions/{measured}/solve")
    assert answer.status_code == 303
    assert answer.headers["location"] == f"/jobs/{queue.queued[0]}"
    assert "Solving" in technician.get(f"/sessions/{measured}").text


def test_nothing_measured_cannot_be_solved(technician: TestClient, opened: int, queue) -> None:
    answer = technician.post(f"/sessions/{opened}/solve")
    assert answer.status_code == 422
    assert "No position of this session has been measured yet." in answer.text
    assert queue.queued == []


def test_a_solved_session_leads_to_its_result(technician: TestClient, measured: int, result: int) -> None:
    page = technician.get(f"/sessions/{measured}").text
    assert f'<a class="btn primary" href="/results/{result}">See the result</a>' in page


def test_the_means_leave_as_they_would_come_in(technician: TestClient, stocked: Lab, measured: int) -> None:
    rows = list(csv.DictReader(io.StringIO(technician.get(f"/sessions/{measured}.csv").text)))
    kept = [item.measurement for item in detail(stocked, measured).positions]
    assert [(float(row["jx_ma"]), float(row["jy_ma"])) for row in rows] == [
        (item.jx_ma, item.jy_ma) for item in kept if item
    ]
    assert json.loads(technician.get(f"/sessions/{measured}.json").text)[0]["theta_deg"] == 0.0


def test_no_such_session(technician: TestClient, stocked: Lab) -> None:
    for path in ("/sessions/77", "/sessions/77/entry", "/sessions/77.csv", "/sessions/abc"):
        assert technician.get(path).status_code == 404


def test_in_russian(technician: TestClient, opened: int, measured: int) -> None:
    technician.cookies.set("lang", "ru")
    assert "Сеансы" in technician.get("/sessions").text
    assert "Можно решать" in technician.get(f"/sessions/{measured}").text
    assert "Новый сеанс" in technician.get("/sessions/new").text
