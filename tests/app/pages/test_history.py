import csv
import html
import io
import json
import re
from datetime import UTC, datetime, timedelta
from pathlib import Path

import drift_laboratory
import pyarrow.parquet
import pytest
from fastapi.testclient import TestClient

from app.pages import drift_words
from app.services import access, gyros
from app.services.drift import events, fleet
from app.services.lab import Lab
from app.store import drift, equipment
from app.store.tables import Alarm, Baseline, Calibration, CalibrationParameter, DriftStudy
from solver.records import PARAMETERS


@pytest.fixture(scope="session")
def prepared(laid: Path) -> Path:
    """Gyro 0417 with a year of results and its study."""
    return laid


@pytest.fixture
def results(lab: Lab) -> list[int]:
    """Its results, the oldest first."""
    with lab.read(access.SYSTEM) as work:
        return drift_laboratory.results_of(work)


@pytest.fixture
def fresh(lab: Lab) -> str:
    """A gyro that was never calibrated."""
    with lab.write(access.SYSTEM) as work:
        return gyros.add_gyro(work, "0500", "GVK-6").serial


def charts(page: str) -> list[dict]:
    return [json.loads(html.unescape(item)) for item in re.findall(r"data-chart='([^']*)'", page)]


def section(page: str, name: str) -> str:
    found = re.search(rf'<section[^>]*aria-labelledby="{name}".*?</section>', page, re.DOTALL)
    assert found, name
    return html.unescape(re.sub(r"\s+", " ", re.sub(r"<[^>]+>", "", found[0])))


def test_nobody_sees_a_history_without_signing_in(anonymous: TestClient) -> None:
    for path in (
        "/gyros/0417",
        "/gyros/0417/history.csv",
        "/gyros/0417/study",
        "/gyros/0417/repeatability.csv",
    ):
        assert anonymous.get(path).status_code == 303


def test_a_gyro_that_was_never_calibrated(technician: TestClient, fresh: str) -> None:
    page = technician.get("/gyros/0500").text
    assert "Not calibrated yet" in page
    assert 'href="/sessions/new?gyro=0500"' in page
    assert 'href="/gyros/0500/edit"' in page


def test_each_parameter_has_a_panel_with_every_result(technician: TestClient, results: list[int]) -> None:
    found = charts(technician.get("/gyros/0417?period=all").text)
    assert len(found) == 8
    for spec in found:
        points = [row for name in ("within", "conditional", "beyond") for row in spec["datasets"][name]]
        in_order = sorted(points, key=lambda row: row["t"])
        assert [row["href"] for row in in_order] == [f"/results/{number}" for number in results]
        assert all(row["low"] < row["v"] < row["high"] for row in points)


def test_values_beyond_control_are_the_ones_laid_there(technician: TestClient, results: list[int]) -> None:
    """ω0y drifts: sessions whose value differs from the first baseline's centre by more than 3.4 u."""
    spec = charts(technician.get("/gyros/0417?period=all").text)[1]
    centre = sum(drift_laboratory.value("w0y", number) for number in range(6)) / 6
    far = [
        f"/results/{result}"
        for number, result in enumerate(results)
        if abs(drift_laboratory.value("w0y", number) - centre) > 3.4 * drift_laboratory.U["w0y"]
    ]
    assert [row["href"] for row in spec["datasets"]["beyond"]] == far
    assert len(far) >= 4


def test_limits_stand_over_what_they_judge_and_never_across_the_repair(
    technician: TestClient, results: list[int]
) -> None:
    spec = charts(technician.get("/gyros/0417?period=all").text)[0]
    rows = spec["datasets"]["control"]
    repair = next(row["t"] for row in spec["datasets"]["events"] if row["solid"])
    first, second = ([row for row in rows if row["of"] == number] for number in (0, 1))
    assert max(row["t"] for row in first) <= repair <= min(row["t"] for row in second)
    assert {row["centre"] for row in first} != {row["centre"] for row in second}
    assert {row["part"] for row in spec["datasets"]["line"]} == {0, 1}


def test_events_are_named_once(technician: TestClient, results: list[int]) -> None:
    events = [spec["datasets"]["events"] for spec in charts(technician.get("/gyros/0417?period=all").text)]
    assert [row["text"] for row in events[0]] == ["C-17", "repair"]
    assert all(row["text"] == "" for rows in events[1:] for row in rows)


