"""Every call of the API, whatever its noun: nobody, an unknown token, a scope that does not reach."""

import re

import httpx
import pytest
from serving import Service, described

CALLS = [(method.upper(), path) for path, methods in described()["paths"].items() for method in methods]


def called(client: httpx.Client, method: str, path: str) -> httpx.Response:
    return client.request(method, re.sub(r"\{\w+\}", "1", path))


def refused(answer: httpx.Response, status: int, code: str) -> None:
    assert answer.status_code == status, answer.text
    assert answer.headers["content-type"] == "application/problem+json"
    assert answer.json()["code"] == code


def test_calls_are_found() -> None:
    assert len(CALLS) > 20  # else the tests below would test nothing


@pytest.fixture(scope="module")
def service(shared_service: Service) -> Service:
    return shared_service


@pytest.mark.parametrize(("method", "path"), CALLS)
def test_without_a_token(service: Service, method: str, path: str) -> None:
    answer = called(service.client(token=None), method, path)
    refused(answer, 401, "no-token")
    assert answer.headers["www-authenticate"] == "Bearer"


@pytest.mark.parametrize(("method", "path"), CALLS)
def test_with_an_unknown_token(service: Service, method: str, path: str) -> None:
    refused(called(service.client(token="dbk_unknown"), method, path), 401, "bad-token")


@pytest.mark.parametrize(("method", "path"), CALLS)
def test_with_the_other_scope(service: Service, method: str, path: str) -> None:
    other = "upload" if method == "GET" else "read"
    refused(called(service.client(other), method, path), 403, "scope")
