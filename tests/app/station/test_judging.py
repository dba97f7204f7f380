"""The judge by rules: what it makes of a laboratory's thresholds, a type's expectations and a run's history."""

import pytest

from app.station.contracts import Currents, Place
from app.station.instruments.description import SIMULATED, station_file
from app.station.judging import Rules
from app.station.keeping.history import History

FILE = station_file(SIMULATED)
RULES = Rules(FILE.settling, FILE.warm_up, FILE.checks, FILE.types, FILE.ammeter.largest_ma)


def pairs(off_na: float) -> dict[Place, Currents]:
    """Four pairs of partners, of which the sum of one is off."""
    places = [Place(theta, psi) for theta in (0.0, 90.0) for psi in (0.0, 90.0, 180.0, 270.0)]
    return {place: Currents(off_na * 1e-6 if place == places[0] else 0.0, 0.0) for place in places}


@pytest.mark.parametrize(
    ("gyro_type", "turned_arcsec", "allowed_na"),
    [
        ("GVK-6", None, 100.0),  # the file's partner_na
        ("GVK-6", 15.0, 104.4),  # 4 · 15″ · (15.04 + 15) °/h / 1980 °/h/mA more
        ("GVK-6", 7200.0, 2219.0),
        ("DTG-4", 7200.0, 400.0 + 7431.0),  # (15.04 + 27) / 790
        ("another", 7200.0, 100.0),  # of which the file says nothing
    ],
)
def test_the_certificates_angles_are_allowed_for(gyro_type, turned_arcsec, allowed_na):
    history = History(gyro_type=gyro_type, turned_arcsec=turned_arcsec)
    assert list(RULES.odd(pairs(0.99 * allowed_na), history)) == []
    assert [places for _, places in RULES.odd(pairs(1.01 * allowed_na), history)] == [
        (Place(0.0, 0.0), Place(0.0, 180.0))
    ]
