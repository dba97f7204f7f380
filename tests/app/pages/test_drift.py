import csv
import html
import io
import json
import math
import re
from pathlib import Path

import drift_laboratory
import pytest
from fastapi.testclient import TestClient

from app.services import access
from app.services.drift import studying
from app.services.lab import Lab
from app.store import drift, equipment


@pytest.fixture(scope="session")
def prepared(laid: Path) -> Path:
    """Gyro 0417 with a year of results and a study written by hand."""
    return laid


@pytest.fixture
def really_studied(lab: Lab) -> None:
    """The same gyro studied as a job would study it."""
    with lab.write(access.SYSTEM) as work:
        gyro = equipment.gyro(work.db, "0417")
        assert gyro is not None
        for row in drift.studies(work.db, gyro.id, None):
            row.changed += 1
        studying.follow_now(work, gyro.id)


def charts(page: str) -> list[dict]:
    return [json.loads(html.unescape(item)) for item in re.findall(r"data-chart='([^']*)'", page)]


def text(page: str) -> str:
    return html.unescape(re.sub(r"\s+", " ", re.sub(r"<[^>]+>", "", page)))


def test_nobody_sees_it_without_signing_in(anonymous: TestClient) -> None:
    for path in ("/gyros/0417/drift/w0x", "/gyros/0417/drift/w0x.csv", "/gyros/0417/drift/w0x/false-alarms"):
        assert anonymous.get(path).status_code == 303


def test_the_study_in_words_and_tables(technician: TestClient) -> None:
    page = text(technician.get("/gyros/0417/drift/w0x?period=all").text)
    assert "Step, explained" in page
    assert "+0.0224 ± 0.0021 °/h" in page
    assert "before session 10: 98 %, 11: 2.0 %" in page
    assert "61.2" in page
    # between starts 1.2 u, its interval 0.6 and 1.9 times that, u = 0.00105 °/h
    assert re.search(r"Between starts\s*0\.0013\s*0\.0008\s*0\.0024\s*2\.4\s*0\.031", page)
    assert re.search(r"linear\s*constant\s*61\.2\s*1 / 6\s*< 0\.001", page)


def test_values_beyond_control_stand_among_the_rules_broken(technician: TestClient) -> None:
    page = technician.get("/gyros/0417/drift/w0y?period=all").text
    broken = re.search(r'aria-labelledby="rules".*?</section>', page, re.DOTALL)
    assert broken
    beyond = charts(page)[0]["datasets"]["beyond"]
    assert len(beyond) >= 4
    assert broken[0].count("A point beyond the control limits.") == len(beyond)
    assert all(f'href="{row["href"]}"' in broken[0] for row in beyond)


def test_four_charts_of_a_real_study(technician: TestClient, really_studied: None) -> None:
    """Moving ranges and sums are computed here again from the values."""
    found = charts(technician.get("/gyros/0417/drift/w0y?period=all").text)
    assert len(found) == 4
    individuals, ranges, average, sums = (spec["datasets"] for spec in found)
    values = [row["v"] for row in individuals["line"]]
    assert values == [drift_laboratory.value("w0y", number) for number in range(17)]
    shown = {row["t"]: row["v"] for row in ranges["line"]}
    times = [row["t"] for row in individuals["line"]]
    for place in range(1, 17):
        if times[place] in shown:  # none across the repair
            assert shown[times[place]] == pytest.approx(abs(values[place] - values[place - 1]), abs=1e-15)
    assert times[drift_laboratory.BEFORE] not in shown
    assert average["line"]
    assert sums["line"]
    assert min(row["v"] for row in sums["line"]) < 0 <= max(row["v"] for row in sums["line"])
    assert {round(row["low"], 9) for row in sums["control"]} == {-5.0}


def test_statistics_beyond_their_limits_are_marked_though_no_rule_watches_them(
    technician: TestClient, really_studied: None
) -> None:
    """Which are beyond is read from the file; the baselines judge by single values alone."""
    found = charts(technician.get("/gyros/0417/drift/w0y?period=all").text)[1:]
    file = technician.get("/gyros/0417/drift/w0y.csv?period=all").text
    rows = [
        {name: float(text) for name, text in row.items() if name.startswith(_STATISTICS) and text}
        | {"href": f"/results/{row['result']}"}
        for row in csv.DictReader(io.StringIO(file))
    ]
    for spec, columns, limit in zip(
        found, (["moving_range"], ["ewma"], ["cusum_above", "cusum_below"]), _STATISTICS, strict=True
    ):
        beyond = [
            row["href"]
            for name in columns
            for row in rows
            if name in row and not row.get(f"{limit}_low", -math.inf) <= row[name] <= row[f"{limit}_high"]
        ]
        marked = spec["datasets"].get("beyond", [])
        assert sorted(row["href"] for row in marked) == sorted(beyond), limit
        assert all("beyond the control limit" in row["name"] for row in marked)
        assert beyond or limit == "moving_range"


