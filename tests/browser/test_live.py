"""The live page in a browser: it follows the station, asks it for things, and says when it hears nothing."""

import subprocess
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import httpx
import pytest
from playwright.sync_api import Page, expect

pytestmark = pytest.mark.browser

GRID = [(theta, psi) for theta in (0, 90, 180, 270) for psi in (0, 90, 180, 270)]
STATES = ["recorded"] * 6 + ["suspicious", "skipped", "refused", "recorded", "running"] + ["todo"] * 5
EVENT = {
    "at": "2026-03-01T09:30:00Z", "code": "spike", "theta_deg": 90, "psi_deg": 180,
    "message": "The record has a spike of 41 standard deviations; it is measured again, and kept beside the first.",
}  # fmt: skip
WAYS = {
    "desk-light-en": {"viewport": {"width": 1280, "height": 720}, "color_scheme": "light", "locale": "en-GB"},
    "desk-dark-ru": {"viewport": {"width": 1280, "height": 720}, "color_scheme": "dark", "locale": "ru-RU"},
    "phone-light-ru": {"viewport": {"width": 390, "height": 844}, "color_scheme": "light", "locale": "ru-RU"},
    "phone-dark-en": {"viewport": {"width": 390, "height": 844}, "color_scheme": "dark", "locale": "en-GB"},
}
EXAMINED = ("desk-light-en", "phone-dark-en")
"""Ways in which axe looks: both themes, both sizes. A language changes no role and no contrast."""


@dataclass
class Stand:
    """A laboratory with an open session, and the program of its stand, as far as the service hears of it."""

    data: Path
    process: subprocess.Popen[str]
    url: str
    password: str
    client: httpx.Client
    session: int = 0
    sequence: int = 0

    @property
    def page(self) -> str:
        """Address of the live page."""
        return f"{self.url}/sessions/{self.session}/live"

    def report(self, **changes: Any) -> dict[str, Any]:
        """Report; what is asked comes back."""
        self.sequence += 1
        body = {
            "station": "S1-PC", "run": "a", "sequence": self.sequence, "sent_at": datetime.now(UTC).isoformat(),
            "phase": "acquiring", "position": {"theta_deg": 180, "psi_deg": 180}, "settled": True, "fraction": 0.25,
            "jx_ma": -7.41e-4 + 1e-6 * (self.sequence % 3), "jy_ma": 4.4946e-3, "left_s": 605, "waiting": 2,
            "cells": [{"theta_deg": theta, "psi_deg": psi, "state": state}
                      for (theta, psi), state in zip(GRID, STATES, strict=True)],
        }  # fmt: skip
        answer = self.client.put(f"{self.url}/api/v1/sessions/{self.session}/station", json=body | changes)
        assert answer.status_code == 200, answer.text
        found: dict[str, Any] = answer.json()
        return found

    def open_session(self) -> None:
        """A further session, which no station has reported in."""
        made = self.client.post(f"{self.url}/api/v1/sessions", json={"gyro": "0417", "stand": "S1"})
        self.session, self.sequence = made.json()["id"], 0

    def sign_in(self, page: Page) -> None:
        """Sign in as a technician."""
        page.goto(self.url + "/sign-in")
        page.locator("#f-name").fill("petrova")
        page.locator("#f-password").fill(self.password)
        page.locator("main button[type=submit]").click()
        expect(page.locator("nav .places").first).to_be_attached()


expect.set_options(timeout=20_000)  # the tests' machine may be busy


def said(*arguments: str) -> str:
    """What a command prints."""
    command = [sys.executable, "-m", "app", *arguments]
    return subprocess.run(command, check=True, capture_output=True, text=True).stdout.strip()


@pytest.fixture(scope="module")
def measuring(
    tmp_path_factory: pytest.TempPathFactory, serve: Callable[..., tuple[subprocess.Popen[str], str]]
) -> Iterator[Stand]:
    """The laboratory, for all tests of this file."""
    data = tmp_path_factory.mktemp("measuring") / "data"
    password = said("user", "add", "petrova", "--role", "technician", "--data", str(data))
    token = said("token", "create", "stand", "--scope", "read,upload", "--data", str(data))
    process, url = serve(data)
    with httpx.Client(headers={"authorization": f"Bearer {token}"}, timeout=30) as client:
        positions = [
            {"theta_deg": theta, "psi_deg": psi, "alpha_arcsec": 1, "beta_arcsec": 2, "gamma_arcsec": 3}
            for theta, psi in GRID
        ]
        valid = {"number": "C-17", "valid_from": "2000-01-01", "valid_until": "2100-01-01"}
        client.post(f"{url}/api/v1/gyros", json={"serial": "0417", "type": "GVK-6"})
        client.post(f"{url}/api/v1/stands", json={"name": "S1", "latitude_deg": 55.7558})
        client.post(f"{url}/api/v1/stands/S1/certificates", json=valid | {"positions": positions})
        yield Stand(data, process, url, password, client)


@pytest.fixture
def stand(measuring: Stand) -> Stand:
    """The laboratory with a session of this test's own."""
    measuring.open_session()
    return measuring


def fits(page: Page) -> bool:
    return bool(page.evaluate("document.documentElement.scrollWidth <= document.documentElement.clientWidth"))


