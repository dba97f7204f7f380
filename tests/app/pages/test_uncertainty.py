import re
from typing import Any

import pytest
from fastapi.testclient import TestClient

from app.exchange.uncertainties import UNCERTAINTY_KEYS
from app.pages import uncertainty_fields
from app.services import access, stands
from app.services.lab import Lab
from solver.inputs import COMMON

PAGE = "/stands/S1/uncertainty"
HIDDEN = {
    "u_alpha_common_arcsec": 0.4,
    "temperature_coefficients": {"kx": -0.4},
}
FURTHER = {"between": ["level_1", "azimuth"], "coefficient": -0.2}


def _stated(lab: Lab) -> dict[str, Any]:
    with lab.read(access.SYSTEM) as work:
        return dict(stands.stand(work, "S1").uncertainty)


def _state(lab: Lab, statement: dict[str, Any]) -> None:
    with lab.write(access.SYSTEM) as work:
        stands.state_uncertainty(work, "S1", statement)


def _form(page: str) -> dict[str, str]:
    """The fields as they stand, to be sent again."""
    return dict(re.findall(r'<input class="in num" id="f-\w+" name="(\w+)" value="([^"]*)"', page))


def test_every_input_has_a_name_and_all_but_the_angles_a_field() -> None:
    assert len({uncertainty_fields.name_of(name) for name in COMMON}) == len(COMMON)
    assert {row.key for row in uncertainty_fields.ROWS} == {
        key for key in UNCERTAINTY_KEYS if not key.endswith("_common_arcsec")
    }


def test_nothing_stated_counts_as_exact(technician: TestClient, stocked: Lab) -> None:
    page = technician.get("/stands/S1").text
    assert "are taken as exact" in page
    assert f'href="{PAGE}">State their uncertainty' in page
    assert set(_form(technician.get(PAGE).text).values()) == {""}


def test_what_is_typed_is_stated_and_shown(technician: TestClient, stocked: Lab) -> None:
    sent = {
        "u_gain_x_ppm": "50", "u_gain_y_ppm": "50,5", "correlation_gain_x_gain_y": "0,9", "u_offset_x_na": "2",
        "u_level_1_arcsec": "2", "u_azimuth_arcsec": "10", "dof_azimuth": "8", "u_temperature_k": "0.5",
    }  # fmt: skip
    answer = technician.post(PAGE, data=sent)
    assert (answer.status_code, answer.headers["location"]) == (303, "/stands/S1")
    assert _stated(stocked) == {
        "u_gain_x_ppm": 50, "u_gain_y_ppm": 50.5, "u_offset_x_ma": 2e-6, "u_level_1_arcsec": 2,
        "u_azimuth_arcsec": 10, "u_temperature_k": 0.5,
        "correlations": [{"between": ["gain_x", "gain_y"], "coefficient": 0.9}], "dof": {"azimuth": 8},
    }  # fmt: skip
    shown = re.sub(r"<[^>]+>|\s+", " ", technician.get("/stands/S1").text)
    shown = re.sub(r" +", " ", shown)
    for text in (
        "Gain, channel y 50.5 ppm",
        "Offset, channel x 2 nA",
        "Azimuth 10″, ν = 8",
        "both gains 0.9",
    ):
        assert text in shown
    assert "taken as exact" not in shown
    again = technician.get(PAGE, headers={"accept-language": "ru"}).text
    assert 'name="u_gain_y_ppm" value="50,5"' in again
    assert 'name="u_offset_x_na" value="2"' in again


def test_a_saved_form_states_the_same_bits(technician: TestClient, stocked: Lab) -> None:
    statement = {
        "u_gain_x_ppm": 1 / 3, "u_gain_y_ppm": 2 / 7, "u_offset_x_ma": 1.1e-6, "u_offset_y_ma": 0.3,
        "u_level_1_arcsec": 0.1 + 0.2, "u_azimuth_arcsec": 1e-7, "u_gravity_ppm": 0.0,
        "correlations": [{"between": ["gain_x", "gain_y"], "coefficient": 1 / 3}, FURTHER],
        "dof": {"azimuth": 8.5, "alpha": 4}, **HIDDEN,
    }  # fmt: skip
    _state(stocked, statement)
    page = technician.get(PAGE).text
    assert 'name="u_offset_y_na" value="0.3 mA"' in page
    assert technician.post(PAGE, data=_form(page)).status_code == 303
    assert _stated(stocked) == statement


def test_an_emptied_form_leaves_what_it_does_not_show(technician: TestClient, stocked: Lab) -> None:
    _state(
        stocked, {**HIDDEN, "u_gain_x_ppm": 5, "correlations": [FURTHER], "dof": {"alpha": 4, "gain_x": 3}}
    )
    page = technician.get(PAGE).text
    assert "Stated beside these" in page
    assert "Scale factor, x, per kelvin" in page
    assert "Correlation: Level about east – Azimuth" in page
    assert technician.post(PAGE, data={}).status_code == 303
    assert _stated(stocked) == {**HIDDEN, "correlations": [FURTHER], "dof": {"alpha": 4}}


