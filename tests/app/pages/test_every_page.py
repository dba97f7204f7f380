"""What holds for every page, whoever asks for it."""

import re
from datetime import UTC, datetime
from html.parser import HTMLParser
from pathlib import Path

import pytest
from fastapi.testclient import TestClient

from app.pages.base import TEMPLATES
from app.services import access, calibrations, live
from app.services.lab import Lab
from app.services.live_views import CellState, Report, RunEvent, Sentence, Spot
from app.services.sessions import NewSession, open_session

READABLE = [
    "/", "/gyros", "/types/GVK-6", "/stands", "/stands/S1", "/stands/S1/uncertainty", "/certificates",
    "/stands/S1/plan", "/stands/S1/plan?mode=propose", "/stands/S1/plan?view=counts", "/stands/S1/plan?view=trade",
    "/certificates/S1/C-17", "/method", "/validation", "/sessions", "/results", "/gyros/0417",
    "/gyros/0417/drift/w0x", "/gyros/0417/baseline", "/alarms", "/alarms?state=all",
    "/types/GVK-6/fleet", "/stands/S1/drift", "/compare", "/compare?a=gyro:0417",
    "/loop", "/loop?start=printed",
]  # fmt: skip
WRITABLE = [
    "/sessions/new",
    "/gyros/new",
    "/gyros/0417/edit",
    "/gyros/0417/events/new",
    "/stands/S1/events/new",
    "/stands/new",
    "/certificates/new",
    "/simulations/new",
]
POSTED = [
    "/gyros/new",
    "/gyros/0417/edit",
    "/gyros/0417/events/new",
    "/stands/S1/events/new",
    "/types/GVK-6",
    "/stands/new",
    "/stands/S1/uncertainty",
    "/certificates/new",
    "/simulations/new",
]

AT = datetime(2026, 3, 1, 9, 30, tzinfo=UTC)
RUNNING = Report(
    "S1-PC", "run-a", 1, AT, "acquiring", Spot(0.0, 90.0, 0, 0), 0.0045, -0.0021, True, 0.5, 605.0, 2,
    (CellState(0.0, 0.0, 0, "suspicious"), CellState(0.0, 90.0, 0, "running"), CellState(90.0, 0.0, 0, "todo")),
    (RunEvent(1, AT, "warning", "spike", Sentence("The record has a spike."), 0.0, 0.0),),
)  # fmt: skip


class Outline(HTMLParser):
    """Notes what a page must not have, and what everything in it needs."""

    def __init__(self) -> None:
        super().__init__()
        self.tags: list[str] = []
        self.forbidden: list[str] = []
        self.unnamed: list[str] = []
        self.ids: list[str] = []
        self.labelled: set[str] = set()
        self.inputs: list[dict[str, str | None]] = []
        self.primaries = 0
        self._in_script = False

    def handle_starttag(self, tag: str, attributes: list[tuple[str, str | None]]) -> None:
        given = dict(attributes)
        self.tags.append(tag)
        self._in_script = tag == "script"
        for name in given:
            if name == "style" or name.startswith("on"):
                self.forbidden.append(f"<{tag} {name}>")
        if tag == "style" or (tag == "script" and not given.get("src")):
            self.forbidden.append(f"<{tag}>")
        for name in ("src", "href"):
            if (given.get(name) or "").startswith(("http:", "https:", "//")):
                self.forbidden.append(f"{name}={given[name]}")
        if "id" in given:
            self.ids.append(given["id"] or "")
        if tag == "label":
            self.labelled.add(given.get("for") or "")
        if tag in ("input", "select", "textarea") and given.get("type") not in ("hidden", "checkbox"):
            self.inputs.append(given)
        self.primaries += "primary" in (given.get("class") or "").split()

    def nameless(self) -> list[str]:
        return [
            str(field.get("name"))
            for field in self.inputs
            if not field.get("aria-label")
            and not field.get("aria-labelledby")
            and field.get("id") not in self.labelled
        ]


def test_nobody_reads_without_signing_in(anonymous: TestClient, stocked: Lab) -> None:
    for path in (*READABLE, *WRITABLE):
        answer = anonymous.get(path)
        assert answer.status_code == 303, path
        assert answer.headers["location"].startswith("/sign-in")


def test_whoever_may_only_read_reads(designer: TestClient, stocked: Lab) -> None:
    assert [designer.get(path).status_code for path in READABLE] == [200] * len(READABLE)


def test_whoever_may_only_read_gets_no_form(designer: TestClient, stocked: Lab) -> None:
    for path in WRITABLE:
        answer = designer.get(path)
        assert answer.status_code == 403, path
        assert "This needs the scope “upload”" in answer.text
        assert 'href="/gyros"' in answer.text  # the navigation is still there


def test_whoever_may_only_read_changes_nothing(designer: TestClient, stocked: Lab) -> None:
    sent = {"serial": "1", "type": "T", "name": "S2", "latitude_deg": "1"}
    assert [designer.post(path, data=sent).status_code for path in POSTED] == [403] * len(POSTED)


@pytest.mark.parametrize("language", ["en", "ru"])
def test_pages_are_clean_and_named(technician: TestClient, stocked: Lab, language: str) -> None:
    for path in (*READABLE, *WRITABLE):
        answer = technician.get(path, headers={"accept-language": language})
        assert answer.status_code == 200, path
        outline = Outline()
        outline.feed(answer.text)
        assert f'<html lang="{language}"' in answer.text
        assert outline.forbidden == [], path
        assert len(outline.ids) == len(set(outline.ids)), path
        assert outline.nameless() == [], path
        assert outline.primaries <= 1, path
        assert outline.tags.count("h1") == 1, path
        assert outline.tags.count("main") == 1, path


def test_pages_of_a_measured_session_are_clean_and_named(
    technician: TestClient, stocked: Lab, measured: int, result: int
) -> None:
    with stocked.write(access.SYSTEM) as work:
        first = calibrations.calibration(work, result).inputs[0].id
        watched = open_session(work, NewSession("0417", "S1")).id
        live.report(work, watched, RUNNING)
    paths = [
        f"/sessions/{measured}/live", f"/sessions/{watched}/live", f"/sessions/{watched}", "/",
        "/sessions", f"/sessions/{measured}", f"/sessions/{measured}/entry",
        f"/sessions/{measured}/entry?unit=ma&columns=all", "/results", f"/results/{result}", "/gyros/0417",
        f"/measurements/{first}",
    ]  # fmt: skip
    for path in paths:
        outline = Outline()
        text = technician.get(path).text
        outline.feed(text)
        assert outline.forbidden == [], path
        assert len(outline.ids) == len(set(outline.ids)), path
        assert outline.nameless() == [], path
        assert outline.primaries <= 1, path
        assert outline.tags.count("h1") == 1, path


def test_russian_pages_speak_russian(technician: TestClient, stocked: Lab) -> None:
    for path in READABLE:
        text = technician.get(path, headers={"accept-language": "ru"}).text
        main = re.sub(r"<[^>]+>", " ", text[text.index("<main") :])
        russian, latin = len(re.findall(r"[а-яё]", main)), len(re.findall(r"\b[a-z]{4,}\b", main))
        assert russian > 5 * latin, path


@pytest.mark.parametrize("template", sorted(TEMPLATES.rglob("*.html")), ids=lambda path: str(path.name))
def test_no_template_has_style_or_script_inside(template: Path) -> None:
    text = template.read_text(encoding="utf-8")
    assert not re.search(r"\sstyle=|<style|\son[a-z]+=\"|hx-on|javascript:", text)
    assert not re.search(r"<script(?![^>]*\ssrc=)", text)
