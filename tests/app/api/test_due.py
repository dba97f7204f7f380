"""What is to be calibrated next, asked by a program."""

import csv
import io

import httpx
import pyarrow.parquet as pq


def test_the_list_in_every_form(client: httpx.Client) -> None:
    for serial in ("0417", "0418"):
        client.post("/gyros", json={"serial": serial, "type": "GVK-6"})
    client.post("/gyros", json={"serial": "D-031", "type": "DTG-4"})
    items = client.get("/due").json()["items"]
    assert [(item["gyro"], item["state"], item["due"]) for item in items] == [
        ("0417", "never", None), ("0418", "never", None), ("D-031", "never", None),
    ]  # fmt: skip
    assert [item["gyro"] for item in client.get("/due?type=DTG-4").json()["items"]] == ["D-031"]
    assert client.get("/due?state=overdue").json() == {"items": [], "next": None}
    first = client.get("/due?limit=2", headers={"accept": "text/csv"})
    assert [row["gyro"] for row in csv.DictReader(io.StringIO(first.text))] == ["0417", "0418"]
    assert 'rel="next"' in first.headers["link"]
    table = client.get("/due", headers={"accept": "application/vnd.apache.parquet"})
    assert table.headers["content-type"] == "application/vnd.apache.parquet"
    assert pq.read_table(io.BytesIO(table.content))["gyro"].to_pylist() == ["0417", "0418", "D-031"]


def test_a_selection_that_cannot_be(client: httpx.Client) -> None:
    assert client.get("/due?state=soon").status_code == 422
    assert client.get("/due?cursor=x").status_code == 422
