"""The live state of a station over HTTP: what it sends, what it is told, who may ask it for something."""

import json
import threading
from typing import Any

import httpx
import pytest
from serving import GRID, Service

PLACES = [{"theta_deg": theta, "psi_deg": psi, "repeat": 0} for theta, psi in GRID]


def said(sequence: int, **changes: Any) -> dict[str, Any]:
    """A report of a run at its second position."""
    states = ["recorded", "running", *["todo"] * 14]
    return {
        "station": "S1-PC", "run": "run-a", "sequence": sequence, "sent_at": "2026-03-01T09:30:00Z",
        "phase": "acquiring", "position": PLACES[1] | {"take": 0}, "jx_ma": 0.0045, "jy_ma": -0.0021,
        "settled": True, "fraction": 0.25, "left_s": 900.0, "waiting": 1,
        "cells": [place | {"state": state} for place, state in zip(PLACES, states, strict=True)],
    } | changes  # fmt: skip


def event(number: int, **changes: Any) -> dict[str, Any]:
    return {
        "number": number, "at": "2026-03-01T09:29:00Z", "level": "warning", "code": "spike",
        "message": "The record has a spike.", "theta_deg": 0, "psi_deg": 0,
    } | changes  # fmt: skip


@pytest.fixture
def path(session_id: int) -> str:
    return f"/sessions/{session_id}/station"


def sent(client: httpx.Client, path: str, *reports: dict[str, Any]) -> dict[str, Any]:
    """The answer to the last of these reports."""
    for body in reports:
        answer = client.put(path, json=body)
        assert answer.status_code == 200, answer.text
    found: dict[str, Any] = answer.json()
    return found


def test_a_report_can_be_read_again(stand: httpx.Client, path: str) -> None:
    assert stand.get(path).status_code == 404
    assert stand.get(path).json()["code"] == "no-station"
    body = said(1, events=[event(1)])
    assert sent(stand, path, body) == {"commands": [], "events_seen": 1, "sequence": 1}
    now = stand.get(path).json()
    told = {name: body[name] for name in body.keys() - {"events"}}
    assert {name: now[name] for name in told} == told
    assert now["events"] == body["events"]
    assert (now["reported_by"], now["silent"], now["ended"]) == ("stand-both", False, False)
    assert 0 <= now["age_s"] < 5
    assert [(item["jx_ma"], item["jy_ma"], item["settled"]) for item in now["readings"]] == [
        (0.0045, -0.0021, True)
    ]


def test_the_least_that_a_report_says(stand: httpx.Client, path: str) -> None:
    least = {
        "station": "S1-PC", "run": "a", "sequence": 0, "sent_at": "2026-03-01T09:30:00Z", "phase": "checking",
    }  # fmt: skip
    assert sent(stand, path, least)["events_seen"] == 0
    now = stand.get(path).json()
    assert (now["position"], now["jx_ma"], now["cells"], now["readings"]) == (None, None, [], [])


def test_unknown_sessions(stand: httpx.Client) -> None:
    for answer in (
        stand.put("/sessions/77/station", json=said(1)), stand.get("/sessions/77/station"),
        stand.get("/sessions/77/station/events"),
        stand.post("/sessions/77/station/commands", json={"kind": "pause"}),
    ):  # fmt: skip
        assert (answer.status_code, answer.json()["code"]) == (404, "unknown-session")


@pytest.mark.parametrize(
    ("pointer", "changes"),
    [
        ("#/phase", {"phase": "sleeping"}),
        ("#/fraction", {"fraction": 1.01}),
        ("#/left_s", {"left_s": -1}),
        ("#/sequence", {"sequence": -1}),
        ("#/sequence", {"sequence": 2**53}),
        ("#/jx_ma", {"jx_ma": "0.1"}),
        ("#/run", {"run": ""}),
        ("#/settled", {"settled": "yes"}),
        ("#/mood", {"mood": "good"}),
        ("#/cells/0/state", {"cells": [PLACES[0] | {"state": "lost"}]}),
        ("#/cells", {"cells": [PLACES[0] | {"state": "todo"}] * 1001}),
        ("#/events", {"events": [event(number + 1) for number in range(201)]}),
        ("#/events/0/number", {"events": [event(0)]}),
        ("#/events/0/message", {"events": [event(1, message="x" * 4001)]}),
        ("#/done/0/outcome", {"done": [{"id": 1, "outcome": "perhaps", "message": ""}]}),
    ],
)  # fmt: skip
def test_what_cannot_be_used_is_named(
    stand: httpx.Client, path: str, pointer: str, changes: dict[str, Any]
) -> None:
    answer = stand.put(path, json=said(1) | changes)
    assert answer.status_code == 422
    assert answer.headers["content-type"] == "application/problem+json"
    assert [error["pointer"] for error in answer.json()["errors"]] == [pointer]
    assert stand.get(path).status_code == 404  # nothing of it was kept


def test_who_may(service: Service, stand: httpx.Client, path: str) -> None:
    sent(stand, path, said(1))
    reading, uploading = service.client("read"), service.client("upload")
    assert reading.put(path, json=said(2)).status_code == 403
    assert reading.post(f"{path}/commands", json={"kind": "pause"}).status_code == 403
    assert uploading.get(path).status_code == 403
    assert uploading.get(f"{path}/events").status_code == 403
    assert uploading.put(path, json=said(2)).status_code == 200
    assert service.client(None).put(path, json=said(3)).status_code == 401
    assert reading.get(path).json()["sequence"] == 2


