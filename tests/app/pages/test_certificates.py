import re
from datetime import UTC, datetime, timedelta

import pytest
from fastapi.testclient import TestClient

from app.exchange.certificate import read_certificate
from app.services import access, stands
from app.services.lab import Lab
from app.services.views import CommonAngles

HEAD = {
    "stand": "S1",
    "number": "C-18",
    "valid_from": "2026-01-01",
    "valid_until": "2099-01-01",
    "issued_by": "M",
}
GRID = [(theta, psi) for theta in (0, 90, 180, 270) for psi in (0, 90, 180, 270)]


def _grid(**changed: str) -> dict[str, str]:
    """All sixteen rows typed, with decimal comma and true minus in some."""
    sent = {}
    for row, (theta, psi) in enumerate(GRID):
        cells = {"theta_deg": str(theta), "psi_deg": str(psi), "alpha_arcsec": f"{row},5",
                 "beta_arcsec": f"−{row}.25", "gamma_arcsec": "3"}  # fmt: skip
        sent |= {f"{name}.{row}": text for name, text in cells.items()}
        sent |= {f"u_{name}_arcsec.{row}": "" for name in ("alpha", "beta", "gamma")}
    return {**HEAD, **sent, **changed}


def _kept(lab: Lab, number: str = "C-18") -> list[tuple[float, ...]]:
    with lab.read(access.SYSTEM) as work:
        rows = stands.certificate(work, "S1", number).positions
    return [(row.theta_deg, row.psi_deg, row.alpha_arcsec, row.beta_arcsec, row.gamma_arcsec) for row in rows]


EXPECTED = [(float(t), float(p), row + 0.5, -(row + 0.25), 3.0) for row, (t, p) in enumerate(GRID)]
TEXT = "\n".join("\t".join(str(cell).replace(".", ",") for cell in row) for row in EXPECTED)


def test_typed_pasted_and_brought_as_a_file_are_the_same(technician: TestClient, stocked: Lab) -> None:
    answer = technician.post("/certificates/new", data=_grid())
    assert (answer.status_code, answer.headers["location"]) == (303, "/certificates/S1/C-18")
    pasted = {**HEAD, "number": "C-19", "pasted": TEXT}
    assert technician.post("/certificates/new", data=pasted).status_code == 303
    csv = technician.get("/certificates/S1/C-19.csv").content
    brought = technician.post(
        "/certificates/new", data={**HEAD, "number": "C-20"}, files={"file": ("c.csv", csv, "text/csv")}
    )
    assert brought.status_code == 303
    assert _kept(stocked) == _kept(stocked, "C-19") == _kept(stocked, "C-20") == EXPECTED
    with stocked.read(access.SYSTEM) as work:
        digests = {stands.certificate(work, "S1", number).digest for number in ("C-18", "C-19", "C-20")}
    assert len(digests) == 1


def test_rows_left_empty_are_left_out(technician: TestClient, stocked: Lab) -> None:
    blank = {f"{name}_arcsec.{row}": "" for row in range(8, 16) for name in ("alpha", "beta", "gamma")}
    assert technician.post("/certificates/new", data=_grid(**blank)).status_code == 303
    assert _kept(stocked) == EXPECTED[:8]


def test_what_is_wrong_in_the_table_stands_in_its_row(technician: TestClient, stocked: Lab) -> None:
    sent = _grid(**{"beta_arcsec.3": "4.6O8", "gamma_arcsec.5": "", "number": ""})
    answer = technician.post("/certificates/new", data=sent)
    assert answer.status_code == 422
    assert 'id="p-3">β: “4.6O8” is not a number.' in answer.text
    assert 'id="p-5">γ: There is no number here.' in answer.text
    assert 'name="beta_arcsec.3" value="4.6O8"' in answer.text
    assert 'name="alpha_arcsec.15" value="15,5"' in answer.text
    assert 'class="notice bad"' not in answer.text


def test_a_position_twice_is_named_at_the_second(technician: TestClient, stocked: Lab) -> None:
    answer = technician.post("/certificates/new", data=_grid(**{"psi_deg.1": "360"}))
    assert answer.status_code == 422
    assert 'id="p-1">θ: The position θ 0°, ψ 0°' in answer.text


def test_what_is_wrong_in_the_text_is_named_by_its_line(technician: TestClient, stocked: Lab) -> None:
    broken = TEXT.replace("2,5", "n/a")
    answer = technician.post("/certificates/new", data={**HEAD, "pasted": broken})
    assert answer.status_code == 422
    assert "pasted rows, row 3, column alpha_arcsec: “n/a” is not a value." in answer.text
    assert "n/a\t" in answer.text  # kept


