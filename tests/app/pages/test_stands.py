import pytest
from fastapi.testclient import TestClient

from app.services import access, stands
from app.services.lab import Lab


def test_no_stands_yet(technician: TestClient) -> None:
    assert "No stands yet" in technician.get("/stands").text


def test_a_stand_with_its_certificate(technician: TestClient, stocked: Lab) -> None:
    page = technician.get("/stands").text
    assert "55.7558" in page
    assert 'href="/certificates/S1/C-17"' in page
    detail = technician.get("/stands/S1").text
    assert "version 1" in detail
    assert "No sessions on this stand yet" in detail
    assert technician.get("/stands/S9").status_code == 404


def test_a_stand_without_a_valid_certificate_says_so(technician: TestClient, lab: Lab) -> None:
    with lab.write(access.SYSTEM) as work:
        stands.add_stand(work, "S2", -33.9)
    page = technician.get("/stands").text
    assert "No valid certificate" in page
    assert "−33.9" in page
    assert "No certificate is valid today" in technician.get("/stands/S2").text


def test_a_stand_is_registered_with_a_decimal_comma(technician: TestClient, lab: Lab) -> None:
    sent = {"name": "S3", "latitude_deg": "−33,9", "note": "pier 2"}
    assert technician.post("/stands/new", data=sent).headers["location"] == "/stands/S3"
    with lab.read(access.SYSTEM) as work:
        assert stands.stand(work, "S3").latitude_deg == -33.9


@pytest.mark.parametrize(
    ("sent", "status", "sentence"),
    [
        ({"name": "S4", "latitude_deg": "91"}, 422, "The latitude must lie between"),
        ({"name": "S4", "latitude_deg": "north"}, 422, "“north” is not a number."),
        ({"name": "S4", "latitude_deg": ""}, 422, "There is no number here."),
        ({"name": "", "latitude_deg": "5"}, 422, "This must not be empty."),
        ({"name": "S1", "latitude_deg": "5"}, 409, "There is a stand S1 already."),
    ],
)
def test_a_stand_that_cannot_be_registered(
    technician: TestClient, stocked: Lab, sent: dict[str, str], status: int, sentence: str
) -> None:
    answer = technician.post("/stands/new", data={**sent, "note": "kept"})
    assert answer.status_code == status
    assert sentence in answer.text
    assert "kept" in answer.text
    assert 'class="notice bad"' not in answer.text  # it stands at its field
