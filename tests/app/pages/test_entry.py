import re

import pytest
from fastapi.testclient import TestClient

from app.services import access, sessions
from app.services.lab import Lab
from app.services.views import MeasurementView

HTMX = {"hx-request": "true"}
FIRST = "rows/0/0/0"


def saved(lab: Lab, number: int) -> dict[tuple[float, float], MeasurementView]:
    with lab.read(access.SYSTEM) as work:
        positions = sessions.detail(work, number).positions
    return {(item.theta_deg, item.psi_deg): item.measurement for item in positions if item.measurement}


def test_the_grid_has_a_row_for_each_position(technician: TestClient, opened: int) -> None:
    page = technician.get(f"/sessions/{opened}/entry").text
    assert len(re.findall(r'<tr id="position-\d+"', page)) == 16
    assert page.count('name="jx_ua"') == 16
    assert "<b>0 of 16</b> rows saved" in page
    assert "nothing is saved yet" in page
    assert 'aria-disabled="true" aria-describedby="why"' in page


def test_a_row_is_saved_without_script(technician: TestClient, stocked: Lab, opened: int) -> None:
    form = {"jx_ua": "−0,3297", "jy_ua": "4.6480", "duration_s": "60", "note": "fan off"}
    answer = technician.post(f"/sessions/{opened}/{FIRST}", data=form)
    assert answer.status_code == 303
    assert answer.headers["location"] == f"/sessions/{opened}/entry?unit=ua#position-1"
    row = saved(stocked, opened)[0, 0]
    assert (row.jx_ma, row.jy_ma, row.duration_s, row.note) == (-0.0003297, 0.004648, 60.0, "fan off")
    assert (row.origin, row.created_by, row.revision) == ("typed", "irina", 1)
    page = technician.get(f"/sessions/{opened}/entry").text
    assert 'value="−0.3297"' in page
    assert 'value="4.6480"' not in page  # one row alone: no longer number asks for the zero
    assert "<b>1 of 16</b> rows saved" in page


@pytest.mark.parametrize("text", ["4.536", "4,536", "+4.536", "4536e-3", " 4.5360 "])
def test_the_same_decimal_gives_the_same_bits_in_every_unit(
    technician: TestClient, stocked: Lab, opened: int, text: str
) -> None:
    technician.post(f"/sessions/{opened}/{FIRST}", data={"jx_ua": text, "jy_ua": "0.1"})
    assert saved(stocked, opened)[0, 0].jx_ma == 0.004536
    technician.post(f"/sessions/{opened}/{FIRST}?unit=ma", data={"jx_ma": "0.004536", "jy_ma": "0.0001"})
    assert saved(stocked, opened)[0, 0].revision == 1  # the very same: nothing new to keep


def test_htmx_gets_the_row_and_the_lines_of_state(technician: TestClient, opened: int) -> None:
    answer = technician.post(f"/sessions/{opened}/{FIRST}", data={"jx_ua": "1", "jy_ua": "2"}, headers=HTMX)
    assert answer.status_code == 200
    assert answer.text.lstrip().startswith('<tr id="position-1"')
    assert "<html" not in answer.text
    assert re.search(r"saved \d\d:\d\d", answer.text)
    for part in ("entry-status", "entry-solve", "why"):
        assert re.search(rf'id="{part}"[^>]* hx-swap-oob="true"', answer.text)


@pytest.mark.parametrize("headers", [{}, HTMX], ids=["plain", "htmx"])
def test_what_cannot_be_read_stays_as_it_was_typed(
    technician: TestClient, stocked: Lab, opened: int, headers: dict[str, str]
) -> None:
    form = {"jx_ua": "1.5", "jy_ua": "4,64O", "duration_s": "-60", "note": "by hand"}
    answer = technician.post(f"/sessions/{opened}/{FIRST}", data=form, headers=headers)
    assert answer.status_code == 422
    for value in ("1.5", "4,64O", "-60", "by hand"):
        assert f'value="{value}"' in answer.text
    assert "“4,64O” is not a number" in answer.text
    assert "This must be greater than zero." in answer.text
    assert answer.text.count('aria-invalid="true"') == 2
    assert not saved(stocked, opened)


def test_half_a_row_is_not_saved(technician: TestClient, stocked: Lab, opened: int) -> None:
    answer = technician.post(f"/sessions/{opened}/{FIRST}", data={"jx_ua": "1.5", "jy_ua": ""})
    assert answer.status_code == 422
    assert 'value="1.5"' in answer.text
    assert not saved(stocked, opened)


def test_a_position_of_no_certificate_is_refused(technician: TestClient, opened: int) -> None:
    answer = technician.post(f"/sessions/{opened}/rows/45/0/0", data={"jx_ua": "1", "jy_ua": "2"})
    assert answer.status_code == 422
    assert "Certificate C-17 has no position θ 45°, ψ 0°" in answer.text


