import re

import pytest
from fastapi.testclient import TestClient

from app.services import access, gyros
from app.services.lab import Lab
from app.services.views import Nominal, TypeView


def _limits(lab: Lab) -> dict[str, tuple[float, float]]:
    with lab.read(access.SYSTEM) as work:
        return dict(gyros.types(work)[0].limits)


def test_limits_stand_in_the_form(metrologist: TestClient, stocked: Lab) -> None:
    page = metrologist.get("/types/GVK-6").text
    assert re.search(r'name="low_w0y_deg_per_h" value="−0.8"', page)
    assert re.search(r'name="high_kx_deg_per_h_per_ma" value=""', page)


def test_whoever_may_only_read_sees_fields_that_cannot_be_typed_into(
    designer: TestClient, stocked: Lab
) -> None:
    page = designer.get("/types/GVK-6").text
    assert "readonly" in page
    assert "Set limits and nominal values" not in page


def test_limits_are_set_with_point_or_comma(metrologist: TestClient, stocked: Lab) -> None:
    sent = {"low_w0x_deg_per_h": "−1,5", "high_w0x_deg_per_h": "1.5"}
    assert metrologist.post("/types/GVK-6", data=sent).status_code == 303
    assert _limits(stocked) == {"w0x": (-1.5, 1.5)}


def test_each_problem_stands_at_its_field(metrologist: TestClient, stocked: Lab) -> None:
    before = _limits(stocked)
    sent = {"low_w0x_deg_per_h": "2", "low_wg_deg_per_h_per_g": "x", "high_wg_deg_per_h_per_g": "1"}
    answer = metrologist.post("/types/GVK-6", data=sent)
    assert answer.status_code == 422
    assert "Give both limits, or none." in answer.text
    assert "“x” is not a number." in answer.text
    assert 'id="f-high_w0x_deg_per_h-problem"' in answer.text
    assert 'id="f-low_wg_deg_per_h_per_g-problem"' in answer.text
    turned = metrologist.post(
        "/types/GVK-6", data={"low_wk_deg_per_h_per_g": "2", "high_wk_deg_per_h_per_g": "1"}
    )
    assert turned.status_code == 422
    assert 'id="f-low_wk_deg_per_h_per_g-problem"' in turned.text
    assert _limits(stocked) == before


def _nominals(lab: Lab) -> dict[str, Nominal]:
    with lab.read(access.SYSTEM) as work:
        return dict(gyros.types(work)[0].nominals)


KX = "kx_deg_per_h_per_ma"
NOMINAL = {f"nominal_{KX}": "2063,5", f"u_{KX}": "21", f"temperature_{KX}_per_k": "−0,4"}


def test_limits_and_nominal_values_are_set_together(metrologist: TestClient, stocked: Lab) -> None:
    sent = {**NOMINAL, "low_w0x_deg_per_h": "-1", "high_w0x_deg_per_h": "1", "nominal_w0x_deg_per_h": "0",
            "u_w0x_deg_per_h": "1.5"}  # fmt: skip
    assert metrologist.post("/types/GVK-6", data=sent).status_code == 303
    assert _limits(stocked) == {"w0x": (-1.0, 1.0)}
    assert _nominals(stocked) == {"kx": Nominal(2063.5, 21.0, -0.4), "w0x": Nominal(0.0, 1.5, None)}
    page = metrologist.get("/types/GVK-6").text
    fields = dict(re.findall(r'name="(\w+)" value="([^"]*)"', page))
    assert fields[f"nominal_{KX}"] == "2063.5"
    assert fields[f"temperature_{KX}_per_k"] == "−0.4"
    assert metrologist.post("/types/GVK-6", data=fields).status_code == 303
    assert _nominals(stocked) == {"kx": Nominal(2063.5, 21.0, -0.4), "w0x": Nominal(0.0, 1.5, None)}
    assert metrologist.post("/types/GVK-6", data={}).status_code == 303
    assert (_limits(stocked), _nominals(stocked)) == ({}, {})


