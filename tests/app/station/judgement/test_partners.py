"""Sums of partners 180° apart: equal in good sessions, and what shows in bad ones."""

from dataclasses import replace
from itertools import product

import numpy as np
import pytest

from app.station.contracts import Currents, Place
from app.station.judgement.partners import by_angles_na, odd_pairs, partner_of, without_comparison
from simdevice.ammeter import Ammeter
from simdevice.bench import Bench, position_record, steady_currents
from simdevice.certificate import Position, certify
from simdevice.faults import Fault, Kind
from simdevice.gyro import Gyro
from simdevice.scenarios import GVK_6, scenario
from simdevice.stand import Stand
from solver.units import rad_from_arcsec, rad_from_deg, rad_per_s_from_deg_per_h

QUARTERS = [0.0, 90.0, 180.0, 270.0]
SIXTEEN = [Place(*angles) for angles in product(QUARTERS, QUARTERS)]
NA_PER_A = 1e9
SCALE = 2062.6  # °/h per mA of 10 rad/(s·A)


def perfect(
    gyro: Gyro = GVK_6.nominal, latitude_deg: float = 55.7558, spread_arcsec: float = 0.0, seed: int = 0
):
    """A bench without noise whose certified angles are of the given size, each with either sign."""
    rng = np.random.default_rng(seed)
    theta, psi = (np.radians([place[axis] for place in SIXTEEN]) for axis in (0, 1))
    angles = rad_from_arcsec(spread_arcsec) * rng.choice([-1.0, 1.0], (16, 3)) / np.sqrt(3.0)
    return Bench(gyro, Stand(rad_from_deg(latitude_deg), certify(theta, psi, angles)), Ammeter())


def means(bench: Bench, instead: dict[Place, Place] | None = None, noise_na: float = 0.0, seed: int = 0):
    """Mean currents of the sixteen places; some measured in another place than they say."""
    rng = np.random.default_rng(seed)
    true = [(instead or {}).get(place, place) for place in SIXTEEN]
    jx, jy = steady_currents(bench, [Position(*np.radians(place)) for place in true])
    noise = rng.normal(0.0, noise_na / 1e6, (16, 2)) if noise_na else np.zeros((16, 2))
    return {
        place: Currents(x * 1e3 + dx, y * 1e3 + dy)
        for place, x, y, (dx, dy) in zip(SIXTEEN, jx.tolist(), jy.tolist(), noise.tolist(), strict=True)
    }


def turned(place: Place, by_deg: float) -> Place:
    return Place(place.theta_deg, (place.psi_deg + by_deg) % 360.0)


@pytest.mark.parametrize("wn", [0.0, 0.5])
@pytest.mark.parametrize("latitude", [55.7558, 0.0, -33.9, 90.0])
def test_sums_are_the_same_for_all_pairs_with_anisoelasticity_too(latitude, wn):
    gyro = GVK_6.nominal.shifted({"wn": rad_per_s_from_deg_per_h(wn)})
    found = means(perfect(gyro, latitude))
    sums = np.array(
        [np.add(found[place], found[partner_of(place)]) for place in SIXTEEN if place.psi_deg < 180.0]
    )
    # Two currents of some µA: a few units of 1e-15 µA each.
    assert np.ptp(sums, axis=0) == pytest.approx(0.0, abs=1e-16)
    rates = np.array([[gyro.kx, gyro.kxy], [gyro.kyx, gyro.ky]]) @ sums[0] / 1e3
    assert rates == pytest.approx([-2.0 * gyro.w0x, -2.0 * gyro.w0y], rel=1e-9)
    assert odd_pairs(found, 1e-6) == ()


@pytest.mark.parametrize("size", [15.0, 60.0, 300.0, 7200.0])
def test_certified_angles_do_no_more_than_the_bound_says(size):
    """For 50 certificates whose angles turn each position by exactly so much; the bound is not generous either."""
    bound = by_angles_na(size, SCALE * 0.98, np.hypot(6.0, 2.0))  # smallest singular value
    worst = 0.0
    for seed in range(50):
        found = means(perfect(spread_arcsec=size, seed=seed))
        odd = odd_pairs(found, 0.0)
        worst = max(worst, odd[0].size_na)
    assert 0.2 * bound < worst < bound


def test_the_number_of_the_derivation():
    """60″ · 2 · 21 °/h / 2063 (°/h)/mA are 6 nA for a sum, twice that for a difference."""
    assert by_angles_na(60.0, 2063.0, 21.0 - 15.041) == pytest.approx(11.85, abs=0.01)


