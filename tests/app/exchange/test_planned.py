"""Lists of positions as people write them, and a plan's question in SI."""

import numpy as np
import pytest

from app.errors import Invalid
from app.exchange.planned import (
    certified_rows,
    circumstances_si,
    grid_positions,
    listed_positions,
    places_si,
)
from app.exchange.rows import CertificateRow
from solver.records import PARAMETERS

NOMINAL = dict(zip(PARAMETERS, (2062.65, 2041.0, 10.3, -8.25, 1.5, -0.8, 6.0, 2.0), strict=True))
CERTIFICATE = [
    CertificateRow(0.0, 90.0, 10.0, -20.0, 30.0, 3.0, 4.0, None),
    CertificateRow(90.0, 0.0, 1.0, 2.0, 3.0, 1.0, 4.0, None),
]


@pytest.mark.parametrize(
    "text", ["0/90 90/0", "0/90,90/0", " 0/90;\n90/0 ", "0/90\t450/-360", "0.0/90  90/−0"]
)
def test_positions_are_read_with_any_separator(text):
    assert listed_positions(text, "positions") == ((0.0, 90.0), (90.0, 0.0))


@pytest.mark.parametrize(("text", "count"), [("0", 1), ("0/90 x/0 7", 2), ("0/", 1), ("0//90", 1)])
def test_what_is_no_position_is_named(text, count):
    with pytest.raises(Invalid) as error:
        listed_positions(text, "positions")
    assert len(error.value.problems) == count
    assert {item.column for item in error.value.problems} == {"positions"}


def test_a_grid_goes_once_round():
    assert len(grid_positions(45.0)) == 64
    assert grid_positions(90.0)[:5] == ((0.0, 0.0), (0.0, 90.0), (0.0, 180.0), (0.0, 270.0), (90.0, 0.0))
    assert max(max(place) for place in grid_positions(30.0)) == 330.0


def test_a_position_without_certificate_is_neither_better_nor_worse_known_than_the_others():
    known, unknown = certified_rows([(0.0, 90.0000001), (45.0, 45.0)], CERTIFICATE)
    assert known is CERTIFICATE[0]
    assert (unknown.alpha_arcsec, unknown.beta_arcsec, unknown.gamma_arcsec) == (0.0, 0.0, 0.0)
    # Root mean squares: √((9 + 1)/2), 4, and nothing where nothing is stated.
    assert unknown.u_alpha_arcsec == pytest.approx(5**0.5, rel=1e-15)
    assert (unknown.u_beta_arcsec, unknown.u_gamma_arcsec) == (4.0, 0.0)


def test_places_are_in_radians():
    places = places_si(CERTIFICATE)
    np.testing.assert_allclose(places.theta, [0.0, np.pi / 2], rtol=1e-15)
    np.testing.assert_allclose(places.gamma, np.deg2rad([30 / 3600, 3 / 3600]), rtol=1e-15)
    np.testing.assert_allclose(places.u_beta, np.deg2rad([4 / 3600] * 2), rtol=1e-15)
    assert places.u_gamma.tolist() == [0.0, 0.0]


def test_noise_of_a_minute_is_turned_into_currents():
    """0.005 °/h over K = √(Kx·Ky − Kxy·Kyx) °/h/mA is a current in mA."""
    at = circumstances_si(NOMINAL, -33.9, 0.005, 0.003, {"u_gain_x_ppm": 50})
    scale = (2062.65 * 2041.0 + 10.3 * 8.25) ** 0.5
    assert at.noise.u(60.0) == pytest.approx(1e-3 * np.hypot(0.005, 0.003) / scale, rel=1e-12)
    assert at.noise.u(240.0) == pytest.approx(1e-3 * np.hypot(0.0025, 0.003) / scale, rel=1e-12)
    assert at.latitude == pytest.approx(np.deg2rad(-33.9), rel=1e-15)
    assert at.common.standard[0] == pytest.approx(50e-6, rel=1e-15)
    # 2062.648… °/h/mA is 10 rad/(s·A): 10·(180/π)·3600/1000.
    np.testing.assert_allclose(at.parameters[0], 2062.65 / (10 * np.rad2deg(1) * 3.6) * 10, rtol=1e-12)
