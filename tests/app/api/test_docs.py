import re
from html.parser import HTMLParser

import httpx
import pytest
from serving import API, Service, described

from app.api.docs import KINDS


@pytest.fixture(scope="module")
def page(shared_service: Service) -> httpx.Response:
    return shared_service.client(token=None).get("/docs")


class Links(HTMLParser):
    def __init__(self) -> None:
        super().__init__()
        self.targets: list[str] = []
        self.anchors: set[str] = set()
        self.tags: set[str] = set()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.add(tag)
        given = dict(attrs)
        self.targets += [value for name in ("href", "src") if (value := given.get(name))]
        if identity := given.get("id"):
            assert identity not in self.anchors
            self.anchors.add(identity)
        assert "style" not in given  # the policy allows none inline


def test_every_call_stands_on_the_page(page: httpx.Response) -> None:
    assert page.status_code == 200
    for path, methods in described()["paths"].items():
        for method in methods:
            assert f"{method.upper()} {path}" in page.text
    assert f"under <code>{API}</code>" in page.text


def test_nothing_comes_from_elsewhere(shared_service: Service, page: httpx.Response) -> None:
    links = Links()
    links.feed(page.text)
    assert not links.tags & {"script", "style", "iframe"}
    root = shared_service.client(None, "")
    for target in links.targets:
        if target.startswith("#"):
            assert target[1:] in links.anchors
        else:
            assert target.startswith("/")
            assert root.get(target, follow_redirects=True).status_code == 200, target


def test_every_kind_of_problem_is_explained(page: httpx.Response, shared_service: Service) -> None:
    for kind in KINDS:
        assert f'id="{kind}"' in page.text
    client = shared_service.client()
    refusals = [
        client.get("/gyros/0417"), client.get("/nothing"), client.delete("/gyros"), client.get("/gyros?limit=x"),
        client.post("/gyros", content=b"{", headers={"content-type": "application/json"}),
        client.post("/gyros", content=b"x"), shared_service.client(None).get("/gyros"),
        shared_service.client("read").post("/gyros", json={"serial": "1", "type": "1"}),
    ]  # fmt: skip
    kinds = {re.sub(r".*#", "", answer.json()["type"]) for answer in refusals}
    assert len(kinds) == 7  # unknown gyro and unknown address are one
    assert kinds <= set(KINDS)
