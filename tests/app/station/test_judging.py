"""The judge by rules: what it makes of a laboratory's thresholds, a type's expectations and a run's history."""

from datetime import UTC, datetime

import numpy as np
import pytest

from app.exchange.rows import CurrentRecord
from app.station.contracts import Currents, Place
from app.station.instruments.description import SIMULATED, station_file
from app.station.judging import Rules
from app.station.keeping.entries import Acquiring, Started, Target
from app.station.keeping.history import Attempt, History

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


@pytest.mark.parametrize(
    ("noise_na", "creep_na_per_s", "still"), [(1.0, 0.0, True), (1e3, 0.0, None), (1.0, 0.1, False)]
)
def test_currents_that_nobody_can_tell_of_are_not_said_to_creep(noise_na, creep_na_per_s, still):
    """480 readings in 4800 s: u of the slope is 12^½·s/(480^½·4800 s), 3e-5 nA/s and 0.03 nA/s; the limit is 0.01."""
    noise = np.random.default_rng(12).normal(0.0, noise_na, (481, 2))
    watch = RULES.warming()
    for number, (x, y) in enumerate(noise + creep_na_per_s * 10.0 * np.arange(481)[:, None]):
        told = watch.add(10.0 * number, Currents(x * 1e-6, y * 1e-6))
    assert told is still


def test_a_record_that_does_not_go_on_from_the_reading_before_it_is_refused():
    """Samples scatter by 123 nA; a reading further off than 0.9 µA, at 7 standard deviations, is none of theirs."""
    rng = np.random.default_rng(1)
    t_s = np.arange(12000) / 200.0
    jx_ma, jy_ma = np.array([[0.004], [-0.002]]) + 123e-6 * rng.standard_normal((2, 12000))
    record = CurrentRecord(0.0, 0.0, t_s, jx_ma, jy_ma)

    def codes(*reading: float) -> list[tuple[str, object]]:
        started = Started(0, Target(0.0, 0.0), 0)
        attempt = Attempt(started, Acquiring(0, 1, datetime(2026, 3, 1, tzinfo=UTC), Currents(*reading)))
        history = History(gyro_type="GVK-6", attempts=[attempt])
        found = RULES.findings(record, False, started.target, history)
        assert {item.verdict for item in found} <= {"refused"}
        return [(item.said.code, item.said.values["channel"]) for item in found]

    assert codes(0.0045, -0.0024) == []
    assert codes(4.0, -2.0) == [("reading", "Jx"), ("reading", "Jy")]  # A taken for mA
    assert codes(-0.002, 0.004) == [("reading", "Jx"), ("reading", "Jy")]  # exchanged
    assert codes(0.004, -0.0035) == [("reading", "Jy")]