def test_the_panels_share_their_dates_and_look_ahead(technician: TestClient, results: list[int]) -> None:
    found = charts(technician.get("/gyros/0417").text)
    windows = {
        tuple(item["value"] for item in spec["params"] if item["name"] in ("first", "last")) for spec in found
    }
    assert len(windows) == 1
    today = datetime.now(UTC).timestamp() * 1000
    assert windows.pop()[1] > today + 30 * 86_400_000
    assert [row["text"] for row in found[0]["datasets"]["today"]] == ["today"]


def test_the_period_is_a_link(technician: TestClient, results: list[int]) -> None:
    page = technician.get("/gyros/0417", params={"period": "quarter"}).text
    assert 'href="/gyros/0417?period=all"' in page
    expected = sum(days < 92 for days in drift_laboratory.DAYS)
    assert len(charts(page)[0]["datasets"]["line"]) == expected
    assert f"{expected} results" in page
    since_repair = charts(technician.get("/gyros/0417?period=repair").text)[0]["datasets"]["line"]
    assert len(since_repair) == sum(days < drift_laboratory.REPAIRED for days in drift_laboratory.DAYS)


def test_days_may_be_named_instead_of_a_period(technician: TestClient, results: list[int]) -> None:
    now = datetime.now(UTC)
    span = {"from": f"{now - timedelta(days=60):%Y-%m-%d}", "until": f"{now - timedelta(days=30):%Y-%m-%d}"}
    points = charts(technician.get("/gyros/0417", params=span).text)[0]["datasets"]["line"]
    assert len(points) == 2  # 53 and 32 days ago
    assert technician.get("/gyros/0417", params={"from": "yesterday"}).status_code == 422


def test_grouped_by_year_a_point_opens_its_sessions(technician: TestClient, results: list[int]) -> None:
    page = technician.get("/gyros/0417?period=all&by=year").text
    points = charts(page)[0]["datasets"]["within"]
    assert len(points) == len(
        {(datetime.now(UTC) - timedelta(days=days)).year for days in drift_laboratory.DAYS}
    )
    assert all(row["href"].startswith("?from=") and "by=session" in row["href"] for row in points)
    assert "mean of" in points[0]["name"]
    opened = charts(technician.get("/gyros/0417" + points[-1]["href"]).text)[0]["datasets"]["line"]
    assert f"mean of {len(opened)} sessions" in points[-1]["name"]
    assert page.count("No.&nbsp;") or page.count(">No. ") >= len(
        results
    )  # the table tells each session still


def test_the_table_behind_the_charts(technician: TestClient, results: list[int]) -> None:
    page = technician.get("/gyros/0417?period=all").text
    table = page[page.index('id="table"') :]
    assert [int(n) for n in re.findall(r'href="/results/(\d+)">No\.', table)] == list(reversed(results))


def test_the_state_of_a_parameter_in_words(technician: TestClient, results: list[int]) -> None:
    page = technician.get("/gyros/0417").text
    said = re.findall(r'<p class="says"><span class="mark (\w+)">([^<]+)<', page)
    assert said[0] == ("ok", "in control since the repair")
    assert said[1] == ("out", "beyond control, drifting")
    assert len(said) == 8


def test_alarms_stand_beside_and_can_be_answered_by_who_judges(
    technician: TestClient, quality: TestClient, results: list[int]
) -> None:
    page = quality.get("/gyros/0417").text
    text = section(page, "alarms")
    assert text.index("Beyond control") < text.index("Drifting") < text.index("acknowledged by A. Sokolov")
    assert "2 open" in text
    assert "−0.7899 °/h is below the lower control limit of −0.7896 °/h" in text
    assert page.count("/acknowledgement") == 2
    assert "/acknowledgement" not in technician.get("/gyros/0417").text


def test_events_can_be_withdrawn_and_derived_ones_cannot(
    technician: TestClient, quality: TestClient, results: list[int]
) -> None:
    page = quality.get("/gyros/0417").text
    text = section(page, "events")
    assert "Repair: torquer lead resoldered, R-118" in text
    assert "New certificate: C-17" in text
    assert page.count("/withdrawal") == 1
    assert "/withdrawal" not in technician.get("/gyros/0417").text, "somebody else entered it"


def test_a_step_that_no_event_explains_is_dated_and_named_by_its_size(
    technician: TestClient, lab: Lab, results: list[int]
) -> None:
    """Of two steps whose names would run into each other the surer one is named."""
    with lab.write(access.SYSTEM) as work:
        gyro = equipment.gyro(work.db, "0417")
        assert gyro is not None
        row = drift.study(work.db, gyro.id, None, "least-squares")
        assert row is not None
        document = json.loads(row.document or "")
        step = document["parameters"]["w0x"]["changes"][0] | {"event": None}
        doubtful = step | {"size": 0.001, "p_value": 0.03}
        document["parameters"]["w0x"]["changes"] = [doubtful, step]
        row.document = json.dumps(document)
    first, second, *_ = charts(technician.get("/gyros/0417?period=all").text)
    bands = first["datasets"]["changes"]
    assert [band["text"] for band in bands] == ["+0.0224", ""]
    moments = [row["t"] for row in first["datasets"]["line"]]
    before, after = drift_laboratory.BEFORE - 1, drift_laboratory.BEFORE
    assert (bands[0]["t"], bands[0]["t2"]) == (moments[before], moments[after])
    assert second["datasets"]["changes"] == []


