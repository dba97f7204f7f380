"""What a table pasted into the entry grid means: as a whole by its own words, or not at all."""

import random
import subprocess
import sys
from pathlib import Path

import httpx
import pytest
from playwright.sync_api import expect

import app

pytestmark = pytest.mark.browser
GRID = [(theta, psi) for theta in (0, 90, 180, 270) for psi in (0, 90, 180, 270)]
COLUMNS = ["jx", "jy", "duration_s", "note"]
PAIRS = [(f"{n + 1}.25", f"{n + 1}.75") for n in range(16)]
SCRIPT = Path(app.__file__).parent / "static" / "pasted.js"


@pytest.fixture(scope="module")
def read(chromium):
    """Reads a paste into the first cell of an empty grid, or into another one."""
    page = chromium.new_page()
    page.add_script_tag(path=SCRIPT)
    rows = [{"theta": theta, "psi": psi, "columns": COLUMNS} for theta, psi in GRID]

    def run(text, start=0, first=0, unit="ua"):
        return page.evaluate(
            """([text, rows, start, first, unit]) => {
                const told = Pasted.read(text, rows, start, first, unit);
                return told.why ? told
                  : told.found.map(({row, column, text}) => [row.theta, row.psi, column, text]);
            }""",
            [text, rows, start, first, unit],
        )

    yield run
    page.close()


def cells(places, pairs=PAIRS):
    return [
        [theta, psi, column, value]
        for (theta, psi), pair in zip(places, pairs, strict=False)
        for column, value in zip(("jx", "jy"), pair, strict=True)
    ]


def lines(rows, apart="\t"):
    return "\r\n".join(apart.join(str(cell) for cell in row) for row in rows) + "\r\n"


@pytest.mark.parametrize("apart", ["\t", ";", ",", ", ", "; ", "  "])
def test_pairs_fill_the_rows_downwards(read, apart):
    assert read(lines(PAIRS, apart).replace("\r\n\r\n", "\r\n")) == [
        [theta, psi, column, value.strip()] for theta, psi, column, value in cells(GRID)
    ]


def test_pairs_fill_from_the_cell_on(read):
    assert read(lines(PAIRS[:3]), start=4) == cells(GRID[4:7])
    assert read("1,5\n2,5e-3\n−3,5\n", start=14, first=1, unit="ma")["why"] == "lines"
    assert read("2,5e-3\n−3,5\n", start=14, first=1) == [[270, 180, "jy", "2,5e-3"], [270, 270, "jy", "−3,5"]]


@pytest.mark.parametrize("head", ["jx_ua\tjy_ua", "Jx, мкА\tJy, мкА", "jx\tjy"])
def test_names_of_columns_are_no_row(read, head):
    assert read(head + "\n" + lines(PAIRS)) == cells(GRID)


@pytest.mark.parametrize("head", ["", "theta_deg\tpsi_deg\tjx_ua\tjy_ua\n", "θ, °\tψ, °\tJx, µA\tJy, µA\n"])
@pytest.mark.parametrize("apart", ["\t", ";"])
def test_rows_with_angles_go_to_their_positions(read, head, apart):
    order = random.Random(3).sample(range(16), 16)
    table = lines([(*GRID[n], *PAIRS[n]) for n in order], apart)
    found = read(head.replace("\t", apart) + table, start=7)
    assert found == cells([GRID[n] for n in order], [PAIRS[n] for n in order])


def test_columns_in_another_order_go_by_their_names(read):
    table = "No.\tjy_ua\tnote\tpsi_deg\ttheta_deg\tjx_ua\n1\t1.75\twarm\t90\t-90\t1.25\n"
    assert read(table) == [[270, 90, "jy", "1.75"], [270, 90, "note", "warm"], [270, 90, "jx", "1.25"]]


def test_empty_lines_between_groups_part_no_positions_where_all_are_there(read):
    groups = "\n".join(lines(PAIRS[n : n + 4]) for n in (0, 4, 8, 12))
    assert read(groups) == cells(GRID)
    with_angles = "\n".join(lines([(*GRID[n], *PAIRS[n])]) for n in (3, 1))
    assert read(with_angles) == cells([GRID[3], GRID[1]], [PAIRS[3], PAIRS[1]])


