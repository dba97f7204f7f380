"""A laboratory's whole first day, by hand, in a browser: from an empty book to a gyro's history."""

import re
from datetime import UTC, datetime

import pytest
from playwright.sync_api import Page, expect

from app.exchange.rows import CertificateRow
from app.services.simulated import Conditions, bench_for, truth_values
from simdevice.bench import mean_currents
from simdevice.certificate import sixteen_positions
from solver.units import ma_from_ampere

pytestmark = pytest.mark.browser

PLACES = [(theta, psi) for theta in (0, 90, 180, 270) for psi in (0, 90, 180, 270)]
ROWS = [CertificateRow(theta, psi, 6.9 - n, 16.4 - 2 * n, -6.6 + n) for n, (theta, psi) in enumerate(PLACES)]


def currents_ua() -> list[tuple[str, str]]:
    """Sixteen pairs as a technician reads them off, µA with four decimals."""
    bench = bench_for(Conditions("GVK-6", "0417", "S1", 1, seed=1), ROWS, 55.7558)
    means = mean_currents(bench, sixteen_positions())
    return [
        tuple(f"{1000 * float(ma_from_ampere(value)):.4f}" for value in pair)
        for pair in zip(means.jx, means.jy, strict=True)
    ]


def sign_in(page: Page, laboratory) -> None:
    page.goto(laboratory.url)
    expect(page).to_have_url(re.compile("/sign-in"))
    page.get_by_label("Name").fill(laboratory.name)
    page.get_by_label("Password").fill(laboratory.password)
    page.get_by_role("button", name="Sign in").click()
    expect(page.get_by_role("link", name="Today")).to_be_visible()


def test_from_an_empty_book_to_a_gyros_history(laboratory, open_context, accessible, screenshot):
    page = open_context().new_page()
    page.goto(laboratory.url)
    accessible(page)
    sign_in(page, laboratory)
    accessible(page)
    screenshot(page, "first-day-empty")

    page.goto(laboratory.url + "/gyros/new")
    page.get_by_label("Serial number").fill("0417")
    page.get_by_label("Type").fill("GVK-6")
    accessible(page)
    page.get_by_role("button", name="Add the gyro").click()
    expect(page.get_by_text("0417").first).to_be_visible()

    page.goto(laboratory.url + "/stands/new")
    page.get_by_label("Name").fill("S1")
    page.get_by_label("Latitude").fill("95")
    page.get_by_role("button", name="Add the stand").click()
    expect(page.get_by_label("Latitude")).to_have_value("95")
    expect(page.get_by_label("Latitude")).to_have_attribute("aria-invalid", "true")
    accessible(page)
    page.get_by_label("Latitude").fill("55,7558")
    page.get_by_role("button", name="Add the stand").click()
    expect(page.get_by_role("heading", name="Stand S1")).to_be_visible()

    page.get_by_role("link", name="Enter a certificate").first.click()
    page.get_by_label("Number").fill("C-17")
    year = datetime.now(UTC).year
    page.get_by_label("Valid from").fill(f"{year}-01-01")
    page.get_by_label("Valid until").fill(f"{year + 1}-12-31")
    page.get_by_label("Rows from a spreadsheet").fill(
        "\n".join(
            f"{r.theta_deg}\t{r.psi_deg}\t{r.alpha_arcsec:.1f}\t{r.beta_arcsec:.1f}\t{r.gamma_arcsec:.1f}"
            for r in ROWS
        )
    )
    accessible(page)
    page.get_by_role("button", name="Enter the certificate").click()
    expect(page.get_by_role("heading", name=re.compile("C-17"))).to_be_visible()
    accessible(page)

    page.goto(laboratory.url + "/sessions/new")
    page.get_by_label("Gyro").select_option("0417")
    page.get_by_label("Stand", exact=True).select_option("S1")
    accessible(page)
    page.get_by_role("button", name="Open the session").click()
    expect(page.locator("table.grid tbody tr")).to_have_count(16)
    accessible(page)
    fill_grid(page, screenshot)

    page.get_by_role("button", name="Solve", exact=True).click()
    expect(page).to_have_url(re.compile("/jobs/"))
    accessible(page)
    page.get_by_role("link", name="See the result").click()
    expect(page.get_by_role("heading", name=re.compile("Calibration of gyro 0417"))).to_be_visible()
    expect(page.locator("[data-chart] svg").first).to_be_visible()
    accessible(page)
    screenshot(page, "first-day-result")
    check_result(page)

    page.goto(laboratory.url + "/gyros/0417")
    expect(page.locator("[data-chart] svg").first).to_be_visible()
    accessible(page)
    screenshot(page, "first-day-history")


def fill_grid(page: Page, screenshot) -> None:
    """Two rows typed, one of them wrong first; the others pasted from a spreadsheet."""
    pairs = currents_ua()
    row = page.locator("table.grid tbody tr")
    first = row.nth(0).locator("input.in")
    first.nth(0).fill("four")
    first.nth(1).fill(pairs[0][1].replace(".", ",").replace("-", "−"))
    first.nth(1).press("Enter")
    expect(row.nth(0).get_by_role("alert")).to_be_visible()
    expect(row.nth(0).locator("input.in").nth(0)).to_have_value("four")
    row.nth(0).locator("input.in").nth(0).fill(pairs[0][0])
    row.nth(0).locator("input.in").nth(0).press("Enter")
    expect(row.nth(0)).to_contain_text("saved")
    second = row.nth(1).locator("input.in")
    second.nth(0).fill(pairs[1][0])
    second.nth(1).fill(pairs[1][1])
    second.nth(1).press("Enter")
    expect(row.nth(1)).to_contain_text("saved")
    expect(row.nth(2).locator("input.in").nth(0)).to_be_focused()
    pasted = "\r\n".join("\t".join(pair) for pair in pairs[2:])
    row.nth(2).locator("input.in").nth(0).evaluate(
        """(input, text) => {
            const data = new DataTransfer();
            data.setData("text/plain", text);
            input.dispatchEvent(new ClipboardEvent("paste", {clipboardData: data, bubbles: true, cancelable: true}));
        }""",
        pasted,
    )
    expect(page.get_by_role("status").first).to_contain_text("16 of 16")
    bottom = page.locator("table.grid").bounding_box()
    assert bottom["y"] + bottom["height"] <= 720, "all sixteen rows fit 1280×720"
    screenshot(page, "first-day-entry")
    page.reload()
    expect(page.get_by_role("status").first).to_contain_text("16 of 16")


def check_result(page: Page) -> None:
    """The shown values are the truth within what four decimals of a µA can bear."""
    bench = bench_for(Conditions("GVK-6", "0417", "S1", 1, seed=1), ROWS, 55.7558)
    document = page.request.get(page.url.partition("?")[0] + ".json").json()
    document = document.get("result", document)
    parameters = document["least-squares"]["parameters"]
    for name, true in truth_values(bench.gyro).items():
        entry = parameters[name]
        # u comes from the residuals' scatter; beyond 6 u by Student's t with 24 dof: p < 1e-5 for eight.
        assert abs(entry["value"] - true) < 6 * entry["standard_uncertainty"], name
