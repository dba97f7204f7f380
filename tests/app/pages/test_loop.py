"""The page of the rebalance loop."""

import csv
import io
import json
import re

import pytest
from fastapi.testclient import TestClient

from app.services import access, gyros
from app.services.lab import Lab
from app.services.views import Nominal


def charts(page: str) -> list[dict[str, object]]:
    return [json.loads(spec) for spec in re.findall(r"data-chart='([^']+)'", page)]


def value(page: str, field: str) -> str:
    found = re.search(rf'name="{field}"[^>]* value="([^"]*)"', page)
    assert found, field
    return found[1]


def test_the_method_a_type_and_the_simulation_lead_to_it(technician: TestClient, stocked: Lab) -> None:
    assert 'href="/loop"' in technician.get("/method").text
    assert 'href="/loop?start=printed"' in technician.get("/method").text
    assert 'href="/loop"' in technician.get("/simulations/new").text
    assert 'href="/loop?start=type%3AGVK-6"' in technician.get("/types/GVK-6").text


def test_the_paper_s_loop_is_shown_at_once(designer: TestClient) -> None:
    page = designer.get("/loop").text
    assert "</span> Stable</h2>" in page
    assert "within 2 % of it in 0.04 s" in page
    assert "Gain Kα·Ku·Km 180 1/s; nutation H/A 2800 rad/s." in page
    assert value(page, "a_kg_m2") == "5e−7"
    assert value(page, "t1_s") == "0.015"
    # The table of spec 2.1, to four digits.
    for part in ("−130.8", "49.43", "−130.9", "−89.28", "−1331", "−65.11"):
        assert f'<td class="num">{part}</td>' in page
    assert '<td class="num"><b>16.2</b></td><td class="num">22.2</td>' in page
    assert page.count("decays</span>") == 5
    assert len(charts(page)) == 6


def test_every_chart_has_a_table_behind_it(designer: TestClient) -> None:
    page = designer.get("/loop").text
    steps = page[page.index('id="steps"') : page.index('id="gain"')]
    assert steps.count("<tr>") == 1 + 21
    # Down to the fourth digit of the largest deflection, 4.7 mrad, and of the largest rate, 1.28 rad/s.
    assert '<td class="num">1.000</td><td class="num">0.000</td></tr></tbody>' in steps
    frequencies = page[page.index('id="frequencies"') :]
    assert frequencies.count("<tr>") == 2 + 13  # three decades, four to each, with both ends
    assert '<tr><td class="num">1000</td><td class="num">−17.1</td>' in frequencies


def test_the_printed_time_is_unstable_and_called_a_misprint(designer: TestClient) -> None:
    page = designer.get("/loop?start=printed").text
    assert "</span> Unstable</h2>" in page
    assert "T1 is not longer than 2·T2 = 0.002 s" in page
    assert 'href="/method#misprints"' in page
    assert value(page, "t1_s") == "0.0015"
    assert page.count("grows</span>") == 2
    assert "An unstable loop has no margins and no bandwidth." in page
    assert len(charts(page)) == 5  # nothing answers an oscillation
    longer = designer.get("/loop?start=printed&duration_s=10").text
    assert "cut off at 0.177 s" in longer
    # With another T1 it is no misprint any more.
    assert 'href="/method#misprints"' not in designer.get("/loop?start=printed&t1_s=0.0016").text


def test_a_proportional_loop_is_one_click_away(designer: TestClient) -> None:
    page = designer.get("/loop?start=proportional").text
    assert value(page, "t1_s") == "∞"
    assert value(page, "t2_s") == "0"
    assert "The nutation at H/A = 2800 rad/s grows" in page
    assert designer.get("/loop", params={"t1_s": "∞", "t2_s": "0,001"}).text.count("decays</span>") == 4


def test_a_type_begins_with_its_scale_factor(designer: TestClient, stocked: Lab) -> None:
    with stocked.write(access.SYSTEM) as work:
        nominals = {name: Nominal(1031.324, 20.0, None) for name in ("kx", "ky")}
        gyros.set_nominals(work, "GVK-6", nominals)
    page = designer.get("/loop?start=type:GVK-6").text
    assert value(page, "k_m_rad_per_s_per_a") == "5"  # half of 2062.648 °/h/mA, which are 10 rad/(s·A)
    assert '<input type="hidden" name="start" value="type:GVK-6">' in page
    # What is typed counts more.
    typed = designer.get("/loop?start=type:GVK-6&k_m_rad_per_s_per_a=8").text
    assert value(typed, "k_m_rad_per_s_per_a") == "8"
    assert designer.get("/loop?start=type:none").status_code == 404


