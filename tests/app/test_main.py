import json
from pathlib import Path
from typing import Any

import httpx
import pytest
import sqlalchemy as sa
import structlog
from serving import NotingQueue, Service, running, wait_until

from app.main import Opening, create_app
from app.middleware import POLICY
from app.services import access
from app.services.opening import open_lab
from app.settings import Settings

PATHS = ["/api/v1/gyros", "/api/v1/nothing", "/api/v1/docs", "/health/live", "/metrics", "/sign-in", "/nothing",
         "/static/style.css"]  # fmt: skip


@pytest.fixture
def root(shared_service: Service) -> httpx.Client:
    return shared_service.client(None, "")


def test_an_empty_folder_becomes_a_laboratory(tmp_path: Path) -> None:
    settings = Settings(data=tmp_path / "new" / "lab")
    with running(settings, lambda settings: open_lab(settings, NotingQueue())) as service:
        assert service.client().get("/gyros").json() == {"items": [], "next": None}
    assert (settings.data / "driftbook.sqlite").exists()


def test_nothing_is_opened_before_the_service_starts(tmp_path: Path) -> None:
    create_app(Settings(data=tmp_path / "lab"))
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("path", PATHS)
def test_every_answer_carries_the_policy(root: httpx.Client, path: str) -> None:
    headers = root.get(path).headers
    assert headers["content-security-policy"] == POLICY
    assert headers["x-content-type-options"] == "nosniff"
    assert headers["referrer-policy"] == "same-origin"
    assert "strict-transport-security" not in headers  # reached without https


def test_the_policy_allows_nothing_inline_and_nothing_from_elsewhere() -> None:
    assert POLICY.startswith("default-src 'none'; script-src 'self'; style-src 'self'")
    assert "unsafe" not in POLICY
    assert "http" not in POLICY


def test_errors_are_pages_for_people_and_documents_for_programs(root: httpx.Client) -> None:
    assert root.get("/nothing").headers["content-type"].startswith("text/html")
    for path in ("/api/v1/nothing", "/api/v2/gyros", "/api/v1/gyros/%0A/x"):
        answer = root.get(path)
        assert answer.status_code == 404, path
        assert answer.headers["content-type"] == "application/problem+json"


def test_the_root_of_the_api_leads_to_its_pages(root: httpx.Client) -> None:
    answer = root.get("/api/v1", follow_redirects=True)
    assert (answer.status_code, answer.url.path) == (200, "/api/v1/docs")


def test_another_site_cannot_send_a_form(root: httpx.Client) -> None:
    foreign = {"sec-fetch-site": "cross-site", "origin": "https://elsewhere.example"}
    page = root.post("/sign-in", data={"name": "irina", "password": "x"}, headers=foreign)
    assert page.status_code == 403
    document = root.post("/api/v1/gyros", json={"serial": "1", "type": "1"}, headers=foreign)
    assert (document.status_code, document.json()["code"]) == (403, "cross-site")


def test_a_token_is_proof_enough(shared_service: Service) -> None:
    foreign = {"sec-fetch-site": "cross-site", "origin": "https://elsewhere.example"}
    answer = shared_service.client().post("/gyros", json={}, headers=foreign)
    assert answer.status_code == 422


def _break(service: Service) -> None:
    """Take the tables away under the running service."""
    with service.lab.database.engine.execution_options(writing=True).begin() as connection:
        connection.execute(sa.text("ALTER TABLE token RENAME TO gone"))
        connection.execute(sa.text("ALTER TABLE sign_in_link RENAME TO gone_too"))


def test_what_nobody_foresaw(service: Service) -> None:
    _break(service)
    answer = service.client().get("/gyros")
    assert answer.status_code == 500
    assert answer.headers["content-type"] == "application/problem+json"
    assert answer.headers["content-security-policy"] == POLICY
    assert answer.json()["code"] == "internal"
    assert "sqlite" not in answer.text.lower()  # how it failed is for the log
    page = service.client(None, "").get("/sign-in/link/unknown")
    assert page.status_code == 500
    assert page.headers["content-security-policy"] == POLICY


def test_the_log_holds_no_secret(
    settings: Settings, noting: Opening, capfd: pytest.CaptureFixture[str]
) -> None:
    with running(settings, noting) as service:
        with service.lab.write(access.SYSTEM) as work:
            access.add_account(work, "irina", "technician", "correct horse battery")
        root = service.client(None, "")
        service.client().get("/gyros?cursor=hidden-query")
        root.get("/sign-in/link/hidden-link")
        root.post("/sign-in", data={"name": "irina", "password": "correct horse battery"})
        secrets = [*service.tokens.values(), "hidden-query", "hidden-link", "correct horse"]
    log = capfd.readouterr().err
    assert log.count('"event": "request"') == 3
    assert '"path": "/sign-in/link/{secret}"' in log
    for secret in secrets:
        assert secret not in log


def test_a_traceback_shows_no_variables(
    settings: Settings, noting: Opening, capfd: pytest.CaptureFixture[str]
) -> None:
    with running(settings, noting) as service:
        _break(service)
        assert service.client().get("/gyros").status_code == 500
        secret = service.tokens["both"]
    log = capfd.readouterr().err
    assert "Traceback" in log
    assert secret not in log


def test_one_line_for_each_request(service: Service) -> None:
    def requests() -> list[Any]:
        return [line for line in lines if line["event"] == "request"]

    with structlog.testing.capture_logs() as lines:
        service.client().get("/gyros/0417")
        wait_until(requests)  # a line is written after its answer
        service.client(None, "").get("/sign-in/link/hidden-link")
        wait_until(lambda: len(requests()) > 1)
    api, page = [(line["method"], line["path"], line["status"]) for line in requests()]
    assert api == ("GET", "/api/v1/gyros/0417", 404)
    assert page[:2] == ("GET", "/sign-in/link/{secret}")
    assert "hidden" not in json.dumps(requests())
    assert all(line["duration_ms"] > 0 for line in requests())


def test_behind_a_proxy_the_configured_origin_counts(settings: Settings) -> None:
    proxied = Settings(data=settings.data, origin="https://lab.example")
    with running(proxied, lambda settings: open_lab(settings, NotingQueue())) as service:
        root = service.client(None, "")
        assert "strict-transport-security" in root.get("/health/live").headers
        sent = {"name": "irina", "password": "x"}
        ours = root.post("/sign-in", data=sent, headers={"origin": "https://lab.example"})
        other = root.post("/sign-in", data=sent, headers={"origin": service.url})
        assert (ours.status_code != 403, other.status_code) == (True, 403)
