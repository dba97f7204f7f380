from pathlib import Path

import pytest
from fastapi.testclient import TestClient

from app.pages import assets
from app.services.lab import Lab


@pytest.fixture
def made(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Calls for the bundle: making the real one takes seconds, and browser tests draw with it."""
    calls: list[str] = []

    def bundle(snippet: str) -> str:
        calls.append(snippet)
        return "// the bundle"

    monkeypatch.setattr("vl_convert.javascript_bundle", bundle)
    return calls


def test_the_bundle_is_made_once_and_kept(anonymous: TestClient, lab: Lab, made: list[str]) -> None:
    first = anonymous.get("/lib/vega.js?v=1")
    assert first.text == "// the bundle"
    assert first.headers["content-type"].startswith("text/javascript")
    assert "immutable" in first.headers["cache-control"]
    assert anonymous.get("/lib/vega.js").text == "// the bundle"
    assert len(made) == 1
    (kept,) = Path(lab.settings.data, "cache").iterdir()
    assert kept.read_text() == "// the bundle"
    again = anonymous.get("/lib/vega.js", headers={"if-none-match": first.headers["etag"]})
    assert (again.status_code, again.content) == (304, b"")


def test_the_bundle_of_another_version_is_not_taken(lab: Lab, made: list[str]) -> None:
    folder = lab.settings.data / "cache"
    folder.mkdir()
    (folder / "vega-0.0.js").write_text("old")
    assert assets._bundle(folder / "vega-1.0.js") == b"// the bundle"


def test_files_of_others_come_from_their_packages(anonymous: TestClient) -> None:
    for name in ("htmx-2.min.js", "ext/hx-sse-2.min.js"):
        answer = anonymous.get(f"/lib/htmx/{name}")
        assert answer.status_code == 200
        assert "javascript" in answer.headers["content-type"]


def test_our_files_carry_their_digest(anonymous: TestClient) -> None:
    page = anonymous.get("/sign-in").text
    for name in ("style.css", "app.js", "icon.svg"):
        address = page.split(f"/static/{name}?v=")[1].split('"')[0]
        assert len(address) == 12
        assert anonymous.get(f"/static/{name}?v={address}").status_code == 200
