import csv
import html
import io
import json
import re
from collections.abc import Callable
from datetime import UTC, date, datetime, timedelta

import pytest
from fastapi.testclient import TestClient

from app.exchange.rows import CertificateRow, MeansRow
from app.services import access, gyros, ingest, sessions, stands
from app.services.lab import Lab

PLACES = [(theta, psi) for theta in (0.0, 90.0, 180.0, 270.0) for psi in (0.0, 90.0, 180.0, 270.0)]


@pytest.fixture
def year(stocked: Lab, measured: int, result: int, solving: Callable[..., int]) -> list[int]:
    """Results of three more sessions: 300 and 150 days ago on C-16, and now; each with the same currents."""
    now = datetime.now(UTC)
    with stocked.write(access.SYSTEM) as work:
        rows = [CertificateRow(theta, psi, 5.0, -12.0, 4.0) for theta, psi in PLACES]
        stands.add_certificate(work, "S1", "C-16", date(2019, 1, 1), date(2100, 1, 1), rows)
        known = [item.measurement for item in sessions.detail(work, measured).positions]
        means = [
            MeansRow(item.theta_deg, item.psi_deg, item.jx_ma or 0.0, item.jy_ma or 0.0, 1e-6, 1e-6)
            for item in known
            if item
        ]
        numbers = []
        for days in (300, 150):
            new = sessions.NewSession("0417", "S1", "C-16", started_at=now - timedelta(days=days))
            number = sessions.open_session(work, new).id
            ingest.save(work, number, [ingest.Measured(row, ingest.Source("typed")) for row in means])
            numbers.append(number)
    return [*(solving(stocked, number) for number in numbers), result]


def charts(page: str) -> list[dict]:
    return [json.loads(html.unescape(item)) for item in re.findall(r"data-chart='([^']*)'", page)]


def test_nobody_sees_a_history_without_signing_in(anonymous: TestClient, stocked: Lab) -> None:
    assert anonymous.get("/gyros/0417").status_code == 303
    assert anonymous.get("/gyros/0417/history.csv").status_code == 303


def test_a_gyro_that_was_never_calibrated(technician: TestClient, stocked: Lab) -> None:
    page = technician.get("/gyros/0417").text
    assert "Not calibrated yet" in page
    assert 'href="/sessions/new?gyro=0417"' in page
    assert 'href="/gyros/0417/edit"' in page


def test_each_parameter_has_a_panel_with_every_result(technician: TestClient, year: list[int]) -> None:
    found = charts(technician.get("/gyros/0417").text)
    assert len(found) == 8
    for spec in found:
        points = [row for name in ("within", "conditional", "beyond") for row in spec["datasets"][name]]
        assert [row["href"] for row in sorted(points, key=lambda row: row["t"])] == [
            f"/results/{n}" for n in year
        ]
        assert all(row["low"] < row["v"] < row["high"] for row in points)


def test_a_change_of_certificate_is_labelled_once(technician: TestClient, year: list[int]) -> None:
    events = [spec["datasets"]["events"] for spec in charts(technician.get("/gyros/0417").text)]
    assert [row["text"] for row in events[0]] == ["C-17"]
    assert all([row["text"] for row in rows] == [""] for rows in events[1:])


def test_the_panels_share_their_dates(technician: TestClient, year: list[int]) -> None:
    windows = {
        tuple(item["value"] for item in spec["params"] if item["name"] in ("first", "last"))
        for spec in charts(technician.get("/gyros/0417").text)
    }
    assert len(windows) == 1


def test_a_value_beyond_its_limit_stands_out(technician: TestClient, stocked: Lab, year: list[int]) -> None:
    with stocked.write(access.SYSTEM) as work:
        gyros.set_limits(work, "GVK-6", {"w0x": (-1.0, 1.4995)})
    page = technician.get("/gyros/0417").text
    first = charts(page)[0]["datasets"]
    assert len(first["beyond"]) == 3
    assert [row["text"] for row in first["limits"]] == ["limit 1.4995"]
    assert 'class="mark out"' in page


def test_the_period_is_a_link(technician: TestClient, year: list[int]) -> None:
    page = technician.get("/gyros/0417", params={"period": "quarter"}).text
    assert 'href="/gyros/0417?period=all"' in page
    points = charts(page)[0]["datasets"]["line"]
    assert len(points) == 1
    assert "1 result" in page


def test_the_table_behind_the_charts(technician: TestClient, year: list[int]) -> None:
    page = technician.get("/gyros/0417").text
    table = page[page.index('id="table"') :]
    assert [int(n) for n in re.findall(r'href="/results/(\d+)">No\.', table)] == list(reversed(year))


@pytest.mark.parametrize("method", ["least-squares", "paper"])
def test_the_history_as_a_file(technician: TestClient, year: list[int], method: str) -> None:
    text = technician.get("/gyros/0417/history.csv", params={"method": method}).text
    rows = list(csv.DictReader(io.StringIO(text)))
    assert len(rows) == 8 * 3
    known = technician.get(f"/results/{year[0]}.json").json()[method]["parameters"]
    first = {row["parameter"]: float(row["value"]) for row in rows if row["result"] == str(year[0])}
    assert first == {name: item["value"] for name, item in known.items()}
    assert len(technician.get("/gyros/0417/history.json").json()) == 24


def test_no_such_gyro_or_period(technician: TestClient, stocked: Lab) -> None:
    assert technician.get("/gyros/9999").status_code == 404
    assert technician.get("/gyros/0417", params={"period": "century"}).status_code == 422


def test_in_russian(technician: TestClient, year: list[int]) -> None:
    technician.cookies.set("lang", "ru")
    page = technician.get("/gyros/0417").text
    assert "Дрейф гироскопа 0417" in page
    assert charts(page)[0]["config"]["locale"]["number"]["decimal"] == ","
