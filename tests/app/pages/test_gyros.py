import csv
import io
import re
from datetime import UTC, datetime, timedelta

import drift_laboratory
import pytest
import sqlalchemy as sa
from fastapi.testclient import TestClient

from app.services import access, gyros
from app.services.lab import Lab
from app.store import equipment
from app.store.tables import Alarm


@pytest.fixture
def several(stocked: Lab) -> Lab:
    with stocked.write(access.SYSTEM) as work:
        gyros.add_gyro(work, "0431", "GVK-6")
        gyros.add_gyro(work, "D-031", "DTG-4", "=cmd()")
    return stocked


def _serials(page: str) -> list[str]:
    return [part.split('">')[1].split("<")[0] for part in page.split('class="id" href="/gyros/')[1:]]


def test_an_empty_list_says_how_to_begin(technician: TestClient) -> None:
    assert "No gyros yet" in technician.get("/gyros").text


def test_the_list_is_narrowed_by_type_status_and_text(technician: TestClient, several: Lab) -> None:
    assert _serials(technician.get("/gyros").text) == ["0417", "0431", "D-031"]
    assert _serials(technician.get("/gyros?type=DTG-4").text) == ["D-031"]
    assert _serials(technician.get("/gyros?status=none").text) == ["0417", "0431", "D-031"]
    assert _serials(technician.get("/gyros?q=043").text) == ["0431"]
    assert _serials(technician.get("/gyros?sort=-serial").text) == ["D-031", "0431", "0417"]
    nothing = technician.get("/gyros?status=fails&type=DTG-4").text
    assert "No gyro fits this selection" in nothing


def test_what_needs_a_hand_comes_first(technician: TestClient, stocked: Lab, result: int) -> None:
    with stocked.write(access.SYSTEM) as work:
        gyros.set_limits(work, "GVK-6", {"w0x": (-0.1, 0.1)})  # 0417's fixed drift is 1.5 °/h
        gyros.add_gyro(work, "0400", "GVK-6")
    assert _serials(technician.get("/gyros").text) == ["0417", "0400"]
    assert _serials(technician.get("/gyros?sort=status").text) == ["0400", "0417"]


def test_alarms_and_a_day_that_is_past_come_before_what_is_well(technician: TestClient, lab: Lab) -> None:
    """Of four gyros of one type one is beyond control, one overdue, one drifts, and one is well."""
    now = datetime.now(UTC)
    with lab.write(access.SYSTEM) as work:
        results = drift_laboratory.furnish(work, now)
        drift_laboratory.judge(work, now, results)  # of 0417, a serious alarm and a trend are open
        gyros.set_interval(work, "GVK-6", 60)
        for serial, days in (("0400", 4), ("0500", 70), ("0450", 4)):
            gyros.add_gyro(work, serial, "GVK-6")
            drift_laboratory.add_result(work, serial, 0, now - timedelta(days=days))
        drift = work.db.scalars(sa.select(Alarm).where(Alarm.kind == "trend")).one()
        row = equipment.gyro(work.db, "0450")
        assert row is not None
        drift.gyro_id = row.id
    page = technician.get("/gyros").text
    assert _serials(page) == ["0417", "0500", "0450", "0400"]
    lines = [re.sub(r"<[^>]+>", " ", line) for line in page.split('class="id"')[1:]]
    assert "Beyond control" in lines[0]
    assert "Overdue" in lines[1]
    assert "Drifting" in lines[2]
    files = technician.get("/gyros.json?sort=-status").json()
    assert [row["serial"] for row in files] == _serials(page)


def test_counts_follow_the_rest_of_the_selection(technician: TestClient, several: Lab) -> None:
    page = technician.get("/gyros?type=GVK-6").text
    assert 'Not calibrated</span> <span class="n">2</span>' in page
    assert 'GVK-6 <span class="n">2</span>' in page
    assert 'DTG-4 <span class="n">1</span>' in page
    assert 'href="/gyros?type=DTG-4"' in page


def test_unknown_orders_and_places_are_harmless(technician: TestClient, several: Lab) -> None:
    assert len(_serials(technician.get("/gyros?sort=nonsense&start=-5").text)) == 3
    assert technician.get("/gyros?start=999").status_code == 200


def test_the_same_list_as_csv_and_json(technician: TestClient, several: Lab) -> None:
    answer = technician.get("/gyros.csv?type=DTG-4")
    assert answer.headers["content-type"] == "text/csv; charset=utf-8"
    (row,) = csv.DictReader(io.StringIO(answer.text))
    assert row["serial"] == "D-031"
    assert row["note"] == "'=cmd()"  # not a formula
    assert "w0x_deg_per_h_u" in row
    serials = [item["serial"] for item in technician.get("/gyros.json").json()]
    assert serials == ["0417", "0431", "D-031"]
    assert technician.get("/gyros.xml").status_code == 404


def test_a_gyro_is_registered(technician: TestClient, lab: Lab) -> None:
    answer = technician.post("/gyros/new", data={"serial": " 0440 ", "type": "GVK-16", "note": "new"})
    assert (answer.status_code, answer.headers["location"]) == (303, "/gyros/0440")
    with lab.read(access.SYSTEM) as work:
        assert gyros.gyro(work, "0440").type == "GVK-16"


@pytest.mark.parametrize(
    ("sent", "status", "field", "sentence"),
    [
        ({"serial": "", "type": "GVK-6"}, 422, "serial", "This must not be empty."),
        ({"serial": "a/b", "type": "GVK-6"}, 422, "serial", "has a character that a name cannot have"),
        ({"serial": "0417", "type": "GVK-6"}, 409, "serial", "There is a gyro 0417 already."),
        ({"serial": "9" * 61, "type": "GVK-6"}, 422, "serial", "Keep it to 60 characters."),
    ],
)
def test_a_form_comes_back_with_its_problem(
    technician: TestClient, stocked: Lab, sent: dict[str, str], status: int, field: str, sentence: str
) -> None:
    answer = technician.post("/gyros/new", data={**sent, "note": "kept <b>"})
    assert answer.status_code == status
    assert sentence in answer.text
    assert f'aria-describedby="f-{field}-problem" autofocus' in answer.text
    assert "kept &lt;b&gt;" in answer.text


def test_type_and_note_are_corrected(technician: TestClient, stocked: Lab) -> None:
    assert "first of the series" in technician.get("/gyros/0417/edit").text
    answer = technician.post("/gyros/0417/edit", data={"type": "GVK-16", "note": "rewound"})
    assert answer.headers["location"] == "/gyros/0417"
    with stocked.read(access.SYSTEM) as work:
        changed = gyros.gyro(work, "0417")
    assert (changed.type, changed.note) == ("GVK-16", "rewound")


def test_a_correction_that_cannot_be_used_changes_nothing(technician: TestClient, stocked: Lab) -> None:
    answer = technician.post("/gyros/0417/edit", data={"type": " ", "note": "lost?"})
    assert answer.status_code == 422
    assert "lost?" in answer.text
    assert technician.get("/gyros/0000/edit").status_code == 404


def test_a_gyro_is_made_a_check_gyro_and_back(technician: TestClient, stocked: Lab) -> None:
    assert 'name="check" value="1" aria' in technician.get("/gyros/0417/edit").text
    assert technician.post("/gyros/0417/edit", data={"type": "GVK-6", "check": "1"}).status_code == 303
    assert 'name="check" value="1" checked' in technician.get("/gyros/0417/edit").text
    assert technician.post("/gyros/0417/edit", data={"type": "GVK-6"}).status_code == 303
    with stocked.read(access.SYSTEM) as work:
        assert not gyros.gyro(work, "0417").check
