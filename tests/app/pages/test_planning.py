"""The page that plans a session."""

import csv
import io
import re

import pytest
from fastapi.testclient import TestClient

from app.services import access, stands
from app.services.lab import Lab


def test_a_stand_leads_to_its_plan(technician: TestClient, stocked: Lab) -> None:
    assert 'href="/stands/S1/plan"' in technician.get("/stands/S1").text
    assert 'href="/stands/S1/plan?certificate=C-17"' in technician.get("/certificates/S1/C-17").text


def test_the_certificate_is_judged_at_once(designer: TestClient, stocked: Lab) -> None:
    page = designer.get("/stands/S1/plan?nominal=type%3AGVK-6").text
    assert "Every parameter is determined" in page
    assert "16 measurements, 90 s at each; rank 8" in page
    assert page.count('<span class="cell ok">') == 16
    assert "Noise of the means, 100" in page
    # Limits of ω0x are ±2 °/h, u is 0.001 °/h: U takes 0.1 % of half their width.
    assert "0.1 %" in page


def test_the_best_positions_are_proposed(technician: TestClient, stocked: Lab) -> None:
    page = technician.get("/stands/S1/plan?mode=propose&count=6&criterion=wg&grid_deg=").text
    assert "No other choice of 6 positions does better" in page
    assert page.count('<span class="cell ok">') == 6
    assert page.count('<span class="cell left">') == 10
    assert "every one of 8008 sets was tried" in page
    wide = technician.get("/stands/S1/plan?mode=propose&count=8&grid_deg=45").text
    assert "chosen from 64" in wide
    assert "must be certified before a session can use it" in wide


def test_numbers_of_positions_lead_to_their_proposals(technician: TestClient, stocked: Lab) -> None:
    page = technician.get("/stands/S1/plan?mode=propose&view=counts&time_min=30").text
    links = re.findall(r'<th scope="row" class="num"><a href="([^"]+)">(\d+)</a>', page)
    assert [int(count) for _, count in links] == list(range(4, 17))
    assert "below method" in page
    proposal = technician.get(links[1][0].replace("&amp;", "&")).text
    assert "5 measurements, 300 s at each" in proposal or "5 measurements, 5 min at each" in proposal


def test_the_trade_is_a_chart_with_its_table(technician: TestClient, stocked: Lab) -> None:
    page = technician.get("/stands/S1/plan?view=trade").text
    assert "data-chart=" in page
    rows = re.findall(r'<tr><th scope="row"><a href="([^"]+)">([^<]+)</a>', page)
    assert [kind for _, kind in rows][:3] == ["the paper’s eight", "all sixteen", "this plan"]
    assert [kind for _, kind in rows[3:]] == [f"No. {number}" for number in range(1, len(rows) - 2)]
    assert len(rows) > 8
    opened = technician.get(rows[0][0].replace("&amp;", "&")).text
    assert "8 measurements, 4 min" in opened or "8 measurements, 240 s" in opened


def test_what_stays_open_is_said_in_words(technician: TestClient, stocked: Lab) -> None:
    page = technician.get("/stands/S1/plan", params={"positions": "0/0 90/90 180/0"}).text
    assert "Not everything is determined" in page
    assert "No residual would show a joint change by" in page
    assert "not determined" in page


def test_nothing_is_proposed_at_a_pole(technician: TestClient, stocked: Lab) -> None:
    with stocked.write(access.SYSTEM) as work:
        stands.add_stand(work, "North", 90.0)
        old = stands.certificate(work, "S1", "C-17")
        stands.add_certificate(work, "North", "N-1", old.valid_from, old.valid_until, old.positions)
    page = technician.get("/stands/North/plan?mode=propose").text
    assert "Nothing to propose" in page
    assert "at a pole" in page
    assert "posmap" not in page
    assert "No eight positions determine both" in technician.get("/stands/North/plan?view=trade").text


@pytest.mark.parametrize(
    ("query", "status", "sentence"),
    [
        ({"positions": "0/0 here"}, 422, "“here” is no position"),
        ({"time_min": "1"}, 422, "there is no time to measure"),
        ({"time_min": "soon"}, 422, "“soon” is not a number."),
        ({"mode": "propose", "count": "x"}, 422, "“x” is not a whole number."),
        ({"mode": "propose", "count": "99"}, 422, "Ask for 4 to 64 positions."),
        ({"noise_deg_per_h": "0"}, 422, "not zero altogether"),
        ({"certificate": "C-99"}, 404, "has no certificate C-99"),
        ({"nominal": "gyro:9"}, 404, "There is no gyro 9."),
    ],
)
def test_what_cannot_be_planned_stands_at_its_field(
    technician: TestClient, stocked: Lab, query: dict[str, str], status: int, sentence: str
) -> None:
    answer = technician.get("/stands/S1/plan", params={"moving_s": "61", **query})
    assert answer.status_code == status
    assert sentence in answer.text
    assert 'value="61"' in answer.text  # what was typed is kept
    assert 'class="notice bad"' not in answer.text
    assert technician.get("/stands/S9/plan").status_code == 404


def test_a_decimal_comma_is_read(technician: TestClient, stocked: Lab) -> None:
    page = technician.get("/stands/S1/plan?noise_deg_per_h=0%2C01", headers={"accept-language": "ru"}).text
    assert 'value="0,01"' in page


def test_the_plan_is_a_file_one_click_away(technician: TestClient, stocked: Lab) -> None:
    page = technician.get("/stands/S1/plan?mode=propose&count=4").text
    assert "/stands/S1/plan.csv?mode=propose&amp;count=4" in page
    table = technician.get("/stands/S1/plan.csv?mode=propose&count=4").text
    rows = list(csv.DictReader(io.StringIO(table)))
    assert len(rows) == 4
    assert {row["duration_s"] for row in rows} == {"540.0"}
    written = technician.get("/stands/S1/plan.json?mode=propose&count=4").json()
    assert len(written["plan"]["positions"]) == 4
    assert technician.get("/stands/S1/plan.json?time_min=1").status_code == 422