@pytest.mark.parametrize("way", WAYS)
def test_every_state_keeps_the_policy_and_is_open_to_everybody(
    stand, open_context, accessible, screenshot, way
):
    page = open_context(**WAYS[way]).new_page()
    stand.sign_in(page)
    examined = accessible if way in EXAMINED else lambda page: None
    page.goto(stand.page)
    examined(page)
    assert fits(page)
    for name, changes in {
        "moving": {"phase": "moving", "settled": None, "jx_ma": None, "jy_ma": None, "fraction": None},
        "settling": {"phase": "settling", "settled": False},
        "recording": {"events": [EVENT | {"number": 1, "level": "warning"}, EVENT | {"number": 2, "level": "error"}]},
        "paused": {"phase": "paused"},
        "stopped": {"phase": "stopped", "position": None},
        "finished": {"phase": "finished", "position": None, "waiting": 0},
    }.items():  # fmt: skip
        stand.report(**changes)
        page.goto(stand.page)
        for chart in page.locator("[data-chart]").all():
            chart.locator("svg").first.wait_for()
        examined(page)
        assert fits(page), name
        screenshot(page, f"live-{name}-{way}")
    stand.open_session()
    stand.report(events=[EVENT | {"number": 1, "level": "warning"}])
    page.goto(stand.url)
    expect(page.locator("h1")).to_contain_text("11")
    examined(page)
    assert fits(page)
    screenshot(page, f"live-today-{way}")


def test_the_page_follows_and_asks_without_being_loaded_again(stand, open_context):
    stand.report(phase="settling", settled=False)
    page = open_context().new_page()
    stand.sign_in(page)
    page.goto(stand.page)
    page.evaluate("window.notLoadedAgain = true")
    drawing = page.locator(".live-chart svg").first
    drawing.wait_for()
    page.evaluate("window.drawing = document.querySelector('.live-chart svg')")
    page.get_by_text("Stop the run").click()
    stand.report(phase="settling", settled=False)  # fresh, however slow the page was
    expect(page.locator(".settled .mark")).to_have_text("Settling")

    line = page.locator(".live-chart path[stroke-width='1.5']").first
    before = line.get_attribute("d")
    stand.report()
    stand.report()
    expect(page.locator(".settled .mark")).to_have_text("Settled")
    expect(line).not_to_have_attribute("d", str(before))
    page.locator("#live-next").click()
    expect(page.locator(".asked li")).to_contain_text("waiting for the station")
    (command,) = stand.report()["commands"]
    assert command["kind"] == "pause"
    stand.report(
        phase="paused", done=[{"id": command["id"], "outcome": "done", "message": "The cycle waits."}]
    )
    expect(page.locator(".asked li")).to_contain_text("done The cycle waits.")
    expect(page.locator("#live-next")).to_have_text("Resume")
    expect(page.locator("#live-next")).to_be_focused()  # what was pressed is still under the hand

    page.locator("#cell-3").click()
    expect(page.locator(".cell.due")).to_contain_text("to retake")
    assert [item["kind"] for item in stand.report(phase="paused")["commands"]] == ["retake"]
    page.get_by_role("button", name="Stop now").click()  # still open: nothing that is being read closes
    expect(page.locator(".asked li").first).to_contain_text("Stop the run")
    stand.report(phase="finished")
    expect(page.locator(".settled .mark")).to_have_text(
        "Finished without a calibration"
    )  # the station asked for none
    expect(page.get_by_role("button", name="Stop now")).to_have_count(0)
    assert page.evaluate(
        "window.notLoadedAgain && window.drawing === document.querySelector('.live-chart svg')"
    )
    page.wait_for_timeout(6000)  # longer than silence is taken for a lost connection: the end is not silence
    expect(page.locator("[data-lost]")).to_be_hidden()


def test_the_first_report_opens_the_page_by_itself(stand, open_context):
    page = open_context().new_page()
    stand.sign_in(page)
    page.goto(stand.page)
    expect(page.locator("h1")).to_contain_text("No station measures")
    stand.report()
    expect(page.locator("h1")).to_have_text("Position 11 of 16")
    stand.report(phase="paused")
    expect(page.locator(".settled .mark")).to_have_text("Paused")


def test_a_silent_station_and_a_lost_connection_show(stand, serve, open_context, complaints):
    stand.report()
    page = open_context().new_page()
    stand.sign_in(page)
    page.goto(stand.page)
    stand.report()
    expect(page.locator(".age .mark")).to_contain_text("Live, updated")
    expect(page.locator(".age .mark")).to_contain_text("no word since")  # after 5 s
    expect(page.locator(".settled .mark")).to_have_text("No word from the station")
    expect(page.locator("[data-lost]")).to_be_hidden()

    stand.process.terminate()
    expect(page.locator("[data-lost]")).to_be_visible()
    expect(page.locator(".age .mark")).to_be_hidden()  # how old it is nobody knows now
    stand.process.wait(20)
    stand.process, _ = serve(stand.data, int(stand.url.rsplit(":", 1)[1]))
    stand.report(phase="paused")
    expect(page.locator(".settled .mark")).to_have_text("Paused", timeout=60_000)  # it comes back by itself
    expect(page.locator("[data-lost]")).to_be_hidden()
    # What a lost connection prints: the browser's word for it, and htmx's event of an error.
    complaints[:] = [text for text in complaints if "net::ERR_" not in text and text != "[object Event]"]


def test_without_script_the_page_works(stand, open_context):
    stand.report()
    page = open_context(java_script_enabled=False).new_page()
    stand.sign_in(page)
    page.goto(stand.page)
    page.locator("#live-skip").click()
    expect(page.locator(".asked li")).to_contain_text("Skip position 11")
    page.locator("#cell-7").click()
    assert [item["kind"] for item in stand.report()["commands"]] == ["skip", "retake"]
