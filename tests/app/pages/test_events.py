from datetime import UTC, datetime, timedelta

from fastapi.testclient import TestClient

from app.services import access
from app.services.drift import events
from app.services.lab import Lab


def entered(lab: Lab) -> list[tuple[str, str, str | None]]:
    with lab.read(access.SYSTEM) as work:
        found = (*events.of_gyro(work, "0417", withdrawn=True), *events.of_stand(work, "S1", withdrawn=True))
    return [(item.kind, item.note, item.withdrawn_by) for item in found]


def test_an_event_of_a_gyro_is_entered_and_withdrawn(technician: TestClient, stocked: Lab) -> None:
    sent = {"kind": "repair", "happened_at": "2026-03-01", "note": "lead resoldered"}
    answer = technician.post("/gyros/0417/events/new", data=sent)
    assert (answer.status_code, answer.headers["location"]) == (303, "/gyros/0417")
    with stocked.read(access.SYSTEM) as work:
        event = events.of_gyro(work, "0417")[0]
    # its day's sessions come after it
    assert (event.kind, event.note, event.at) == (
        "repair",
        "lead resoldered",
        datetime(2026, 3, 1, tzinfo=UTC),
    )
    assert technician.post(f"/events/{event.id}/withdrawal", data={"next": "/gyros/0417"}).status_code == 303
    assert entered(stocked) == [("repair", "lead resoldered", "irina")]
    assert technician.post(f"/events/{event.id}/withdrawal").status_code == 409


def test_an_event_of_a_stand(technician: TestClient, stocked: Lab) -> None:
    assert "What happened to stand S1" in technician.get("/stands/S1/events/new").text
    answer = technician.post("/stands/S1/events/new", data={"kind": "moved", "happened_at": "01.03.2026"})
    assert (answer.status_code, answer.headers["location"]) == (303, "/stands/S1/drift")
    assert entered(stocked) == [("moved", "", None)]


def test_a_day_to_come_comes_back_with_what_was_typed(technician: TestClient, stocked: Lab) -> None:
    tomorrow = f"{datetime.now(UTC) + timedelta(days=2):%Y-%m-%d}"
    answer = technician.post(
        "/gyros/0417/events/new", data={"kind": "adjustment", "happened_at": tomorrow, "note": "shim"}
    )
    assert answer.status_code == 422
    assert "An event is entered after it happened." in answer.text
    assert "shim" in answer.text
    assert f'value="{tomorrow}"' in answer.text
    assert entered(stocked) == []


def test_no_day_and_no_such_gyro(technician: TestClient, stocked: Lab) -> None:
    answer = technician.post("/gyros/0417/events/new", data={"kind": "repair", "happened_at": ""})
    assert answer.status_code == 422
    assert "is not a date" in answer.text
    assert technician.get("/gyros/9999/events/new").status_code == 404
    sent = {"kind": "repair", "happened_at": "2026-03-01"}
    assert technician.post("/gyros/9999/events/new", data=sent).status_code == 404


def test_whoever_only_reads_enters_nothing(designer: TestClient, stocked: Lab) -> None:
    sent = {"kind": "repair", "happened_at": "2026-03-01"}
    assert designer.get("/gyros/0417/events/new").status_code == 403
    assert designer.post("/gyros/0417/events/new", data=sent).status_code == 403
    assert entered(stocked) == []
