"""One shape for every refusal, and a place for every problem."""

from typing import Any

import httpx
import pytest
from serving import Service

MEANS = "/sessions/1/positions/0/0/means"


@pytest.fixture
def client(shared_service: Service) -> httpx.Client:
    """A laboratory with nothing in it; nothing that is refused here leaves anything behind."""
    return shared_service.client()


def problem(answer: httpx.Response, status: int) -> dict[str, Any]:
    """The problem document, checked for its shape (RFC 9457)."""
    assert answer.status_code == status, answer.text
    assert answer.headers["content-type"] == "application/problem+json"
    document: dict[str, Any] = answer.json()
    assert set(document) == {"type", "title", "status", "detail", "code", "errors"}
    assert document["status"] == status
    assert document["type"].startswith("/api/v1/docs#")
    assert document["code"] == document["errors"][0]["code"]
    for error in document["errors"]:
        assert error["detail"]
        assert set(error) <= {"detail", "code", "pointer", "parameter", "header", "file", "row", "column"}
    return document


@pytest.mark.parametrize(
    ("body", "pointer", "code"),
    [
        ({"jy_ma": 1.0}, "#/jx_ma", "missing-field"),
        ({"jx_ma": "0.1", "jy_ma": 1.0}, "#/jx_ma", "not-a-number"),
        ({"jx_ma": True, "jy_ma": 1.0}, "#/jx_ma", "not-a-number"),
        ({"jx_ma": None, "jy_ma": 1.0}, "#/jx_ma", "not-a-number"),
        ({"jx_ma": 0.1, "jy_ma": 1.0, "duration_s": 0}, "#/duration_s", "too-small"),
        ({"jx_ma": 0.1, "jy_ma": 1.0, "u_jx_ma": -1e-9}, "#/u_jx_ma", "too-small"),
        ({"jx_ma": 0.1, "jy_ma": 1.0, "jz_ma": 1.0}, "#/jz_ma", "unknown-field"),
        ({"jx_ma": 0.1, "jy_ma": 1.0, "a/b~c": 1.0}, "#/a~1b~0c", "unknown-field"),
        ({"jx_ma": 0.1, "jy_ma": 1.0, "started_at": 5}, "#/started_at", "bad-time"),
        ({"jx_ma": 0.1, "jy_ma": 1.0, "started_at": "noon"}, "#/started_at", "bad-time"),
        ({"jx_ma": 0.1, "jy_ma": 1.0, "started_at": "0001-01-01T00:00:00+23:59"}, "#/started_at", "bad-time"),
        ({"jx_ma": 0.1, "jy_ma": 1.0, "repeat": 0.5}, "#/repeat", "not-a-whole-number"),
        ({"jx_ma": 0.1, "jy_ma": 1.0, "note": "\x00"}, "#/note", "bad-character"),
        ([], "#", "not-an-object"),
    ],
)
def test_a_field_is_named_by_a_pointer(client: httpx.Client, body: Any, pointer: str, code: str) -> None:
    document = problem(client.put(MEANS, json=body), 422)
    assert [(error["pointer"], error["code"]) for error in document["errors"]] == [(pointer, code)]


@pytest.mark.parametrize("value", ["NaN", "Infinity", "-Infinity", "1e400"])
def test_what_is_not_finite_is_refused(client: httpx.Client, value: str) -> None:
    text = f'{{"jx_ma": {value}, "jy_ma": 1}}'
    answer = client.put(MEANS, content=text, headers={"content-type": "application/json"})
    error = problem(answer, 422)["errors"][0]
    assert (error["pointer"], error["code"]) == ("#/jx_ma", "not-finite")


def test_every_problem_is_named_at_once(client: httpx.Client) -> None:
    document = problem(client.put(MEANS, json={"jx_ma": "a", "rate_hz": -1, "other": 1}), 422)
    assert {error["pointer"] for error in document["errors"]} == {
        "#/jx_ma",
        "#/jy_ma",
        "#/rate_hz",
        "#/other",
    }


@pytest.mark.parametrize(
    "text", ["{", '{"jx_ma": 01}', b"\xff", "[" * 100_000, '{"jx_ma": ' + "1" * 5000 + "}"]
)
def test_what_is_no_json(client: httpx.Client, text: str | bytes) -> None:
    answer = client.put(MEANS, content=text, headers={"content-type": "application/json"})
    problem(answer, 400)


def test_a_lone_surrogate_is_no_text(client: httpx.Client) -> None:
    answer = client.post(
        "/gyros",
        content=b'{"serial": "\\ud800", "type": "GVK-6"}',
        headers={"content-type": "application/json"},
    )
    assert problem(answer, 422)["errors"][0]["pointer"] == "#/serial"
    answer = client.post("/gyros", content=b'{"\\ud800": 1}', headers={"content-type": "application/json"})
    problem(answer, 422)


def test_another_kind_of_body(client: httpx.Client) -> None:
    assert problem(client.put(MEANS, data={"jx_ma": "1"}), 415)["code"] == "not-json"
    assert problem(client.put(MEANS, content=b'{"jx_ma": 1, "jy_ma": 1}'), 415)["code"] == "not-json"


def test_parameters_of_the_address(client: httpx.Client) -> None:
    for path, parameter in (
        ("/gyros?limit=0", "limit"),
        ("/gyros?typ=GVK-6", "typ"),
        ("/gyros?cursor=abc", "cursor"),
        ("/sessions?cursor=abc", "cursor"),
        ("/sessions/x", "session_id"),
        ("/sessions/99999999999999999999", "session_id"),
        ("/sessions?from=yesterday", "from"),
    ):
        error = problem(client.get(path), 422)["errors"][0]
        assert error["parameter"] == parameter
    refused = client.put("/sessions/1/positions/nan/0/means", json={"jx_ma": 1, "jy_ma": 1})
    assert problem(refused, 422)["errors"][0]["parameter"] == "theta_deg"


def test_addresses_and_methods_that_are_not_there(client: httpx.Client) -> None:
    problem(client.get("/nothing"), 404)
    refused = client.delete("/gyros")
    assert problem(refused, 405)["code"] == "wrong-method"
    assert set(refused.headers["allow"].split(", ")) <= {"GET", "POST"}


def test_json_is_read_up_to_a_bound(client: httpx.Client) -> None:
    body = b'{"serial": "' + b"1" * (9 * 2**20) + b'"}'
    answer = client.post("/gyros", content=body, headers={"content-type": "application/json"})
    assert problem(answer, 413)["code"] == "too-big"

    def pieces() -> Any:  # no Content-Length: counted as it comes
        yield b'{"serial": "'
        for _ in range(9):
            yield b"1" * 2**20

    answer = client.post("/gyros", content=pieces(), headers={"content-type": "application/json"})
    assert problem(answer, 413)["code"] == "too-big"


def test_what_is_not_there_is_named(client: httpx.Client) -> None:
    document = problem(client.post("/sessions", json={"gyro": "0417", "stand": "S1"}), 404)
    assert document["code"] == "unknown-gyro"
    assert document["errors"][0]["pointer"] == "#/gyro"
    for path in ("/gyros/0417", "/gyros/0417/history", "/stands/S1", "/stands/S1/certificates",
                 "/sessions/1", "/sessions/1/positions", "/calibrations/1", "/jobs/1", "/jobs/1/events"):  # fmt: skip
        problem(client.get(path), 404)
    problem(client.put(MEANS, json={"jx_ma": 1, "jy_ma": 1}), 404)
