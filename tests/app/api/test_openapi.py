"""The API against its own description, by drawn requests (Schemathesis)."""

from typing import Any

import pytest
import schemathesis
from hypothesis import HealthCheck, given, settings
from schemathesis.checks import not_a_server_error
from schemathesis.specs.openapi.checks import (
    content_type_conformance,
    response_schema_conformance,
    status_code_conformance,
)
from serving import Service, described, opened, ready

from app import api

DOCUMENT = described()
SCHEMA = schemathesis.openapi.from_dict(DOCUMENT)
OPERATIONS = [result.ok() for result in SCHEMA.get_all_operations()]
CHECKS = [
    not_a_server_error, status_code_conformance, content_type_conformance, response_schema_conformance,
]  # fmt: skip
REPORT = {
    "station": "S1-PC", "run": "a", "sequence": 1, "sent_at": "2026-03-01T09:30:00Z", "phase": "finished",
    "cells": [{"theta_deg": 0, "psi_deg": 0, "state": "recorded"}],
}  # fmt: skip


@pytest.fixture
def filled(service: Service) -> Service:
    """A laboratory with something at the first numbers, so that drawn requests find it."""
    client = ready(service.client())
    session_id = opened(client)
    client.put(f"/sessions/{session_id}/positions/0/0/means", json={"jx_ma": 0.1, "jy_ma": 0.2})
    client.post(f"/sessions/{session_id}/calibrations", json={})
    client.put(f"/sessions/{session_id}/station", json=REPORT)
    return service


@pytest.mark.parametrize("operation", OPERATIONS, ids=lambda operation: operation.label)
def test_drawn_requests(filled: Service, operation: Any) -> None:
    headers = {"authorization": f"Bearer {filled.tokens['both']}"}

    @settings(
        max_examples=12,
        derandomize=True,
        deadline=None,
        database=None,
        suppress_health_check=list(HealthCheck),
    )
    @given(case=operation.as_strategy())
    def check(case: Any) -> None:
        answer = case.call(base_url=filled.url + api.ROOT, headers=headers, timeout=20)
        case.validate_response(answer, checks=CHECKS)

    check()


def test_every_refusal_is_described_as_a_problem_document() -> None:
    for path, methods in DOCUMENT["paths"].items():
        for method, operation in methods.items():
            statuses = set(operation["responses"])
            assert {"401", "403", "422"} <= statuses, (method, path)
            assert "{" not in path or path.startswith("/types") or "404" in statuses, (method, path)
            for status, answer in operation["responses"].items():
                if status >= "400":
                    assert list(answer["content"]) == ["application/problem+json"]
                    assert answer["description"]


def test_every_json_body_has_an_example_that_its_schema_takes(filled: Service) -> None:
    schemas = DOCUMENT["components"]["schemas"]
    for methods in DOCUMENT["paths"].values():
        for operation in methods.values():
            content = operation.get("requestBody", {}).get("content", {}).get("application/json")
            if content:
                assert schemas[content["schema"]["$ref"].rsplit("/", 1)[1]]["examples"]


def test_the_document_needs_no_token(service: Service) -> None:
    answer = service.client(token=None).get("/openapi.json")
    assert answer.status_code == 200
    assert answer.json() == DOCUMENT
