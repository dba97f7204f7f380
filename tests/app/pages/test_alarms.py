import csv
import html
import io
import re
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest
from fastapi.testclient import TestClient

from app.errors import Forbidden
from app.i18n import speaking
from app.pages.forms import sentence
from app.services import access, gyros
from app.services.lab import Lab, Person
from app.store import equipment


@pytest.fixture(scope="session")
def prepared(laid: Path) -> Path:
    """Gyro 0417 with two open alarms and an acknowledged one."""
    return laid


def text(page: str) -> str:
    return html.unescape(
        re.sub(
            r"\s+",
            " ",
            re.sub(r"</(?:h2|p|td|th|dt|dd)>", " ", re.sub(r"<(?!/(?:h2|p|td|th|dt|dd))[^>]+>", "", page)),
        )
    )


def test_nobody_sees_alarms_without_signing_in(anonymous: TestClient) -> None:
    for path in ("/alarms", "/alarms.csv", "/alarms/1"):
        assert anonymous.get(path).status_code == 303
    assert anonymous.post("/alarms/1/acknowledgement").status_code == 303


def test_open_alarms_the_worst_first(technician: TestClient) -> None:
    page = text(technician.get("/alarms").text)
    assert "2 alarms" in page
    assert page.index("is below the lower control limit") < page.index("a month.")
    assert "stepped by" not in page


def test_facets_count_and_choose(technician: TestClient) -> None:
    page = technician.get("/alarms").text
    assert 'href="/alarms?state=acknowledged"' in page
    assert "Acknowledged 1" in text(page)
    assert "S1 2" in text(page)
    assert "GVK-6 2" in text(page)
    chosen = text(technician.get("/alarms?kind=trend").text)
    assert "1 alarm " in chosen
    assert "is below the lower control limit" not in chosen
    everything = text(technician.get("/alarms?state=all").text)
    assert "A repair or an adjustment: at the repair · acknowledged by A. Sokolov" in everything
    assert "No alarm of this selection" in technician.get("/alarms?type=DTG-4").text


def test_the_same_as_a_file(technician: TestClient) -> None:
    rows = list(csv.DictReader(io.StringIO(technician.get("/alarms.csv?state=all").text)))
    assert {(row["kind"], row["state"]) for row in rows} == {
        ("beyond-limits", "open"), ("trend", "open"), ("step", "acknowledged"),
    }  # fmt: skip
    assert {row["gyro"] for row in rows} == {"0417"}
    assert len(technician.get("/alarms.json").json()) == 2
    assert technician.get("/alarms.parquet").content[:4] == b"PAR1"


def test_one_alarm_with_its_evidence(technician: TestClient) -> None:
    page = technician.get("/alarms/1").text
    assert "Beyond control" in page
    assert 'href="/gyros/0417/drift/w0y?period=all&amp;method=least-squares"' in page
    assert "First shown by" in page
    assert technician.get("/alarms/999").status_code == 404


def test_an_alarm_is_acknowledged_with_a_cause_and_leads_back(quality: TestClient) -> None:
    sent = {"cause": "gyro", "note": "bearing wears", "next": "/gyros/0417?period=all"}
    answer = quality.post("/alarms/1/acknowledgement", data=sent)
    assert (answer.status_code, answer.headers["location"]) == (303, "/gyros/0417?period=all")
    assert "The gyro itself: bearing wears · acknowledged by" in text(quality.get("/alarms/1").text)
    assert "1 alarm " in text(quality.get("/alarms").text)
    assert '<span class="count">1<' in quality.get("/alarms").text


def test_what_is_wrong_comes_back_with_what_was_typed(quality: TestClient) -> None:
    answer = quality.post("/alarms/1/acknowledgement", data={"cause": "other", "note": ""})
    assert answer.status_code == 422
    assert "Say in the note what the cause was." in answer.text
    assert '<option value="other" selected>' in answer.text
    again = quality.post("/alarms/3/acknowledgement", data={"cause": "gyro"})
    assert again.status_code == 409
    assert "not open any more" in again.text


def test_an_answer_leads_nowhere_else(quality: TestClient) -> None:
    sent = {"cause": "gyro", "next": "//elsewhere.example/"}
    assert quality.post("/alarms/1/acknowledgement", data=sent).headers["location"] == "/alarms/1"


def test_who_does_not_judge_cannot_answer(technician: TestClient, designer: TestClient) -> None:
    assert "/acknowledgement" not in technician.get("/alarms/1").text
    assert technician.post("/alarms/1/acknowledgement", data={"cause": "gyro"}).status_code == 403
    assert designer.post("/alarms/1/acknowledgement", data={"cause": "gyro"}).status_code == 403


def test_gyros_that_are_due_stand_below(technician: TestClient, lab: Lab) -> None:
    assert "No gyro is due" in technician.get("/alarms").text
    with lab.write(access.SYSTEM) as work:
        kind = equipment.gyro_type(work.db, "GVK-6")
        assert kind is not None
        kind.interval_days = 3  # the last session was four days ago
        gyros.add_gyro(work, "0500", "GVK-6")
    page = technician.get("/alarms").text
    due = text(page[page.index('id="due"') :])
    assert due.index("0417 GVK-6 Overdue") < due.index("0500 GVK-6 Never calibrated")
    expected = datetime.now(UTC) - timedelta(days=1)
    assert f"{expected:%Y}" in due
    assert 'href="/sessions/new?gyro=0500"' in page


def test_from_the_first_screen_to_the_drifting_gyro_in_two_clicks(technician: TestClient) -> None:
    today = technician.get("/").text
    assert "2 open alarms, the worst of each gyro or stand" in text(today)
    link = re.search(r'href="(/gyros/0417\?period=all&amp;method=least-squares#alarm-1)"', today)
    assert link
    assert 'id="alarm-1"' in technician.get(html.unescape(link[1])).text


def test_without_alarms_the_page_says_what_would_stand_there(technician: TestClient, lab: Lab) -> None:
    with lab.write(access.SYSTEM) as work:
        from app.store.tables import Alarm

        work.db.query(Alarm).delete()
    page = technician.get("/alarms").text
    assert "No alarms" in page
    assert "until somebody says why" in page
    assert "open alarms" not in technician.get("/").text


def test_a_refusal_names_the_roles_in_words() -> None:
    person = Person("irina", "I. Petrova", "technician", frozenset({"read", "upload"}))
    with pytest.raises(Forbidden) as refused:
        access.require_judge(person)
    with speaking("ru"):
        said = sentence(refused.value.problems[0])
    assert said == "Это могут роли метролог, менеджер по качеству, администратор; ваша роль: техник."