@pytest.mark.parametrize("by_deg", [90.0, 180.0, 270.0])
@pytest.mark.parametrize("place", SIXTEEN, ids=lambda place: f"{place.theta_deg:g}-{place.psi_deg:g}")
def test_a_position_that_stood_elsewhere_is_named_with_its_partner(place, by_deg):
    bench = scenario("gvk-6").bench(4)
    found = odd_pairs(means(bench, {place: turned(place, by_deg)}, noise_na=1.2), 100.0)
    assert len(found) == 1
    assert set(found[0].places) == {place, partner_of(place)}
    assert found[0].size_na > 1000.0
    assert f"θ {place.theta_deg:g}°" in found[0].message.text


def test_two_wrong_positions_in_different_pairs_are_both_named():
    first, second = Place(90.0, 0.0), Place(180.0, 270.0)
    wrong = {first: turned(first, 90.0), second: turned(second, 90.0)}
    named = [set(odd.places) for odd in odd_pairs(means(scenario("gvk-6").bench(4), wrong), 100.0)]
    assert {first, partner_of(first)} in named
    assert {second, partner_of(second)} in named
    assert len(named) == 2


def test_good_sessions_are_let_through():
    """Noise of the means 1.2 nA and angles of 15″: the tolerance of 100 nA is eight times what they do."""
    for seed in range(20):
        bench = scenario("gvk-6").bench(seed)
        assert odd_pairs(means(bench, noise_na=1.2, seed=seed), 100.0) == ()


def test_noise_within_its_coverage_is_let_through():
    """12 u are 7.6 standard deviations √2·√(1 + π/(2·7))·u of a difference: never among 8 pairs in 100 sessions."""
    bench = perfect()
    for seed in range(100):
        assert odd_pairs(means(bench, noise_na=5.0, seed=seed), 12 * 5.0) == ()


def test_fewer_than_three_pairs_tell_nothing():
    good = means(scenario("gvk-6").bench(4), {Place(0.0, 0.0): Place(0.0, 90.0)})
    two = {place: good[place] for place in SIXTEEN[:4]}
    assert odd_pairs(two, 100.0) == ()
    assert without_comparison(two) == tuple(SIXTEEN[:4])
    three = {place: good[place] for place in [*SIXTEEN[:4], SIXTEEN[4], SIXTEEN[6]]}
    assert without_comparison(three) == ()
    assert without_comparison(three | {SIXTEEN[8]: Currents(0.0, 0.0)}) == (SIXTEEN[8],)
    (odd,) = odd_pairs(three, 100.0)
    assert set(odd.places) == {Place(0.0, 0.0), Place(0.0, 180.0)}


def test_places_without_their_partner_are_left_out():
    good = means(perfect())
    assert odd_pairs({place: good[place] for place in SIXTEEN if place.psi_deg < 180.0}, 1e-6) == ()


def test_partners_are_found_whatever_turn_the_angles_are_written_with():
    good = means(perfect())
    shifted = {
        Place(p.theta_deg, p.psi_deg - 360.0 if p.psi_deg >= 180.0 else p.psi_deg): j for p, j in good.items()
    }
    shifted[Place(0.0, 0.0)] = Currents(1.0, 1.0)
    (odd,) = odd_pairs(shifted, 100.0)
    assert set(odd.places) == {Place(0.0, 0.0), Place(0.0, -180.0)}


def test_nothing_shows_where_the_gyro_feels_the_same_at_every_psi():
    """At a pole with θ = 0 only the spin axis feels anything: the mistake does no harm either."""
    place = Place(0.0, 90.0)
    assert odd_pairs(means(perfect(latitude_deg=90.0), {place: turned(place, 90.0)}), 1e-3) == ()


def test_exchanged_partners_do_not_show():
    one, two = Place(90.0, 0.0), Place(90.0, 180.0)
    assert odd_pairs(means(replace(perfect()), {one: two, two: one}), 1e-6) == ()


@pytest.mark.parametrize("psi", QUARTERS)
def test_the_simulators_fault_of_a_wrong_position_is_named(psi):
    """From whole records, noise and ammeter and all."""
    fault = Fault(Kind.WRONG_POSITION, *np.radians((90.0, psi)))
    bench = replace(scenario("full-noise").bench(6), faults=(fault,), duration=10.0)
    records = {place: position_record(bench, Position(*np.radians(place))) for place in SIXTEEN}
    found = odd_pairs({p: Currents(r.jx.mean() * 1e3, r.jy.mean() * 1e3) for p, r in records.items()}, 100.0)
    assert [set(odd.places) for odd in found] == [{Place(90.0, psi), partner_of(Place(90.0, psi))}]