@pytest.mark.parametrize(
    ("text", "stated"),
    [
        ("2", 2e-6),
        ("2 nA", 2e-6),
        ("0,002 µA", 2e-6),
        ("2e-6mA", 2e-6),
        ("2 нА", 2e-6),
        ("0.5 мА", 0.5),
        ("0", 0.0),
    ],
)
def test_an_offset_with_its_unit(technician: TestClient, stocked: Lab, text: str, stated: float) -> None:
    assert technician.post(PAGE, data={"u_offset_y_na": text}).status_code == 303
    assert _stated(stocked) == {"u_offset_y_ma": stated}


@pytest.mark.parametrize(
    ("sent", "field", "sentence"),
    [
        ({"u_gain_x_ppm": "-5"}, "u_gain_x_ppm", "is not negative"),
        ({"u_gain_x_ppm": "fifty"}, "u_gain_x_ppm", "is not a number"),
        ({"u_gravity_ppm": "1e10"}, "u_gravity_ppm", "must be a number from 0 to"),
        ({"u_offset_x_na": "−2 nA"}, "u_offset_x_na", "is not negative"),
        ({"u_offset_x_na": "2 V"}, "u_offset_x_na", "is not a number"),
        ({"u_azimuth_arcsec": "5", "dof_azimuth": "0"}, "dof_azimuth", "are greater than 0"),
        ({"u_azimuth_arcsec": "5", "dof_azimuth": "1e-9"}, "dof_azimuth", "must be a number from 0.001"),
        ({"dof_azimuth": "8"}, "u_azimuth_arcsec", "Give the standard uncertainty"),
        (
            {"u_gain_x_ppm": "5", "u_gain_y_ppm": "5", "correlation_gain_x_gain_y": "1.1"},
            "correlation_gain_x_gain_y",
            "between −1 and 1",
        ),
        (
            {"u_gain_x_ppm": "5", "correlation_gain_x_gain_y": "0.9"},
            "correlation_gain_x_gain_y",
            "needs the uncertainty of both gains",
        ),
    ],
)
def test_what_is_wrong_stands_at_its_field(
    technician: TestClient, stocked: Lab, sent: dict[str, str], field: str, sentence: str
) -> None:
    _state(stocked, HIDDEN)
    answer = technician.post(PAGE, data=sent | {"u_latitude_arcsec": "1,25"})
    assert answer.status_code == 422
    said = re.search(rf'id="f-{field}-problem">([^<]+)', answer.text)
    assert said is not None
    assert sentence in said[1]
    assert 'name="u_latitude_arcsec" value="1,25"' in answer.text  # what was typed is kept
    assert len(re.findall("autofocus", answer.text)) == 1
    assert 'class="notice bad"' not in answer.text
    assert _stated(stocked) == HIDDEN


def test_correlations_that_contradict_one_another_are_said(technician: TestClient, stocked: Lab) -> None:
    # Gain x with azimuth, gain y against it: the gains cannot go together.
    others = [
        {"between": ["gain_x", "azimuth"], "coefficient": 0.7},
        {"between": ["gain_y", "azimuth"], "coefficient": -0.7},
    ]
    _state(stocked, {"correlations": others})
    sent = {"u_gain_x_ppm": "5", "u_gain_y_ppm": "5", "correlation_gain_x_gain_y": "0.9"}
    answer = technician.post(PAGE, data=sent)
    assert answer.status_code == 422
    assert "contradict one another" in answer.text
    assert 'class="notice bad"' in answer.text  # it belongs to no single field
    assert _stated(stocked) == {"correlations": others}


def test_whoever_may_only_read_sees_it_and_changes_nothing(designer: TestClient, stocked: Lab) -> None:
    _state(stocked, {"u_gain_x_ppm": 50})
    page = designer.get(PAGE).text
    assert 'name="u_gain_x_ppm" value="50"' in page
    main = page[page.index("<main") :]
    assert main.count("readonly") == main.count("<input")
    assert "<button" not in main
    assert "What each one means" in designer.get("/stands/S1").text
    assert designer.post(PAGE, data={"u_gain_x_ppm": "1"}).status_code == 403
    assert _stated(stocked) == {"u_gain_x_ppm": 50}


def test_an_unknown_stand_is_not_there(technician: TestClient, stocked: Lab) -> None:
    assert technician.get("/stands/S9/uncertainty").status_code == 404
    assert technician.post("/stands/S9/uncertainty", data={}).status_code == 404
