import shutil
from pathlib import Path

import httpx
import pytest
import sqlalchemy as sa
from serving import Service, running

from app.main import Opening
from app.settings import Settings


@pytest.fixture
def root(service: Service) -> httpx.Client:
    """Nobody in particular, at the root."""
    return service.client(None, "")


def test_alive(root: httpx.Client) -> None:
    answer = root.get("/health/live")
    assert (answer.status_code, answer.json()) == (200, {"status": "alive"})


def test_ready(root: httpx.Client) -> None:
    answer = root.get("/health/ready")
    assert answer.status_code == 200
    assert answer.json() == {"status": "ready", "checks": {"database": "ok", "data": "ok"}}


def test_not_ready_when_a_migration_is_missing(service: Service, root: httpx.Client) -> None:
    with service.lab.database.engine.begin() as connection:
        connection.execute(sa.text("UPDATE alembic_version SET version_num = 'older'"))
    answer = root.get("/health/ready")
    assert answer.status_code == 503
    assert "driftbook migrate" in answer.json()["checks"]["database"]
    assert root.get("/health/live").status_code == 200


def test_not_ready_without_its_folder(service: Service, root: httpx.Client) -> None:
    shutil.rmtree(service.lab.settings.uploads)
    answer = root.get("/health/ready")
    assert answer.status_code == 503
    assert answer.json()["checks"]["data"] != "ok"
    assert str(Path(service.lab.settings.data)) not in answer.text  # nobody has to know where


def test_metrics(settings: Settings, noting: Opening) -> None:
    with running(settings, noting) as service:
        root = service.client(None, "")
        service.client().get("/gyros/0417")
        service.client().get("/gyros/0418")
        root.get("/who/knows")
        text = root.get("/metrics").text
    lines = text.splitlines()
    assert (
        'driftbook_http_requests_total{method="GET",route="/api/v1/gyros/{serial}",status="404"} 2.0' in lines
    )
    assert 'driftbook_http_requests_total{method="GET",route="-",status="404"} 1.0' in lines
    assert "gyros/0417" not in text  # a route, not each address that somebody asks for
    assert "# TYPE driftbook_jobs gauge" in lines
