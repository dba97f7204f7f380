import csv
import html
import io
import json
import re
from collections.abc import Callable
from datetime import UTC, date, datetime, timedelta

import drift_laboratory
import pytest
from fastapi.testclient import TestClient

from app.exchange.rows import CertificateRow, MeansRow
from app.pages import results as pages
from app.services import access, calibrations, gyros, ingest, sessions, stands
from app.services.lab import Lab, Work
from app.store import results as store


def charts(page: str) -> list[dict]:
    return [json.loads(html.unescape(item)) for item in re.findall(r"data-chart='([^']*)'", page)]


def text_of(page: str) -> str:
    """The page's words, without tags, blanks run together."""
    return re.sub(r"\s+", " ", html.unescape(re.sub(r"<[^>]+>", "", page)))


def test_nobody_sees_results_without_signing_in(anonymous: TestClient, result: int) -> None:
    for path in (
        "/results",
        f"/results/{result}",
        f"/results/{result}.json",
        f"/results/{result}.csv",
        "/results.csv",
    ):
        assert anonymous.get(path).status_code == 303


def test_the_empty_queue_says_how_results_come(technician: TestClient, stocked: Lab) -> None:
    assert "No results yet" in technician.get("/results").text


def test_both_methods_stand_side_by_side(technician: TestClient, result: int) -> None:
    page = technician.get(f"/results/{result}").text
    assert "Least squares" in page
    assert "Paper’s iteration" in page
    rows = re.findall(r'<th scope="row"><span class="q">(?:K|ω)<sub>.*?</tr>', page, re.DOTALL)[:8]
    assert len(rows) == 8
    # The currents were made for K = 2063 °/h/mA: both methods find it.
    assert text_of(rows[0]).count("206") >= 2
    assert "guard band" in page
    words = text_of(page)
    assert "Uncertainty budget" in words
    assert "Noise of the means dominates Kx, Ky, Kxy, Kyx, ω0x, ω0y, ωg, ωk" in words
    assert "The data support no further term." in words


def test_the_fit_is_told_in_a_line(technician: TestClient, result: int) -> None:
    words = text_of(technician.get(f"/results/{result}").text)
    assert "with 24 degrees of freedom" in words  # 32 equations, 8 unknowns
    assert "rank 8" in words
    assert re.search(r"converged to 10⁻¹² in \d+ rounds", words)


def test_every_residual_leads_to_its_measurement(technician: TestClient, stocked: Lab, result: int) -> None:
    page = technician.get(f"/results/{result}").text
    (residuals,) = charts(page)
    points = [row for name in ("x", "y", "beyond") for row in residuals["datasets"][name]]
    with stocked.read(access.SYSTEM) as work:
        inputs = {f"/measurements/{item.id}" for item in calibrations.calibration(work, result).inputs}
    assert len(points) == 32
    assert {row["href"] for row in points} == inputs
    assert all(f'href="{address}"' in page for address in inputs)


def test_an_iteration_that_settles_at_once_says_so(technician: TestClient, result: int) -> None:
    # Equal angles at every position cancel in the method's differences: the first round is exact.
    assert "Nothing changed after the first round." in technician.get(f"/results/{result}").text


def test_convergence_is_drawn_round_by_round(
    technician: TestClient, stocked: Lab, measured: int, solving: Callable[..., int]
) -> None:
    places = [(theta, psi) for theta in (0.0, 90.0, 180.0, 270.0) for psi in (0.0, 90.0, 180.0, 270.0)]
    rows = [CertificateRow(t, p, 40.0 * n, -25.0 * n, 10.0 * n) for n, (t, p) in enumerate(places)]
    with stocked.write(access.SYSTEM) as work:
        stands.add_certificate(work, "S1", "C-18", date(2020, 1, 1), date(2100, 1, 1), rows)
        number = sessions.open_session(work, sessions.NewSession("0417", "S1", "C-18")).id
        ingest.save(work, number, _inputs(work, measured))
    page = technician.get(f"/results/{solving(stocked, number)}").text
    drawn = charts(page)[1]["datasets"]
    rounds = [row["r"] for row in drawn["kxy"]]
    assert rounds == sorted(rounds)
    assert rounds[0] == 2
    assert drawn["kxy"][-1]["v"] <= 1e-12 < drawn["kxy"][0]["v"]


