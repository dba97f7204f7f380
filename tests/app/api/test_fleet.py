"""Fleets, comparisons and stands, asked by a program."""

import io
from datetime import UTC, datetime

import httpx
import numpy as np
import pyarrow.parquet as pq
import pytest
from serving import Service
from stand_tables import sessions, stored, turned

from app.services import access
from app.services.drift import series, studying
from app.services.lab import Lab
from app.store import drift

PARQUET = {"accept": "application/vnd.apache.parquet"}
CSV = {"accept": "text/csv"}


@pytest.fixture
def lab(service: Service, stand: httpx.Client) -> Lab:
    """Four gyros for half a year on stand S1, whose base turned by 200″."""
    with service.lab.write(access.SYSTEM) as work:
        table = turned(sessions(["0412", "0417", "0419", "0423"], 6, 4), 12, azimuth=200.0)
        stored(work, table, "S1")
        studying.follow_all_now(work)
    return service.lab


def _columns(answer: httpx.Response) -> list[str]:
    return list(pq.read_table(io.BytesIO(answer.content)).column_names)


def test_all_of_it_in_every_form(client: httpx.Client, lab: Lab) -> None:
    fleet = client.get("/types/GVK-6/fleet").json()
    assert [item["due"]["gyro"] for item in fleet["gyros"]] == ["0412", "0417", "0419", "0423"]
    assert fleet["gyros"][0]["parameters"]["w0x"]["value"]["value"] == pytest.approx(
        1.2, abs=0.2
    )  # 10 scatters
    assert len(fleet["correlations"]) == 28
    assert _columns(client.get("/types/GVK-6/fleet", headers=PARQUET))[0] == "gyro"
    assert client.get("/types/GVK-6/fleet", headers=CSV).text.startswith("gyro,type,check")
    assert client.get("/types/none/fleet").status_code == 404

    turns = client.get("/stands/S1/drift").json()
    assert [item["direction"] for item in turns["document"]["findings"]] == ["azimuth"]
    assert (len(turns["points"]), turns["by"], turns["up_to_date"]) == (24, "session", True)
    assert turns["alarms"][0]["kind"] == "stand-azimuth"
    assert 8 <= len(turns["affected"]) <= 16  # twelve sessions came after the turn
    assert len(client.get("/stands/S1/drift?by=month").json()["points"]) == 6
    assert client.get("/stands/S1/drift?by=moon").status_code == 422
    assert client.get("/stands/S9/drift").status_code == 404
    assert len(client.get("/stands/S1/drift", headers=CSV).text.splitlines()) == 25
    assert "azimuth_arcsec" in _columns(client.get("/stands/S1/drift", headers=PARQUET))

    found = client.get("/compare?a=session:1&b=gyro:0417").json()
    assert [item["parameter"] for item in found["parameters"]][:2] == ["kx", "ky"]
    assert found["verdict"] in ("agree", "differ")
    assert found["chi2"] is None  # these results hold no covariance
    assert _columns(client.get("/compare?a=session:1&b=session:2", headers=PARQUET))[0] == "parameter"
    assert client.get("/compare?a=session:1&b=session:1").status_code == 422
    assert client.get("/compare?a=session:1").status_code == 422
    assert client.get("/compare?a=session:1&b=session:999").status_code == 404


def test_points_that_are_left_out_are_told(client: httpx.Client, lab: Lab) -> None:
    """250 sessions of a stand, a day apart: more than are given at once."""
    with lab.write(access.SYSTEM) as work:
        (row,) = drift.studies(work.db, None, 1, whole=True)
        table = series.decode(row.series or b"")
        last, numbers = table["measured_at"][-1], np.arange(250)
        made = {name: np.repeat(column[-1:], 250) for name, column in table.columns.items()}
        made |= {"session": numbers + 1, "measured_at": last - (249 - numbers) * np.timedelta64(1, "D")}
        row.series = series.encode(series.SeriesTable(made))
    for by in ("session", "day"):
        found = client.get("/stands/S1/drift", params={"by": by}).json()
        assert (found["sessions"], found["reduced"]) == (250, True)
        assert [point["session"] for point in found["points"]] == list(range(51, 251))
    whole = client.get("/stands/S1/drift").json()
    assert (whole["by"], whole["reduced"]) == ("week", False)
    assert sum(point["sessions"] for point in whole["points"]) == 250
    assert len(client.get("/stands/S1/drift?by=day", headers=CSV).text.splitlines()) == 251