@pytest.mark.parametrize(
    ("text", "why"),
    [
        (
            lines(PAIRS[:4]) + "\n" + lines(PAIRS[4:8]),
            {"why": "blank"},
        ),  # which position is the fifth pair of?
        (lines([*PAIRS, ("1", "2")]), {"why": "lines", "lines": 17, "rows": 16}),
        ("jx_ma\tjy_ma\n" + lines(PAIRS), {"why": "unit", "name": "jx_ma"}),
        ("Jx, мА\tJy, мА\n" + lines(PAIRS), {"why": "unit", "name": "Jx, мА"}),
        ("jx_a\tjy_a\n" + lines(PAIRS), {"why": "unit", "name": "jx_a"}),
        ("jx\tjy\tmood\n1\t2\tgood\n", {"why": "column", "name": "mood"}),
        ("theta_deg\tjx\tjy\n0\t1\t2\n", {"why": "angles"}),
        ("jx\tjy\n", {"why": "empty"}),
        ("1\t2\n1\tfour\n", {"why": "number", "line": 2, "cell": "four"}),
        ("1\t2\t60\tx\t5\n1\t2\n", {"why": "wide", "line": 1, "columns": 4}),
        ("theta\tpsi\tjx\tjy\n45\t0\t1\t2\n", {"why": "position", "line": 2}),
        ("theta\tpsi\tjx\tjy\n0\t0\t1\t2\n360\t0\t1\t2\n", {"why": "twice", "line": 3}),
    ],
)
def test_what_cannot_be_placed_is_not_placed_at_all(read, text, why):
    assert read(text) == why


@pytest.fixture(scope="module")
def entry(tmp_path_factory, serve):
    """The address of a session's entry page in µA, and who may fill it in."""
    data = tmp_path_factory.mktemp("pasted") / "data"

    def said(*arguments):
        done = subprocess.run(
            [sys.executable, "-m", "app", *arguments, "--data", data], check=True, capture_output=True
        )
        return done.stdout.decode().strip()

    password = said("user", "add", "petrova", "--role", "technician")
    token = said("token", "create", "stand", "--scope", "read,upload")
    _, url = serve(data)
    angles = {"alpha_arcsec": 1, "beta_arcsec": 2, "gamma_arcsec": 3}
    positions = [{"theta_deg": theta, "psi_deg": psi} | angles for theta, psi in GRID]
    valid = {
        "number": "C-17",
        "valid_from": "2000-01-01",
        "valid_until": "2100-01-01",
        "positions": positions,
    }
    with httpx.Client(
        base_url=url + "/api/v1", headers={"authorization": f"Bearer {token}"}, timeout=60
    ) as client:
        for path, body in (
            ("/gyros", {"serial": "0417", "type": "GVK-6"}), ("/stands", {"name": "S1", "latitude_deg": 55.7558}),
            ("/stands/S1/certificates", valid), ("/sessions", {"gyro": "0417", "stand": "S1"}),
        ):  # fmt: skip
            client.post(path, json=body).raise_for_status()
    return url, password


def test_a_table_with_angles_is_saved_in_any_order(open_context, entry, accessible, screenshot):
    page, (url, password) = open_context().new_page(), entry
    page.goto(url + "/sign-in")
    page.locator("#f-name").fill("petrova")
    page.locator("#f-password").fill(password)
    page.locator("main button[type=submit]").click()
    expect(page.locator("nav .places").first).to_be_attached()
    page.goto(url + "/sessions/1/entry?unit=ua")
    cell = page.locator("table.grid input.in").first
    paste = """(input, text) => {
        const data = new DataTransfer();
        data.setData("text/plain", text);
        input.dispatchEvent(new ClipboardEvent("paste", {clipboardData: data, bubbles: true, cancelable: true}));
    }"""
    cell.evaluate(paste, "jx_ma\tjy_ma\n" + lines(PAIRS))
    expect(page.locator("#paste-refused")).to_contain_text("“jx_ma” is in another unit")
    expect(page.get_by_role("status").first).to_contain_text("0 of 16")
    accessible(page)
    screenshot(page, "paste-refused")
    order = random.Random(5).sample(range(16), 16)
    table = lines([("θ", "ψ", "Jx, µA", "Jy, µA"), *((*GRID[n], *PAIRS[n]) for n in order)])
    page.locator("table.grid input.in").nth(8).evaluate(paste, table)
    expect(page.get_by_role("status").first).to_contain_text("16 of 16")
    expect(page.locator("#paste-refused")).to_be_hidden()
    page.reload()
    for (theta, psi), pair in zip(GRID, PAIRS, strict=True):
        cells_of = page.locator(f"tr[data-theta='{theta:.1f}'][data-psi='{psi:.1f}'] input.in")
        assert tuple(cells_of.nth(n).input_value() for n in (0, 1)) == pair