def test_where_it_came_from(technician: TestClient, stocked: Lab, result: int) -> None:
    with stocked.read(access.SYSTEM) as work:
        view = calibrations.calibration(work, result)
    page = technician.get(f"/results/{result}").text
    assert view.input_hash in page
    assert 'href="/certificates/S1/C-17"' in page
    assert view.solver_version in page
    assert "55.7558°" in page


def test_the_verdict_names_what_made_it(
    technician: TestClient, stocked: Lab, measured: int, result: int
) -> None:
    with stocked.write(access.SYSTEM) as work:
        gyros.set_limits(work, "GVK-6", {"w0x": (-2.0, 2.0), "w0y": (-0.5, 0.5)})
    words = text_of(technician.get(f"/results/{result}").text)
    assert re.search(r"ω0y = −0\.7\d+ ± 0\.\d+ °/h lies beyond its limit of ±0\.5\.", words)
    assert "Out of limits" in words
    worst = technician.get("/results", params={"order": "worst"}).text
    assert 'class="row-out"' in worst


def test_the_worst_comes_first_when_asked(
    technician: TestClient, stocked: Lab, measured: int, solving: Callable[..., int]
) -> None:
    with stocked.write(access.SYSTEM) as work:
        gyros.add_gyro(work, "0500", "tight")
        gyros.set_limits(work, "tight", {"w0x": (-1.0, 1.0)})
        other = sessions.open_session(
            work, sessions.NewSession("0500", "S1", started_at=datetime(2026, 1, 12, tzinfo=UTC))
        ).id
        ingest.save(work, other, _inputs(work, measured))
    bad, good = solving(stocked, other), solving(stocked, measured)
    newest, worst = (
        technician.get("/results", params={"order": order}).text for order in ("newest", "worst")
    )
    assert newest.index(f'href="/results/{good}"') < newest.index(f'href="/results/{bad}"')
    assert worst.index(f'href="/results/{bad}"') < worst.index(f'href="/results/{good}"')
    assert f'href="/results/{bad}"' not in technician.get("/results", params={"gyro": "0417"}).text