@pytest.mark.parametrize(
    ("address", "count", "first"),
    [
        ("/types/GVK-6/fleet/distributions", 8, "parameter"),
        ("/types/GVK-6/fleet/correlations", 28, "first"),
        ("/types/GVK-6/fleet/components", None, "parameter"),
        ("/stands/S1/drift/findings", 1, "verdict"),
        ("/gyros/0417/drift/trends", 8, "parameter"),
        ("/gyros/0417/drift/forecasts", None, "parameter"),
        ("/gyros/0417/drift/changes", None, "parameter"),
        ("/gyros/0417/drift/intervals", None, "method"),
    ],
)
def test_what_was_found_as_tables(
    client: httpx.Client, lab: Lab, address: str, count: int | None, first: str
) -> None:
    items = client.get(address).json()["items"]
    assert count in (None, len(items))
    lines = client.get(address, headers=CSV).text.splitlines()
    assert len(lines) == 1 + len(items)
    assert lines[0].split(",")[0] == first
    table = pq.read_table(io.BytesIO(client.get(address, headers=PARQUET).content))
    assert table.num_rows == len(items)
    assert not items or table.column_names == list(items[0])


def test_the_tables_hold_what_the_documents_do(client: httpx.Client, lab: Lab) -> None:
    fleet = client.get("/types/GVK-6/fleet").json()
    rows = client.get("/types/GVK-6/fleet/components").json()["items"]
    assert [(row["parameter"], row["source"], row["sd"]) for row in rows] == [
        (name, item["source"], item["sd"]) for name, found in fleet["pooled"].items() for item in found
    ]
    assert rows
    row = client.get("/types/GVK-6/fleet/distributions").json()["items"][4]
    whole = next(item for item in fleet["distributions"] if item["parameter"] == row["parameter"])
    assert [row["lower_quartile"], row["median"], row["upper_quartile"]] == whole["quartiles"]
    found = client.get("/stands/S1/drift").json()["document"]["findings"][0]
    (row,) = client.get("/stands/S1/drift/findings").json()["items"]
    assert (row["direction"], row["size_arcsec"], row["session"]) == (
        "azimuth", found["size_arcsec"], found["session"],
    )  # fmt: skip
    assert datetime.fromisoformat(row["until"]) == datetime.fromisoformat(found["until"])
    study = client.get("/gyros/0417/drift").json()["parameters"]
    bands = client.get("/gyros/0417/drift/forecasts").json()["items"]
    assert len(bands) == sum(len(item["study"]["forecast"]["at"]) for item in study)
    assert bands[0]["high"] == study[0]["study"]["forecast"]["high"][0]
    slopes = {
        row["parameter"]: row["slope_per_year"]
        for row in client.get("/gyros/0417/drift/trends").json()["items"]
    }
    assert slopes == {item["parameter"]: item["study"]["trend"]["slope_per_year"] for item in study}


def test_no_study_no_rows(client: httpx.Client, service: Service, stand: httpx.Client) -> None:
    assert client.get("/gyros/0417/drift/intervals").json() == {"items": [], "next": None}
    assert client.get("/gyros/0417/drift/nothing").status_code == 422
    assert client.get("/gyros/none/drift/changes").status_code == 404
    assert client.get("/stands/none/drift/findings").status_code == 404


def test_differences_are_in_units_of_their_uncertainty(client: httpx.Client, lab: Lab) -> None:
    found = client.get("/compare?a=session:1&b=session:2").json()
    item = next(item for item in found["parameters"] if item["parameter"] == "w0x")
    difference = item["a"]["value"] - item["b"]["value"]
    # u = 0.002 °/h of each, independent, no degrees of freedom stated: U = 1.96·√2·0.002 °/h; k = 2 in E_n
    assert item["difference"] == pytest.approx(difference)
    assert item["expanded_uncertainty"] == pytest.approx(1.959964 * 2**0.5 * 0.002, rel=1e-6)
    assert item["e_n"] == pytest.approx(difference / (2 * 2**0.5 * 0.002))
    assert item["verdict"] == ("differ" if abs(item["in_expanded"]) > 1 else "agree")
    assert datetime.fromisoformat(found["a"]["measured_at"]) < datetime(2025, 1, 1, tzinfo=UTC)