def test_the_basis_of_the_limits_is_said(technician: TestClient, results: list[int]) -> None:
    text = section(technician.get("/gyros/0417").text, "charts")
    assert "All parameters: individuals chart from" in text
    assert "6 sessions, Paule–Mandel, three standard deviations, frozen on" in text
    assert "by A. Sokolov. After warming up." in text


def test_without_a_baseline_one_is_invited_to_choose(technician: TestClient, lab: Lab) -> None:
    with lab.write(access.SYSTEM) as work:
        gyro = equipment.gyro(work.db, "0417")
        assert gyro is not None
        for row in drift.baselines(work.db, gyro.id):
            row.retired_at = datetime.now(UTC)
    page = technician.get("/gyros/0417").text
    assert "No baseline is frozen" in page
    assert 'href="/gyros/0417/baseline?method=least-squares"' in page


def test_trend_and_forecast_in_words(technician: TestClient, results: list[int]) -> None:
    text = section(technician.get("/gyros/0417").text, "trend")
    assert "−0.0397 ± 0.0046 °/h a year since" in text
    assert "reaches −0.8 °/h on" in text
    assert "+0.0224 ± 0.0021 °/h" in text
    assert "explained by an event" in text


def test_repeatability_by_source(technician: TestClient, results: list[int]) -> None:
    page = technician.get("/gyros/0417").text
    text = section(page, "repeat")
    # u(ω0x) = 0.00105 °/h: between starts 1.2 u, its interval 0.6 and 1.9 times that
    assert re.search(r"0\.0013\s*0\.0008–0\.0024\s*p\s*= 0\.031", text)
    assert "These sessions cannot tell apart: between sessions + between starts." in text
    assert page.count('class="row-out"') == 1
    rows = list(csv.DictReader(io.StringIO(technician.get("/gyros/0417/repeatability.csv").text)))
    assert {row["source"] for row in rows} >= {"within-position", "between-days", "together"}
    assert {row["parameter"] for row in rows} == set(PARAMETERS)


def test_recalibration_with_its_reasons(technician: TestClient, results: list[int]) -> None:
    text = section(technician.get("/gyros/0417").text, "interval")
    assert "Recommended interval: 61 days." in text
    assert "The course leaves its limits after 61 days." in text


def test_the_history_as_a_file(technician: TestClient, results: list[int]) -> None:
    path, query = "/gyros/0417/history", {"period": "all"}
    rows = list(csv.DictReader(io.StringIO(technician.get(f"{path}.csv", params=query).text)))
    values = {(row["parameter"], int(row["result"])): float(row["value"]) for row in rows}
    assert values == {
        (name, result): drift_laboratory.value(name, number)
        for number, result in enumerate(results)
        for name in PARAMETERS
    }
    assert len(technician.get(f"{path}.json", params=query).json()) == len(rows)
    parquet = technician.get(f"{path}.parquet", params=query).content
    assert pyarrow.parquet.read_table(io.BytesIO(parquet)).num_rows == len(rows)
    assert technician.get(f"{path}.json", params={**query, "method": "paper"}).json() == []


@pytest.mark.parametrize(
    ("table", "count"), [("changes", 2), ("trends", 8), ("forecasts", 8 * 14), ("intervals", 3)]
)
def test_what_was_found_as_files(technician: TestClient, results: list[int], table: str, count: int) -> None:
    page = technician.get("/gyros/0417").text
    path = f"/gyros/0417/history/{table}"
    assert f'href="{path}.csv?method=least-squares"' in page
    rows = list(csv.DictReader(io.StringIO(technician.get(f"{path}.csv").text)))
    assert len(rows) == len(technician.get(f"{path}.json").json()) == count
    parquet = technician.get(f"{path}.parquet").content
    assert pyarrow.parquet.read_table(io.BytesIO(parquet)).column_names == list(rows[0])
    assert technician.get(f"{path}.csv", params={"method": "robust"}).text.count("\n") == 1