def test_a_command_goes_out_until_it_is_answered(stand: httpx.Client, path: str) -> None:
    sent(stand, path, said(1))
    asked = stand.post(f"{path}/commands", json={"kind": "retake", "theta_deg": 90, "psi_deg": 180})
    assert asked.status_code == 201
    command = asked.json()
    assert (command["state"], command["asked_by"], command["answered_at"]) == ("open", "stand-both", None)
    told = {"id": command["id"], "kind": "retake", "theta_deg": 90, "psi_deg": 180}
    again = stand.post(f"{path}/commands", json={"kind": "retake", "theta_deg": 450, "psi_deg": -180})
    assert (again.status_code, again.json()) == (200, command)  # the same position, a turn further
    assert sent(stand, path, said(2))["commands"] == [told]
    assert sent(stand, path, said(3))["commands"] == [told]
    done = {"id": command["id"], "outcome": "refused", "message": "The stand is locked."}
    assert sent(stand, path, said(4, done=[done]))["commands"] == []
    found = stand.get(path).json()["commands"]
    assert [(item["state"], item["message"]) for item in found] == [("refused", "The stand is locked.")]
    assert found[0]["answered_at"] is not None


@pytest.mark.parametrize(
    ("status", "code", "body"),
    [
        (422, "position-not-in-run", {"kind": "retake", "theta_deg": 45, "psi_deg": 0}),
        (422, "no-position-named", {"kind": "retake"}),
        (422, "no-position-named", {"kind": "skip", "theta_deg": 90}),
        (422, "whole-run", {"kind": "stop", "theta_deg": 90, "psi_deg": 0}),
        (422, "unknown-choice", {"kind": "dance"}),
    ],
)
def test_commands_that_make_no_sense(
    stand: httpx.Client, path: str, status: int, code: str, body: dict[str, Any]
) -> None:
    sent(stand, path, said(1))
    answer = stand.post(f"{path}/commands", json=body)
    assert (answer.status_code, answer.json()["code"]) == (status, code)
    assert "pointer" in answer.json()["errors"][0]
    assert sent(stand, path, said(2))["commands"] == []


def test_an_ended_run_takes_no_command(stand: httpx.Client, path: str) -> None:
    assert stand.post(f"{path}/commands", json={"kind": "stop"}).json()["code"] == "no-station"
    sent(stand, path, said(1))
    stand.post(f"{path}/commands", json={"kind": "pause"})
    sent(stand, path, said(2, phase="failed"))
    answer = stand.post(f"{path}/commands", json={"kind": "stop"})
    assert (answer.status_code, answer.json()["code"]) == (409, "run-ended")
    assert [item["state"] for item in stand.get(path).json()["commands"]] == ["lapsed"]


def test_a_run_that_gave_way_is_told(stand: httpx.Client, path: str) -> None:
    sent(stand, path, said(5), said(1, run="run-b"))
    answer = stand.put(path, json=said(6))
    assert (answer.status_code, answer.json()["code"]) == (409, "run-superseded")
    assert stand.get(path).json()["run"] == "run-b"


def test_a_body_has_a_bound(stand: httpx.Client, path: str) -> None:
    answer = stand.put(path, json=said(1, station="x" * (9 * 2**20)))
    assert (answer.status_code, answer.json()["code"]) == (413, "too-big")


def test_fewer_events_on_request(stand: httpx.Client, path: str) -> None:
    sent(stand, path, said(1, events=[event(number) for number in (1, 2, 3)]))
    assert [item["number"] for item in stand.get(f"{path}?events=2").json()["events"]] == [3, 2]
    assert stand.get(f"{path}?events=1001").status_code == 422


def heard(lines: list[str]) -> list[dict[str, str]]:
    """Server-sent events as the standard reads them: fields, ended by an empty line."""
    found: list[dict[str, str]] = [{}]
    for line in lines:
        if not line:
            found.append({})
        elif not line.startswith(":"):
            name, _, value = line.partition(": ")
            found[-1][name] = value
    return [item for item in found if item]


def test_events_follow_a_run_to_its_end(stand: httpx.Client, service: Service, path: str) -> None:
    sent(stand, path, said(1))
    other, sequences = service.client(), iter(range(2, 100))

    def go_on() -> None:
        sent(other, path, said(next(sequences), fraction=0.5))
        other.post(f"{path}/commands", json={"kind": "stop"})
        sent(
            other,
            path,
            said(next(sequences), phase="stopped", done=[{"id": 1, "outcome": "done", "message": "Yes."}]),
        )

    worker = threading.Thread(target=go_on)
    with stand.stream("GET", f"{path}/events") as stream:
        assert stream.headers["content-type"].startswith("text/event-stream")
        lines = stream.iter_lines()
        received = [next(lines)]
        worker.start()
        received += list(lines)  # ends by itself
    worker.join()
    found = heard(received)
    assert [item["event"] for item in found] == ["station"] * (len(found) - 1) + ["end"]
    states = [json.loads(item["data"]) for item in found]
    assert (states[0]["phase"], states[-1]["phase"]) == ("acquiring", "stopped")
    assert [item["state"] for item in states[-1]["commands"]] == ["done"]
    assert len({item["id"] for item in found}) == len(found) - 1  # each state once, the end in the last one


def test_whoever_has_seen_a_state_is_not_told_again(stand: httpx.Client, path: str) -> None:
    sent(stand, path, said(1, phase="finished"))
    first = heard(stand.get(f"{path}/events").text.splitlines())
    again = heard(stand.get(f"{path}/events", headers={"last-event-id": first[0]["id"]}).text.splitlines())
    assert [item["event"] for item in first] == ["station", "end"]
    assert [item["event"] for item in again] == ["end"]
