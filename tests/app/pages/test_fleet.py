"""All gyros of a type."""

import csv
import io
import json
import re
from datetime import UTC, datetime

import pyarrow.parquet as pq
import pytest
from fastapi.testclient import TestClient

from app.services import access, calibrations, gyros
from app.services.lab import Lab
from app.services.sessions import NewSession, open_session
from solver.records import PARAMETERS

VALUES = {"0417": 1.5, "0418": 0.2, "0419": -1.9, "0420": 2.5, "0421": 0.4}
"""ω0x of each gyro; the limits are ±2."""


@pytest.fixture
def fleet(stocked: Lab) -> Lab:
    """Five gyros with one result each, and one without."""
    with stocked.write(access.SYSTEM) as work:
        gyros.set_interval(work, "GVK-6", 200)
        for place, (serial, value) in enumerate(VALUES.items()):
            if serial != "0417":
                gyros.add_gyro(work, serial, "GVK-6")
            number = open_session(
                work, NewSession(serial, "S1", started_at=datetime(2026, 1, 1 + place, tzinfo=UTC))
            ).id
            rows = [
                {"method": "least-squares", "parameter": name, "value": value if name == "w0x" else place * value**2,
                 "standard_uncertainty": 0.05, "coverage_factor": 2.0, "u_noise": 0.05}
                for name in PARAMETERS
            ]  # fmt: skip
            output = {"result": f'{{"n":{number}}}', "input_hash": "0" * 64, "solver_version": "1.0.0",
                      "parameters": rows, "fit": {"chi2": None, "fit_dof": None}, "attitude": None}  # fmt: skip
            calibrations.store(work, number, {"method": "least-squares", "inputs": []}, output)
        gyros.add_gyro(work, "0422", "GVK-6")
    return stocked


def _serials(page: str) -> list[str]:
    return re.findall(r'class="id" href="/gyros/([^"]+)"', page)


def test_the_worst_by_standing_comes_first(designer: TestClient, fleet: Lab) -> None:
    page = designer.get("/types/GVK-6/fleet").text
    assert _serials(page) == ["0420", "0419", "0417", "0421", "0418", "0422"]
    assert "125 %" in page  # 2.5 of ±2


def test_the_table_is_sorted_by_the_address(designer: TestClient, fleet: Lab) -> None:
    by_value = _serials(designer.get("/types/GVK-6/fleet?sort=value").text)
    assert by_value == ["0422", "0419", "0418", "0421", "0417", "0420"]
    assert _serials(designer.get("/types/GVK-6/fleet?sort=gyro").text) == sorted([*VALUES, "0422"])
    assert designer.get("/types/GVK-6/fleet?sort=nonsense&parameter=nothing").status_code == 200


def test_every_gyro_is_a_mark_of_its_distribution(designer: TestClient, fleet: Lab) -> None:
    page = designer.get("/types/GVK-6/fleet").text
    charts = [json.loads(text) for text in re.findall(r"data-chart='([^']+)'", page)]
    first = charts[0]["datasets"]
    assert {row["href"] for state in ("within", "conditional", "beyond") for row in first[state]} == {
        f"/gyros/{serial}" for serial in VALUES
    }
    assert [row["href"] for row in first["beyond"]] == ["/gyros/0420"]
    assert len(charts) == 9  # eight parameters and the map of their pairs


def test_few_gyros_say_what_is_missing(designer: TestClient, stocked: Lab) -> None:
    page = designer.get("/types/GVK-6/fleet").text
    assert "No gyro has a sound calibration yet." in page
    assert "Too few gyros" in page
    assert designer.get("/types/none/fleet").status_code == 404


def test_the_same_as_files(designer: TestClient, fleet: Lab) -> None:
    rows = list(csv.DictReader(io.StringIO(designer.get("/types/GVK-6/fleet.csv").text)))
    assert [row["gyro"] for row in rows] == [*VALUES, "0422"]
    assert float(rows[2]["w0x_deg_per_h"]) == -1.9
    assert rows[0]["due"] == "2026-07-20"
    table = pq.read_table(io.BytesIO(designer.get("/types/GVK-6/fleet.parquet").content))
    assert table["w0x_deg_per_h"].to_pylist() == [*VALUES.values(), None]
    assert len(designer.get("/types/GVK-6/fleet.json").json()) == 6


@pytest.mark.parametrize("table", ["distributions", "components", "correlations"])
def test_what_they_have_in_common_as_files(designer: TestClient, fleet: Lab, table: str) -> None:
    page = designer.get("/types/GVK-6/fleet").text
    rows = designer.get(f"/types/GVK-6/fleet/{table}.json").json()
    for form in ("csv", "parquet"):
        address = f"/types/GVK-6/fleet/{table}.{form}"
        assert f'href="{address}"' in page or table == "components"
        answer = designer.get(address)
        assert f'filename="{table}-GVK-6.{form}"' in answer.headers["content-disposition"]
    assert len(
        list(csv.reader(io.StringIO(designer.get(f"/types/GVK-6/fleet/{table}.csv").text)))
    ) == 1 + len(rows)
