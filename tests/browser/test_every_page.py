"""Every page of the demonstration laboratory in both languages, both themes, on a desk and on a phone."""

import pytest

pytestmark = pytest.mark.browser

PAGES = [
    "/", "/sessions", "/sessions?gyro=0417", "/sessions/79", "/sessions/79/entry", "/sessions/78",
    "/sessions/new", "/results", "/results/78", "/results/76", "/gyros", "/gyros/new", "/gyros/0417",
    "/gyros/0423", "/gyros/0417/edit", "/gyros/0417/drift/w0y", "/gyros/0417/baseline", "/gyros/0417/events/new",
    "/alarms", "/types/GVK-6", "/types/GVK-6/fleet", "/compare", "/compare?a=session:78&b=session:72",
    "/stands", "/stands/S1", "/stands/S1/drift", "/stands/S1/uncertainty", "/stands/new",
    "/stands/S1/plan?nominal=type:GVK-6", "/stands/S1/plan?mode=propose&grid_deg=45", "/stands/S1/plan?view=trade",
    "/certificates", "/certificates/S1/C-17", "/certificates/new", "/simulations/new", "/method", "/validation",
    "/loop", "/loop?start=printed",
    "/no-such-page", "/api/v1/docs",
]  # fmt: skip
WAYS = {
    "desk-light-en": {"viewport": {"width": 1280, "height": 720}, "color_scheme": "light", "locale": "en-GB"},
    "desk-dark-ru": {"viewport": {"width": 1280, "height": 720}, "color_scheme": "dark", "locale": "ru-RU"},
    "phone-light-ru": {"viewport": {"width": 390, "height": 844}, "color_scheme": "light", "locale": "ru-RU"},
    "phone-dark-en": {"viewport": {"width": 390, "height": 844}, "color_scheme": "dark", "locale": "en-GB"},
}

EXAMINED = ("desk-light-en", "phone-dark-en")
"""Ways in which axe looks at each page: both themes, both sizes. A language changes no role and no contrast."""


@pytest.mark.parametrize("way", WAYS)
def test_every_page_keeps_the_policy_and_is_open_to_everybody(
    demonstration, open_context, accessible, screenshot, way
):
    page = open_context(**WAYS[way]).new_page()
    page.goto(demonstration.link)
    wide = []
    for path in PAGES:
        page.goto(demonstration.url + path)
        for chart in page.locator("[data-chart]").all():
            chart.locator("svg").first.wait_for()
        if way in EXAMINED:
            accessible(page)
        screenshot(page, way + path.replace("/", "_").replace("?", "_"))
        if page.evaluate("document.documentElement.scrollWidth > document.documentElement.clientWidth"):
            wide.append(path)
        spoken = "en" if path.startswith("/api/") else WAYS[way]["locale"][:2]  # the API speaks English only
        assert page.locator("html").get_attribute("lang") == spoken, path
    assert wide == [], "these pages are wider than the window"


def test_a_point_of_the_drift_leads_to_its_samples_in_three_clicks(demonstration, open_context):
    page = open_context().new_page()
    page.goto(demonstration.link)
    page.goto(demonstration.url + "/gyros/0417")
    page.locator("[data-chart] svg [role=link]").last.click()
    page.wait_for_url("**/results/*")
    page.locator("[data-chart] svg [role=link]").first.press("Enter")
    page.wait_for_url("**/measurements/*")
    page.locator("[data-chart] svg").first.wait_for()
    assert "200" in page.locator("main").inner_text()


def test_without_script_the_pages_still_work(demonstration, open_context):
    page = open_context(java_script_enabled=False).new_page()
    page.goto(demonstration.link)
    page.goto(demonstration.url + "/sessions/79/entry")
    row = page.locator("table.grid tbody tr").nth(12)
    row.locator("input.in").nth(0).fill("0.5")
    row.locator("input.in").nth(1).fill("-0,5")
    row.get_by_role("button", name="Save").click()
    assert "13 of 16" in page.locator("main").inner_text()