@pytest.mark.parametrize(
    ("change", "field", "sentence"),
    [
        ({f"u_{KX}": ""}, f"u_{KX}", "Give the nominal value and its standard deviation"),
        ({f"nominal_{KX}": ""}, f"nominal_{KX}", "Give the nominal value and its standard deviation"),
        ({f"u_{KX}": "0"}, f"u_{KX}", "must be greater than zero"),
        ({f"u_{KX}": "−1"}, f"u_{KX}", "must be greater than zero"),
        ({f"temperature_{KX}_per_k": "warm"}, f"temperature_{KX}_per_k", "is not a number"),
    ],
)
def test_a_nominal_value_that_cannot_be(
    metrologist: TestClient, stocked: Lab, change: dict[str, str], field: str, sentence: str
) -> None:
    before = _limits(stocked)
    limits = {"low_w0x_deg_per_h": "-1", "high_w0x_deg_per_h": "1"}
    answer = metrologist.post("/types/GVK-6", data={**limits, **NOMINAL, **change})
    assert answer.status_code == 422
    said = re.search(rf'id="f-{field}-problem">(.+?)</p>', answer.text)
    assert said is not None
    assert sentence in said[1]
    assert 'name="low_w0x_deg_per_h" value="-1"' in answer.text
    assert (_limits(stocked), _nominals(stocked)) == (before, {})  # neither is kept


def test_what_is_wrong_with_both_tables_is_said_at_once(metrologist: TestClient, stocked: Lab) -> None:
    turned = {"low_wk_deg_per_h_per_g": "2", "high_wk_deg_per_h_per_g": "1"}
    answer = metrologist.post("/types/GVK-6", data={**turned, **NOMINAL, f"u_{KX}": "0"})
    assert answer.status_code == 422
    assert 'id="f-low_wk_deg_per_h_per_g-problem"' in answer.text
    assert f'id="f-u_{KX}-problem"' in answer.text


def test_an_unknown_type_is_not_there(metrologist: TestClient, stocked: Lab) -> None:
    assert metrologist.get("/types/none").status_code == 404


def _type(lab: Lab) -> TypeView:
    with lab.read(access.SYSTEM) as work:
        return gyros.types(work)[0]


LIMITS = {"low_w0x_deg_per_h": "-1", "high_w0x_deg_per_h": "1"}


def test_repeatability_and_interval_are_set_with_the_limits(metrologist: TestClient, stocked: Lab) -> None:
    sent = {**LIMITS, "repeatability_w0x_deg_per_h": "0,05", "interval_days": "365"}
    assert metrologist.post("/types/GVK-6", data=sent).status_code == 303
    assert (_type(stocked).repeatability, _type(stocked).interval_days) == ({"w0x": 0.05}, 365)
    fields = dict(re.findall(r'name="(\w+)" value="([^"]*)"', metrologist.get("/types/GVK-6").text))
    assert fields["repeatability_w0x_deg_per_h"] == "0.05"
    assert metrologist.post("/types/GVK-6", data=fields).status_code == 303  # what stands there is kept
    assert (_type(stocked).repeatability, _type(stocked).interval_days) == ({"w0x": 0.05}, 365)
    assert metrologist.post("/types/GVK-6", data=LIMITS).status_code == 303
    assert (_type(stocked).repeatability, _type(stocked).interval_days) == ({}, None)


@pytest.mark.parametrize(
    ("change", "field", "sentence"),
    [
        ({"repeatability_w0x_deg_per_h": "0"}, "repeatability_w0x_deg_per_h", "must be greater than"),
        ({"repeatability_wg_deg_per_h_per_g": "1"}, "repeatability_wg_deg_per_h_per_g", "Give the limits"),
        ({"interval_days": "0"}, "interval_days", "An interval has 1 to 3660 days."),
        ({"interval_days": "a year"}, "interval_days", "is not a whole number"),
    ],
)
def test_a_repeatability_or_an_interval_that_cannot_be(
    metrologist: TestClient, stocked: Lab, change: dict[str, str], field: str, sentence: str
) -> None:
    before = _type(stocked)
    answer = metrologist.post("/types/GVK-6", data=LIMITS | change)
    assert answer.status_code == 422
    said = re.search(rf'id="f-{field}-problem">(.+?)</p>', answer.text)
    assert said is not None
    assert sentence in said[1]
    assert _type(stocked) == before


def test_limits_alone_keep_the_repeatability(stocked: Lab) -> None:
    with stocked.write(access.SYSTEM) as work:
        gyros.set_limits(work, "GVK-6", {"w0x": (-1.0, 1.0), "wg": (-9.0, 9.0)}, repeatability={"w0x": 0.1})
        gyros.set_limits(work, "GVK-6", {"w0x": (-2.0, 2.0)})
    assert _type(stocked).repeatability == {"w0x": 0.1}


def test_limits_are_for_those_who_judge(technician: TestClient, stocked: Lab) -> None:
    page = technician.get("/types/GVK-6").text
    assert "Set limits and nominal values" not in page
    assert "readonly" in page
    assert technician.post("/types/GVK-6", data={"interval_days": "30"}).status_code == 403