_STATISTICS = ("moving_range", "ewma", "cusum")


def test_the_drift_that_was_laid_there_is_found(technician: TestClient, really_studied: None) -> None:
    """−0.0021 °/h a session from the eleventh on: sessions are 21 days apart or so, −0.0365 °/h a year."""
    page = text(technician.get("/gyros/0417/drift/w0y?period=all").text)
    slope = re.search(r"−(0\.0\d+) ± 0\.0\d+ °/h a year since", page)
    assert slope
    assert float(slope[1]) == pytest.approx(0.0365, abs=0.008)  # twice its stated uncertainty, 0.004
    assert "reaches −0.8 °/h on" in page


def test_the_false_alarms_of_the_baseline_are_stated(technician: TestClient) -> None:
    said = technician.get("/gyros/0417/drift/w0x/false-alarms").text
    assert re.search(r"one false alarm in about \d+ sessions", said)
    assert 'hx-get="/gyros/0417/drift/w0x/false-alarms?method=least-squares"' in technician.get(
        "/gyros/0417/drift/w0x"
    ).text.replace("&amp;", "&")


def test_the_values_with_their_statistics_as_a_file(technician: TestClient, really_studied: None) -> None:
    rows = list(csv.DictReader(io.StringIO(technician.get("/gyros/0417/drift/w0y.csv?period=all").text)))
    assert len(rows) == 17
    assert {"ewma", "moving_range", "cusum_above", "individuals_low"} <= set(rows[0])
    assert technician.get("/gyros/0417/drift/w0y.parquet").content[:4] == b"PAR1"


def test_a_long_history_is_whole_in_tables_files_and_what_broke_a_rule(
    technician: TestClient, lab: Lab
) -> None:
    with lab.write(access.SYSTEM) as work:
        table = drift_laboratory.lengthen(work, 1000)
    page = technician.get("/gyros/0417/drift/w0x?period=all").text
    rows = re.search(r'aria-labelledby="table".*', page, re.DOTALL)
    broken = re.search(r'aria-labelledby="rules".*?</section>', page, re.DOTALL)
    assert rows
    assert broken
    assert re.findall(r'href="/sessions/(\d+)"', rows[0])[:50] == [str(1000 - n) for n in range(50)]
    assert "50 of 1000" in text(rows[0])
    assert re.findall(r'href="/results/(\d+)"', broken[0]) == [str(number) for number in range(976, 0, -50)]
    individuals, average = (
        {int(row["href"].rpartition("/")[2]): row["v"] for row in rows}
        for rows in ([*spec["datasets"]["within"], *spec["datasets"]["beyond"]] for spec in charts(page))
    )
    assert set(range(26, 1001, 50)) <= set(individuals)
    assert len(individuals) < 200
    for found, column in ((individuals, "w0x.value"), (average, "w0x.ewma")):
        assert {min(found.values()), max(found.values())} == {table[column].min(), table[column].max()}
    assert "those that broke a rule; the files hold every one" in text(page)
    file = technician.get("/gyros/0417/drift/w0x.csv?period=all").text
    assert len(file.splitlines()) == 1001


def test_of_many_broken_rules_the_newest_are_listed(technician: TestClient, lab: Lab) -> None:
    with lab.write(access.SYSTEM) as work:
        drift_laboratory.lengthen(work, 5000)
    page = technician.get("/gyros/0417/drift/w0x?period=all").text
    broken = re.search(r'aria-labelledby="rules".*?</section>', page, re.DOTALL)
    assert broken
    assert "the newest first, 50 of 100" in text(broken[0])
    assert broken[0].count("<dt") == 50


def test_means_have_no_control_charts(technician: TestClient) -> None:
    page = technician.get("/gyros/0417/drift/w0y?period=all&by=year").text
    assert len(charts(page)) == 1
    assert "Control charts judge single sessions" in page


def test_no_such_parameter_or_gyro(technician: TestClient) -> None:
    assert technician.get("/gyros/0417/drift/mass").status_code == 404
    assert technician.get("/gyros/9999/drift/w0x").status_code == 404


def test_an_empty_period_says_so(technician: TestClient) -> None:
    page = technician.get("/gyros/0417/drift/w0x?from=1999-01-01&until=1999-02-01").text
    assert "No results in this period" in page
    assert "?period=all" in page