def test_a_study_that_is_behind_says_so_until_it_has_caught_up(
    technician: TestClient, lab: Lab, results: list[int]
) -> None:
    with lab.write(access.SYSTEM) as work:
        events.add(work, "adjustment", datetime.now(UTC) - timedelta(days=1), gyro="0417")
    page = technician.get("/gyros/0417").text
    assert "A newer result is being taken in" in page
    assert 'hx-get="/gyros/0417/study?method=least-squares"' in page
    assert technician.get("/gyros/0417/study").status_code == 204
    with lab.write(access.SYSTEM) as work:
        gyro = equipment.gyro(work.db, "0417")
        assert gyro is not None
        for row in drift.studies(work.db, gyro.id, None):
            row.studied = row.changed
    answer = technician.get("/gyros/0417/study")
    assert (answer.status_code, answer.headers["hx-refresh"]) == (200, "true")
    assert "A newer result is being taken in" not in technician.get("/gyros/0417").text


def test_a_gyro_that_is_solved_by_another_method_only(technician: TestClient, lab: Lab) -> None:
    """Everything of 0417 is by the robust method: pages choose it, alarms lead there, the fleet counts them."""
    with lab.write(access.SYSTEM) as work:
        for table in (CalibrationParameter, DriftStudy, Alarm, Baseline):
            work.db.query(table).update({"method": "robust"})
        work.db.query(Calibration).update({"method": "robust"})
    page = technician.get("/gyros/0417?period=all").text
    assert len(charts(page)) == len(PARAMETERS)
    assert "17 results" in page
    assert "Robust (Huber)" in page
    assert "Least squares" not in page
    assert "2 open" in section(page, "alarms")
    for address in re.findall(r'href="(/gyros/0417[^"#]*)', technician.get("/alarms").text):
        assert len(charts(technician.get(html.unescape(address)).text)) >= 1
    assert "Drifting" in technician.get("/gyros/0417/drift/w0y?period=all").text
    assert technician.get("/gyros/0417/drift/w0y.csv?period=all").text.count("\n") == 18
    assert "between-days" in technician.get("/gyros/0417/repeatability.csv").text
    other = technician.get("/gyros/0417?method=least-squares").text
    assert "No results by this method" in other
    assert "method=robust" in other
    with lab.read(access.SYSTEM) as work:
        (gyro,) = fleet.fleet(work, "GVK-6").gyros
    assert (gyro.alarms, gyro.sessions) == (2, 17)


def test_no_such_gyro_or_period(technician: TestClient) -> None:
    assert technician.get("/gyros/9999").status_code == 404
    assert technician.get("/gyros/0417", params={"period": "century"}).status_code == 422


def test_in_russian(technician: TestClient, results: list[int]) -> None:
    technician.cookies.set("lang", "ru")
    page = technician.get("/gyros/0417").text
    assert "Дрейф гироскопа 0417" in page
    assert charts(page)[0]["config"]["locale"]["number"]["decimal"] == ","
    assert "−0,7979" in page


def test_a_limit_passed_is_not_forecast(technician: TestClient, lab: Lab) -> None:
    with lab.write(access.SYSTEM) as work:
        gyro = equipment.gyro(work.db, "0417")
        assert gyro is not None
        row = drift.study(work.db, gyro.id, None, "least-squares")
        assert row is not None
        document = json.loads(row.document or "")
        document["parameters"]["w0y"]["latest"]["verdict"] = "fails"
        row.document = json.dumps(document)
    text = section(technician.get("/gyros/0417").text, "trend")
    assert "beyond its limits" in text
    assert "reaches" not in text


def test_a_value_and_its_unit_stay_on_one_line() -> None:
    values = {"unit": "deg/h", "value": {"value": 2.7, "expanded": 0.1, "sign": False}, "count": 1}
    assert drift_words.sentence("%(value)s %(unit)s lies.", values) == "2.70 ± 0.10\u00a0°/h lies."


@pytest.mark.parametrize(
    ("earliest", "latest", "said"),
    [
        ("2026-11-05", "2027-02-01", "on 1 Dec 2026, perhaps already"),
        ("2026-11-20", None, "on 1 Dec 2026 (not before 20 Nov 2026)"),
        ("2026-11-20", "2027-02-01", "on 1 Dec 2026 (between 20 Nov 2026 and 1 Feb 2027)"),
    ],
)
def test_a_forecast_names_only_days_to_come(earliest: str, latest: str | None, said: str) -> None:
    leaves = {"limit": 2.65, "date": "2026-12-01", "earliest": earliest, "latest": latest}
    found = {"at": ["2026-11-05"], "leaves": leaves}
    assert drift_words.forecast(found, "deg/h/g", limited=True) == f"reaches 2.65 °/h/g {said}"