def test_all_columns(technician: TestClient, stocked: Lab, opened: int) -> None:
    address = f"/sessions/{opened}/{FIRST}?unit=ma&columns=all"
    form = {"jx_ma": "0.001", "jy_ma": "0.002", "u_jx_ma": "1e-6", "u_jy_ma": "2e-6", "duration_s": "60",
            "rate_hz": "200", "note": ""}  # fmt: skip
    assert technician.post(address, data=form).status_code == 303
    row = saved(stocked, opened)[0, 0]
    assert (row.u_jx_ma, row.u_jy_ma, row.rate_hz) == (1e-6, 2e-6, 200.0)
    page = technician.get(f"/sessions/{opened}/entry?unit=ma&columns=all").text
    assert 'value="0.000001"' in page


def test_columns_that_are_not_shown_keep_what_they_had(
    technician: TestClient, stocked: Lab, measured: int
) -> None:
    technician.post(f"/sessions/{measured}/{FIRST}", data={"jx_ua": "1", "jy_ua": "2", "duration_s": "90"})
    row = saved(stocked, measured)[0, 0]
    assert (row.u_jx_ma, row.rate_hz, row.duration_s, row.revision) == (1e-6, 200.0, 90.0, 2)


def test_a_pasted_row_says_so(technician: TestClient, stocked: Lab, opened: int) -> None:
    technician.post(f"/sessions/{opened}/{FIRST}", data={"jx_ua": "1", "jy_ua": "2", "origin": "pasted"})
    assert saved(stocked, opened)[0, 0].origin == "pasted"


def test_a_withdrawn_row_is_empty_again_and_kept(technician: TestClient, stocked: Lab, measured: int) -> None:
    answer = technician.post(f"/sessions/{measured}/{FIRST}/withdraw", data={"note": "slipped"}, headers=HTMX)
    assert answer.status_code == 200
    assert "withdrawn" in answer.text
    assert 'name="jx_ua" value=""' in answer.text
    row = saved(stocked, measured)[0, 0]
    assert (row.withdrawn, row.revision, row.note) == (True, 2, "slipped")
    assert "2 earlier revisions" in technician.get(f"/sessions/{measured}").text


def test_a_current_far_from_the_session_before_is_marked(
    technician: TestClient, stocked: Lab, measured: int
) -> None:
    with stocked.write(access.SYSTEM) as work:
        again = sessions.open_session(work, sessions.NewSession("0417", "S1")).id
    known = saved(stocked, measured)[0, 0]
    near = {"jx_ma": str((known.jx_ma or 0) + 1e-6), "jy_ma": str(known.jy_ma)}
    kept = technician.post(f"/sessions/{again}/{FIRST}?unit=ma", data=near, headers=HTMX).text
    assert f"off session {measured}" not in kept
    far = near | {"jy_ma": str((known.jy_ma or 0) - 0.8e-3)}
    marked = technician.post(f"/sessions/{again}/{FIRST}?unit=ma", data=far, headers=HTMX).text
    assert f"−0.00080 mA off session {measured}" in marked
    assert "row-attention" in marked
    explained = technician.post(
        f"/sessions/{again}/{FIRST}?unit=ma", data=far | {"note": "seen"}, headers=HTMX
    )
    assert f"off session {measured}" not in explained.text


def test_whoever_only_reads_saves_and_withdraws_nothing(
    designer: TestClient, stocked: Lab, measured: int
) -> None:
    before = saved(stocked, measured)
    assert (
        designer.post(f"/sessions/{measured}/{FIRST}", data={"jx_ua": "1", "jy_ua": "2"}).status_code == 403
    )
    assert designer.post(f"/sessions/{measured}/{FIRST}/withdraw").status_code == 403
    assert saved(stocked, measured) == before


def test_nobody_saves_without_signing_in(anonymous: TestClient, stocked: Lab, opened: int) -> None:
    answer = anonymous.post(f"/sessions/{opened}/{FIRST}", data={"jx_ua": "1", "jy_ua": "2"})
    assert answer.status_code == 303
    assert not saved(stocked, opened)


def test_in_russian_with_decimal_commas(technician: TestClient, measured: int) -> None:
    technician.cookies.set("lang", "ru")
    page = technician.get(f"/sessions/{measured}/entry").text
    assert "Токи гироскопа 0417 на стенде S1" in page
    assert re.search(r'name="jx_ua" value="−?\d+,\d+"', page)
    answer = technician.post(
        f"/sessions/{measured}/{FIRST}", data={"jx_ua": "abc", "jy_ua": "1"}, headers=HTMX
    )
    assert "не число" in answer.text