def test_problems_of_the_head_keep_the_rows(technician: TestClient, stocked: Lab) -> None:
    sent = {**HEAD, "number": "C-17", "valid_until": "2025-01-01", "pasted": TEXT}
    answer = technician.post("/certificates/new", data=sent)
    assert answer.status_code == 422
    assert "The certificate ends before it begins." in answer.text
    assert 'name="alpha_arcsec.15" value="15.5"' in answer.text
    again = technician.post("/certificates/new", data={**HEAD, "number": "C-17", "pasted": TEXT})
    assert again.status_code == 409
    assert "certificates never change" in again.text
    dated = technician.post("/certificates/new", data={**HEAD, "valid_from": "soon", "pasted": TEXT})
    assert "“soon” is not a date." in dated.text


def test_angles_in_an_odd_unit_are_asked_back_once(technician: TestClient, stocked: Lab) -> None:
    small = "\n".join(f"{theta}\t{psi}\t0,001\t0,002\t0,001" for theta, psi in GRID)
    answer = technician.post("/certificates/new", data={**HEAD, "pasted": small})
    assert answer.status_code == 422
    assert "If they are degrees or radians" in answer.text
    agreed = technician.post("/certificates/new", data={**HEAD, "pasted": small, "agreed": "yes"})
    assert agreed.status_code == 303


def test_what_the_angles_share_is_kept_and_shown(technician: TestClient, stocked: Lab) -> None:
    sent = _grid(u_alpha_common_arcsec="0,3", u_gamma_common_arcsec="0")
    assert technician.post("/certificates/new", data=sent).status_code == 303
    with stocked.read(access.SYSTEM) as work:
        assert stands.certificate(work, "S1", "C-18").common == CommonAngles(0.3, None, 0.0)
    page = re.sub(r"<[^>]+>", "", technician.get("/certificates/S1/C-18").text)
    assert "Common to every position: u(α) = 0.3″, u(γ) = 0″." in page
    assert "Common to every position" not in technician.get("/certificates/S1/C-17").text


@pytest.mark.parametrize(
    ("text", "sentence"), [("−0.3", "is not negative"), ("x", "is not a number"), ("1e10", "from 0 to")]
)
def test_what_the_angles_cannot_share(technician: TestClient, stocked: Lab, text: str, sentence: str) -> None:
    answer = technician.post("/certificates/new", data=_grid(u_beta_common_arcsec=text))
    assert answer.status_code == 422
    said = re.search(r'id="f-u_beta_common_arcsec-problem">([^<]+)', answer.text)
    assert said is not None
    assert sentence in said[1]
    assert 'name="u_beta_common_arcsec"' in answer.text
    assert 'name="alpha_arcsec.15" value="15,5"' in answer.text


@pytest.mark.parametrize("empty", [{}, {"theta_deg.0": "0", "psi_deg.0": "0"}])
def test_nothing_entered_is_said(technician: TestClient, stocked: Lab, empty: dict[str, str]) -> None:
    answer = technician.post("/certificates/new", data={**HEAD, **empty})
    assert answer.status_code == 422
    assert "No angle is entered." in answer.text


def test_a_certificate_shows_every_position(technician: TestClient, stocked: Lab) -> None:
    page = technician.get("/certificates/S1/C-17").text
    assert "16 positions" in page
    assert page.count("−16") == 16
    assert "Metrology" in page
    rows, _ = read_certificate(technician.get("/certificates/S1/C-17.csv").content, "c.csv")
    assert len(rows) == 16
    assert technician.get("/certificates/S1/none").status_code == 404


def test_the_list_tells_what_is_valid(technician: TestClient, stocked: Lab) -> None:
    today = datetime.now(UTC).date()
    soon = {**HEAD, "number": "soon", "valid_until": str(today + timedelta(days=20)), "pasted": TEXT}
    gone = {**HEAD, "number": "gone", "valid_until": "2026-01-02", "pasted": TEXT}
    later = {**HEAD, "number": "later", "valid_from": "2098-01-01", "pasted": TEXT}
    for sent in (soon, gone, later):
        assert technician.post("/certificates/new", data=sent).status_code == 303
    page = technician.get("/certificates").text
    assert "Expires in 20 days" in page
    assert "Expired" in page
    assert "Valid from 1 Jan 2098" in page


def test_without_a_stand_there_is_no_form(technician: TestClient, lab: Lab) -> None:
    assert "register the stand first" in technician.get("/certificates/new").text
    assert "register the stand first" in technician.get("/certificates").text
