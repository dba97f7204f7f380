"""What the browser prints, and what a phone shows in Russian: nothing dark, cut or one over the other."""

import pytest

pytestmark = pytest.mark.browser

PAPER_PX = 718
"""A4, 210 mm at 96 px to the inch, less the 0.4 inch that Chromium leaves on either side."""

_WIDTHS = "[...document.querySelectorAll('[data-chart] svg')].map((svg) => Number(svg.getAttribute('width')))"


@pytest.mark.parametrize("path", ["/gyros/0423", "/results/75", "/stands/S1/drift"])
def test_a_dark_page_prints_on_white_paper_and_fits_it(demonstration, open_context, path):
    page = open_context(color_scheme="dark").new_page()
    page.goto(demonstration.link)
    page.goto(demonstration.url + path)
    for chart in page.locator("[data-chart]").all():
        chart.locator("svg").first.wait_for()
    before = page.evaluate(_WIDTHS)
    page.evaluate("dispatchEvent(new Event('beforeprint'))")
    assert max(page.evaluate(_WIDTHS)) <= PAPER_PX
    page.evaluate("dispatchEvent(new Event('afterprint'))")
    assert page.evaluate(_WIDTHS) == before
    page.emulate_media(media="print", color_scheme="dark")
    page.set_viewport_size({"width": PAPER_PX, "height": 1000})
    assert page.evaluate("document.documentElement.scrollWidth") == PAPER_PX
    assert page.evaluate("getComputedStyle(document.body).backgroundColor") == "rgb(252, 252, 251)"


def test_a_long_name_leaves_the_verdict_its_place_on_a_phone(demonstration, open_context):
    page = open_context(viewport={"width": 390, "height": 844}, locale="ru-RU").new_page()
    page.goto(demonstration.link)
    page.goto(demonstration.url + "/results/75")
    rows = page.locator("tr:has(> .name)")
    assert rows.count() == 16
    covered = rows.evaluate_all("""(rows) => rows.filter((row) => {
      const verdict = row.querySelector(".top").getBoundingClientRect();
      return [...row.querySelector(".name").getClientRects()].some((line) => line.right > verdict.left
        && line.top < verdict.bottom && line.bottom > verdict.top);
    }).length""")
    assert covered == 0
    parted = page.locator("td.whole").evaluate_all(
        "(cells) => cells.filter((cell) => cell.getBoundingClientRect().height > 30).length"
    )
    assert parted == 0, "a label of several words and its number stand on two lines"


def test_a_state_in_many_words_stays_on_one_line_over_its_chart(demonstration, open_context):
    page = open_context(locale="ru-RU").new_page()
    page.goto(demonstration.link)
    page.goto(demonstration.url + "/gyros/0423")
    heights = page.locator(".chart-head .says").evaluate_all(
        "(states) => states.map((state) => state.getBoundingClientRect().height)"
    )
    assert len(heights) == 8
    assert max(heights) < 30, "a state breaks onto several lines of 20 px"
