import re

from fastapi.testclient import TestClient

from app.services import access, gyros
from app.services.lab import Lab


def _limits(lab: Lab) -> dict[str, tuple[float, float]]:
    with lab.read(access.SYSTEM) as work:
        return dict(gyros.types(work)[0].limits)


def test_limits_stand_in_the_form(technician: TestClient, stocked: Lab) -> None:
    page = technician.get("/types/GVK-6").text
    assert re.search(r'name="low_w0y_deg_per_h" value="−0.8"', page)
    assert re.search(r'name="high_kx_deg_per_h_per_ma" value=""', page)


def test_whoever_may_only_read_sees_fields_that_cannot_be_typed_into(
    designer: TestClient, stocked: Lab
) -> None:
    page = designer.get("/types/GVK-6").text
    assert "readonly" in page
    assert "Set these limits" not in page


def test_limits_are_set_with_point_or_comma(technician: TestClient, stocked: Lab) -> None:
    sent = {"low_w0x_deg_per_h": "−1,5", "high_w0x_deg_per_h": "1.5"}
    assert technician.post("/types/GVK-6", data=sent).status_code == 303
    assert _limits(stocked) == {"w0x": (-1.5, 1.5)}


def test_each_problem_stands_at_its_field(technician: TestClient, stocked: Lab) -> None:
    before = _limits(stocked)
    sent = {"low_w0x_deg_per_h": "2", "low_wg_deg_per_h_per_g": "x", "high_wg_deg_per_h_per_g": "1"}
    answer = technician.post("/types/GVK-6", data=sent)
    assert answer.status_code == 422
    assert "Give both limits, or none." in answer.text
    assert "“x” is not a number." in answer.text
    assert 'id="f-high_w0x_deg_per_h-problem"' in answer.text
    assert 'id="f-low_wg_deg_per_h_per_g-problem"' in answer.text
    turned = technician.post(
        "/types/GVK-6", data={"low_wk_deg_per_h_per_g": "2", "high_wk_deg_per_h_per_g": "1"}
    )
    assert turned.status_code == 422
    assert 'id="f-low_wk_deg_per_h_per_g-problem"' in turned.text
    assert _limits(stocked) == before


def test_an_unknown_type_is_not_there(technician: TestClient, stocked: Lab) -> None:
    assert technician.get("/types/none").status_code == 404