def test_the_last_one_measured_comes_first(
    technician: TestClient, lab: Lab, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Results stored in another order than they were measured in, page by page; the foot says how far each goes."""
    monkeypatch.setattr(pages, "_PER_PAGE", 5)
    now = datetime.now(UTC)
    with lab.write(access.SYSTEM) as work:
        results = drift_laboratory.furnish(work, now)
        for number, days in ((results[-1], 1000), (results[0], 1)):
            stored = store.calibration(work.db, number)
            assert stored is not None
            stored.session.started_at = now - timedelta(days=days)
    measured = [results[0], *results[-2:0:-1], results[-1]]
    shown: list[int] = []
    address = "/results"
    while address:
        page = technician.get(address).text
        shown += [int(number) for number in re.findall(r'class="id" href="/results/(\d+)"', page)]
        following = re.search(r'href="([^"]*)" rel="next"', page)
        assert (f"down to result no. {shown[-1]}" in page) == bool(following)
        address = html.unescape(following[1]) if following else ""
    assert shown == measured


def _inputs(work: Work, session_id: int) -> list[ingest.Measured]:
    """What a session measured, to be saved in another one."""
    found = [item.measurement for item in sessions.detail(work, session_id).positions if item.measurement]
    return [
        ingest.Measured(
            MeansRow(item.theta_deg, item.psi_deg, item.jx_ma or 0.0, item.jy_ma or 0.0, item.u_jx_ma, item.u_jy_ma,
                     item.duration_s, item.rate_hz),
            ingest.Source("typed"),
        )
        for item in found
    ]  # fmt: skip


def test_what_is_not_determined_is_named(
    technician: TestClient, stocked: Lab, opened: int, measured: int, solving: Callable[..., int]
) -> None:
    with stocked.write(access.SYSTEM) as work:
        for item in sessions.detail(work, measured).positions:
            if item.theta_deg:
                ingest.withdraw(work, measured, item.theta_deg, item.psi_deg, 0, "")
    number = solving(stocked, measured)
    page = technician.get(f"/results/{number}").text
    words = text_of(page)
    assert "Not determined" in words
    assert "not determined" in words
    assert "unobservable" not in words  # a code for programs
    assert "The paper’s iteration gave nothing" in words


def test_least_squares_alone(
    technician: TestClient, stocked: Lab, measured: int, solving: Callable[..., int]
) -> None:
    page = technician.get(f"/results/{solving(stocked, measured, 'least-squares')}").text
    assert len(charts(page)) == 1
    assert "Only least squares was asked for" in page
    assert "Paper’s iteration</th>" not in page


def test_the_papers_method_alone(
    technician: TestClient, stocked: Lab, measured: int, solving: Callable[..., int]
) -> None:
    page = technician.get(f"/results/{solving(stocked, measured, 'paper')}").text
    assert "Approximations" in page
    assert '<td colspan="4">' not in page  # one method only: nothing stands beside it


def test_a_replaced_result_says_so(
    technician: TestClient, stocked: Lab, measured: int, result: int, solving
) -> None:
    technician.post(f"/sessions/{measured}/rows/0/0/0", data={"jx_ua": "0.1", "jy_ua": "0.2"})
    later = solving(stocked, measured)
    assert f'href="/results/{later}">See the one that counts' in technician.get(f"/results/{result}").text
    page = text_of(technician.get(f"/results/{later}").text)
    assert "revision 2" in page
    assert f"replaces No. {result}" in page


def test_a_blunder_stands_out(
    technician: TestClient, stocked: Lab, measured: int, solving: Callable[..., int]
) -> None:
    technician.post(
        f"/sessions/{measured}/rows/90/180/0?unit=ma", data={"jx_ma": "0.0001", "jy_ma": "-0.0030"}
    )
    page = technician.get(f"/results/{solving(stocked, measured)}").text
    assert charts(page)[0]["datasets"]["beyond"]
    assert 'class="row-out"' in page
    assert "To be known with this result" in page


def test_a_simulated_session_shows_its_truth(
    technician: TestClient, stocked: Lab, measured: int, solving: Callable[..., int]
) -> None:
    truth = {
        "kx": 2063.0,
        "ky": 2063.0,
        "kxy": 0.0,
        "kyx": 0.0,
        "w0x": 1.5,
        "w0y": -0.75,
        "wg": 0.9,
        "wk": 3.0,
    }
    with stocked.write(access.SYSTEM) as work:
        number = sessions.open_session(
            work, sessions.NewSession("0417", "S1", origin="simulation", truth=truth)
        ).id
        ingest.save(work, number, _inputs(work, measured))
    words = text_of(technician.get(f"/results/{solving(stocked, number)}").text)
    assert "Truth of the simulation" in words
    assert re.search(
        r"ωk ?g-drift, quadrature ?3\.0+ ?−3\.2\d+ ?°/h/g ?−\d+\.\d\d ?beyond U", words
    )  # it is −0.2


def test_the_document_is_the_stored_one(technician: TestClient, stocked: Lab, result: int) -> None:
    with stocked.read(access.SYSTEM) as work:
        stored = calibrations.result_text(work, result)
    assert technician.get(f"/results/{result}.json").text == stored


def test_the_parameters_as_csv(technician: TestClient, result: int) -> None:
    rows = list(csv.DictReader(io.StringIO(technician.get(f"/results/{result}.csv").text)))
    stored = json.loads(technician.get(f"/results/{result}.json").text)
    assert len(rows) == 16
    for row in rows:
        known = stored[row["method"]]["parameters"][row["parameter"]]
        assert float(row["value"]) == known["value"]
        assert float(row["expanded_uncertainty"]) == known["coverage_factor"] * known["standard_uncertainty"]
    assert {row["verdict"] for row in rows if row["method"] == "least-squares"} == {"no-limit", "conforms"}


def test_no_such_result(technician: TestClient, stocked: Lab) -> None:
    assert technician.get("/results/99").status_code == 404


@pytest.mark.parametrize("path", ["/results", "/results/{}"])
def test_in_russian(technician: TestClient, result: int, path: str) -> None:
    technician.cookies.set("lang", "ru")
    page = technician.get(path.format(result)).text
    assert "Результаты" in page
    assert "Residuals" not in page
    assert "°/ч" in page