def test_the_state_is_in_the_address(designer: TestClient) -> None:
    page = designer.get("/loop?h_n_m_s=0,002&a_kg_m2=1e-6&t1_s=0.08&duration_s=0.5").text
    assert value(page, "h_n_m_s") == "0,002"
    assert value(page, "duration_s") == "0.5"
    assert "nutation H/A 2000 rad/s" in page
    assert 'href="/loop/steps.csv?h_n_m_s=0,002&amp;a_kg_m2=1e-6&amp;t1_s=0.08&amp;duration_s=0.5"' in page


@pytest.mark.parametrize(
    ("query", "field", "says"),
    [
        ("a_kg_m2=x", "a_kg_m2", "“x” is not a number"),
        ("t1_s=-1", "t1_s", "or ∞ for a loop without integrator"),
        ("t2_s=inf", "t2_s", "is infinite"),
        ("h_n_m_s=0", "h_n_m_s", "Give a value from"),
        ("duration_s=0", "duration_s", "Give a value from"),
        ("duration_s=long", "duration_s", "“long” is not a number"),
        ("a_kg_m2=5", "a_kg_m2", "The nutation H/A would be"),
        ("k_u_a_per_v=90000", "k_alpha_v_per_rad", "The gain Kα·Ku·Km would be"),
    ],
)
def test_an_error_stands_at_its_field(designer: TestClient, query: str, field: str, says: str) -> None:
    answer = designer.get(f"/loop?{query}")
    assert answer.status_code == 422
    assert says in answer.text
    assert f'id="f-{field}-problem"' in answer.text
    assert "data-chart" not in answer.text


def test_all_errors_are_said_at_once(designer: TestClient) -> None:
    page = designer.get("/loop?a_kg_m2=x&t1_s=-1&k_u_a_per_v=1e9&duration_s=0").text
    assert page.count('class="problem"') == 4
    assert len(re.findall(r"aria-invalid", page)) == 4
    assert len(re.findall(r"autofocus", page)) == 1


def test_tables_are_files(designer: TestClient) -> None:
    poles = list(csv.DictReader(io.StringIO(designer.get("/loop/poles.csv").text)))
    assert len(poles) == 5
    assert float(poles[0]["im_rad_per_s"]) == pytest.approx(2787.5, abs=0.1)
    steps = list(csv.DictReader(io.StringIO(designer.get("/loop/steps.csv?duration_s=0.5").text)))
    assert len(steps) == 1001
    assert float(steps[-1]["t_s"]) == pytest.approx(0.5)
    assert float(steps[-1]["measured_x_rad_per_s"]) == pytest.approx(1.0, abs=1e-6)
    assert designer.get("/loop/frequency.csv").text.startswith("omega_rad_per_s,loop_gain_db,")
    found = designer.get("/loop.json?start=printed").json()
    assert found["verdict"]["code"] == "integral-time"
    assert (
        designer.get("/loop/else.csv").status_code == 404 or designer.get("/loop/else.csv").status_code == 422
    )


def test_it_speaks_russian(designer: TestClient) -> None:
    page = designer.get("/loop?start=printed", headers={"accept-language": "ru"}).text
    assert "T1 не больше 2·T2 = 0,002 с" in page
    assert value(page, "t1_s") == "0,0015"
    refused = designer.get("/loop?t1_s=-1", headers={"accept-language": "ru"}).text
    assert "или ∞ для контура без интегратора" in refused


def test_a_chart_of_the_phase_counts_margins_from_half_a_turn(designer: TestClient) -> None:
    phase = next(
        spec for spec in charts(designer.get("/loop").text) if str(spec["description"]).startswith("Phase")
    )
    datasets = phase["datasets"]
    assert isinstance(datasets, dict)
    for sign, margin in (("positive", 49.02), ("negative", 49.29)):
        (mark,) = datasets[f"mark_{sign}"]
        assert mark["e"] == -180.0
        assert mark["v"] == pytest.approx(-180.0 + margin, abs=0.01)
        # The end of the mark lies on the curve.
        nearest = min(datasets[sign], key=lambda row: abs(row["w"] - mark["w"]))
        assert nearest["v"] == pytest.approx(mark["v"], abs=0.01)
