"""Which positions nothing would show to stand wrong, judged by what mistakes there really do to the fit."""

from itertools import product

import numpy as np
import pytest

from app.exchange.rows import MeansRow
from app.exchange.si import observations
from app.services.simulated import certificate_lab
from app.station.contracts import Currents, Place
from app.station.judgement.control import unseen
from simdevice.bench import steady_currents
from simdevice.certificate import Position
from simdevice.scenarios import scenario
from solver.calibrate import calibrate
from solver.units import deg_from_rad

QUARTERS = [0.0, 90.0, 180.0, 270.0]
SIXTEEN = [Place(*angles) for angles in product(QUARTERS, QUARTERS)]
FOUR = [Place(0.0, 0.0), Place(0.0, 90.0), Place(0.0, 180.0), Place(90.0, 0.0)]
NO_PARTNERS = [Place(theta, psi) for theta in QUARTERS for psi in (0.0, 90.0)]


def means(places: list[Place], wrong: Place | None = None) -> dict[Place, Currents]:
    """Mean currents; of one place those a quarter turn of ψ further."""
    bench = scenario("exact-stand").bench(3)
    true = [Place(p.theta_deg, (p.psi_deg + 90.0) % 360.0) if p == wrong else p for p in places]
    jx, jy = steady_currents(bench, [Position(*np.radians(place)) for place in true])
    return {
        place: Currents(x * 1e3, y * 1e3)
        for place, x, y in zip(places, jx.tolist(), jy.tolist(), strict=True)
    }


def test_the_methods_positions_are_all_seen():
    assert unseen(means(SIXTEEN)) == ()
    assert unseen(means(SIXTEEN[:8])) == ()


def test_four_positions_show_nothing_of_each_other():
    assert unseen(means(FOUR)) == tuple(FOUR)
    assert unseen({}) == ()


@pytest.mark.parametrize("wrong", NO_PARTNERS, ids=lambda place: f"{place.theta_deg:g}-{place.psi_deg:g}")
def test_where_it_says_that_the_fit_shows_it_the_fit_does(wrong):
    """Eight positions without partners: residuals of a wrong one are those of more than 100 nA, a good one has none."""
    assert unseen(means(NO_PARTNERS)) == ()
    assert residual_na(means(NO_PARTNERS)) < 10.0
    assert residual_na(means(NO_PARTNERS, wrong)) > 100.0


def residual_na(found: dict[Place, Currents]) -> float:
    """Root of the sum of squares of the residuals of the method's own fit, as currents of 10 rad/(s·A)."""
    bench = scenario("exact-stand").bench(3)
    rows = [MeansRow(*place, *currents) for place, currents in found.items()]
    latitude_deg = float(deg_from_rad(bench.stand.latitude))
    measured = observations(rows, certificate_lab(bench.stand.certificate), latitude_deg)
    (answer,) = calibrate(measured, "least-squares").answers.values()
    return float(np.linalg.norm(answer.residuals)) / 10.0 * 1e9
