"""What a type says of its gyros: limits, repeatability, interval, nominal values."""

from typing import Any

import httpx
import pytest

KX = {"value": 2063.0, "standard_uncertainty": 21.0, "per_kelvin": -0.4}
WG = {"value": -6.0, "standard_uncertainty": 3.0}


def test_nominal_values_are_set_shown_and_replaced(client: httpx.Client) -> None:
    client.put("/types/GVK-6/limits", json={"limits": {"wg": {"low": -3, "high": 3}}})
    made = client.put("/types/GVK-6/nominals", json={"nominals": {"kx": KX, "wg": WG}})
    assert made.status_code == 200, made.text
    assert made.json()["nominals"] == {"kx": KX, "wg": WG | {"per_kelvin": None}}
    assert made.json()["limits"] == {"wg": {"low": -3.0, "high": 3.0, "repeatability": None}}
    assert client.get("/types").json()["items"] == [made.json()]
    again = client.put("/types/GVK-6/nominals", json={"nominals": {"kx": KX | {"value": 2060}}})
    assert again.json()["nominals"] == {"kx": KX | {"value": 2060.0}}
    assert client.put("/types/GVK-6/nominals", json={"nominals": {}}).json()["nominals"] == {}


def test_an_unknown_type_is_created(client: httpx.Client) -> None:
    made = client.put("/types/ DTG-4 /nominals", json={"nominals": {"kx": KX}}).json()
    assert (made["name"], made["gyros"]) == ("DTG-4", 0)


@pytest.mark.parametrize(
    ("nominals", "pointer", "code"),
    [
        ({"wz": WG}, "#/nominals/wz", "unknown-parameter"),
        ({"a/b": WG}, "#/nominals/a~1b", "unknown-parameter"),
        ({"wg": WG | {"standard_uncertainty": 0}}, "#/nominals/wg/standard_uncertainty", "too-small"),
        ({"wg": {"value": 1}}, "#/nominals/wg/standard_uncertainty", "missing-field"),
        ({"wg": WG | {"value": "6"}}, "#/nominals/wg/value", "not-a-number"),
        ({"wg": WG | {"per_k": 1}}, "#/nominals/wg/per_k", "unknown-field"),
        ([], "#/nominals", "not-an-object"),
    ],
)
def test_nominal_values_that_cannot_be(client: httpx.Client, nominals: Any, pointer: str, code: str) -> None:
    refused = client.put("/types/GVK-6/nominals", json={"nominals": nominals})
    assert refused.status_code == 422, refused.text
    assert [(item["pointer"], item["code"]) for item in refused.json()["errors"]] == [(pointer, code)]
    assert client.get("/types").json()["items"] == []


def test_limits_carry_the_repeatability(client: httpx.Client) -> None:
    limit = {"low": -3.0, "high": 3.0, "repeatability": 0.05}
    made = client.put("/types/GVK-6/limits", json={"limits": {"w0x": limit}}).json()
    assert made["limits"] == {"w0x": limit}
    refused = client.put("/types/GVK-6/limits", json={"limits": {"w0x": limit | {"repeatability": 0}}})
    assert refused.status_code == 422
    assert refused.json()["errors"][0]["pointer"] == "#/limits/w0x/repeatability"


def test_an_interval_is_set_and_taken_away(client: httpx.Client) -> None:
    assert client.put("/types/GVK-6/interval", json={"days": 365}).json()["interval_days"] == 365
    assert client.put("/types/GVK-6/interval", json={"days": None}).json()["interval_days"] is None
    for days in (0, 3661, 1.5, "365"):
        assert client.put("/types/GVK-6/interval", json={"days": days}).status_code == 422


def test_a_gyro_is_made_a_check_gyro(client: httpx.Client) -> None:
    made = client.post("/gyros", json={"serial": "0400", "type": "GVK-6", "check": True}).json()
    assert made["check"] is True
    assert client.patch("/gyros/0400", json={"note": "spare"}).json()["check"] is True
    assert client.patch("/gyros/0400", json={"check": False}).json()["check"] is False
