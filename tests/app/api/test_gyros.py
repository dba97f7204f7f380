import csv
import io

import httpx


def test_a_gyro_is_registered_with_its_type(client: httpx.Client) -> None:
    made = client.post("/gyros", json={"serial": "0417", "type": "GVK-6"})
    assert made.status_code == 201
    assert made.headers["location"] == "/api/v1/gyros/0417"
    shown = client.get("/gyros/0417").json()
    assert shown == made.json()
    assert (shown["serial"], shown["type"], shown["last_result"]) == ("0417", "GVK-6", None)
    types = client.get("/types").json()["items"]
    assert types == [
        {"name": "GVK-6", "note": "", "gyros": 1, "interval_days": None, "limits": {}, "nominals": {}}
    ]


def test_a_serial_number_is_registered_once(client: httpx.Client) -> None:
    client.post("/gyros", json={"serial": "0417", "type": "GVK-6"})
    again = client.post("/gyros", json={"serial": "0417", "type": "GVK-6"})
    assert again.status_code == 409
    assert again.json()["code"] == "gyro-exists"
    assert again.json()["errors"][0]["pointer"] == "#/serial"


def test_a_name_with_a_slash_is_refused(client: httpx.Client) -> None:
    refused = client.post("/gyros", json={"serial": "04/17", "type": "GVK-6"})
    assert refused.status_code == 422
    assert refused.json()["code"] == "bad-name"


def test_letters_of_any_script_in_an_address(client: httpx.Client) -> None:
    made = client.post("/gyros", json={"serial": "ГВК 6%", "type": "ГВК"})
    assert client.get(made.headers["location"].removeprefix("/api/v1")).json()["serial"] == "ГВК 6%"


def test_type_and_note_are_corrected(client: httpx.Client) -> None:
    client.post("/gyros", json={"serial": "0417", "type": "GVK-6", "note": "new"})
    assert client.patch("/gyros/0417", json={"type": "GVK-7"}).json()["type"] == "GVK-7"
    changed = client.patch("/gyros/0417", json={"note": ""}).json()
    assert (changed["type"], changed["note"]) == ("GVK-7", "")


def test_a_list_comes_in_parts(client: httpx.Client) -> None:
    serials = [f"{number:04}" for number in range(7)]
    for serial in reversed(serials):
        client.post("/gyros", json={"serial": serial, "type": "A" if serial < "0004" else "B"})
    path, found = "/api/v1/gyros?limit=3", []
    while path:
        answer = client.get(path.removeprefix("/api/v1"))
        part = answer.json()
        assert len(part["items"]) <= 3
        found += [item["serial"] for item in part["items"]]
        path = part["next"]
        assert answer.headers.get("link") == (f'<{path}>; rel="next"' if path else None)
    assert found == serials


def test_the_filter_goes_on_to_the_next_part(client: httpx.Client) -> None:
    for number in range(4):
        client.post("/gyros", json={"serial": f"{number}", "type": "AB"[number % 2]})
    first = client.get("/gyros", params={"type": "A", "limit": 1}).json()
    second = client.get(first["next"].removeprefix("/api/v1")).json()
    assert [item["serial"] for item in first["items"] + second["items"]] == ["0", "2"]
    assert second["next"] is None


def test_as_csv(client: httpx.Client) -> None:
    client.post("/gyros", json={"serial": "0417", "type": "GVK-6", "note": 'comma, and "quotes"'})
    client.post("/gyros", json={"serial": "0418", "type": "GVK-6"})
    answer = client.get("/gyros?limit=1", headers={"accept": "text/csv"})
    assert answer.headers["content-type"].startswith("text/csv")
    rows = list(csv.DictReader(io.StringIO(answer.text)))
    assert [(row["serial"], row["note"]) for row in rows] == [("0417", 'comma, and "quotes"')]
    assert 'rel="next"' in answer.headers["link"]


def test_json_unless_csv_is_preferred(client: httpx.Client) -> None:
    for accept in ("*/*", "application/json", "text/csv;q=0.5, application/json", "image/png"):
        answer = client.get("/gyros", headers={"accept": accept})
        assert answer.headers["content-type"] == "application/json"


def test_limits_of_a_type(client: httpx.Client) -> None:
    made = client.put("/types/GVK-6/limits", json={"limits": {"wg": {"low": -3, "high": 3}}})
    assert made.status_code == 200
    assert made.json()["limits"] == {"wg": {"low": -3.0, "high": 3.0, "repeatability": None}}
    replaced = client.put("/types/GVK-6/limits", json={"limits": {"w0x": {"low": -1, "high": 1}}})
    assert list(replaced.json()["limits"]) == ["w0x"]
    for limits, code, pointer in (
        ({"wz": {"low": 0, "high": 1}}, "unknown-parameter", "#/limits/wz"),
        ({"a/b": {"low": 0, "high": 1}}, "unknown-parameter", "#/limits/a~1b"),
        ({"wg": {"low": 1, "high": 1}}, "bad-limit", "#/limits/wg"),
    ):
        refused = client.put("/types/GVK-6/limits", json={"limits": limits})
        assert refused.status_code == 422
        assert [(item["code"], item["pointer"]) for item in refused.json()["errors"]] == [(code, pointer)]


def test_history_of_a_gyro_that_was_never_solved(stand: httpx.Client) -> None:
    shown = stand.get("/gyros/0417/history?parameter=wg&from=&to=").json()
    assert shown["gyro"] == "0417"
    assert shown["series"] == [
        {"parameter": "wg", "unit": "deg/h/g", "low": None, "high": None, "points": []}
    ]
    every = stand.get("/gyros/0417/history").json()["series"]
    assert [item["parameter"] for item in every] == ["kx", "ky", "kxy", "kyx", "w0x", "w0y", "wg", "wk"]


def test_history_of_a_parameter_that_is_not(stand: httpx.Client) -> None:
    refused = stand.get("/gyros/0417/history?parameter=wz")
    assert (refused.status_code, refused.json()["code"]) == (422, "unknown-parameter")
    assert refused.json()["errors"][0]["parameter"] == "parameter"
