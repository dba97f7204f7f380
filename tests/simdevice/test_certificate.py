import numpy as np
import pytest
from scipy.stats import chi2

from simdevice.certificate import Position, certify, draw_certificate, sixteen_positions

ARCSEC = np.pi / 180 / 3600


def test_sixteen_positions_are_theta_outer_psi_inner() -> None:
    degrees = [(round(np.degrees(p.theta)), round(np.degrees(p.psi)), p.repeat) for p in sixteen_positions()]
    assert degrees == [(theta, psi, 0) for theta in (0, 90, 180, 270) for psi in (0, 90, 180, 270)]


def test_repeats_follow_as_further_rounds() -> None:
    rounds = sixteen_positions(repeats=3)
    assert [p.repeat for p in rounds] == [0] * 16 + [1] * 16 + [2] * 16
    assert [p.place for p in rounds[16:32]] == [p.place for p in rounds[:16]]


@pytest.mark.parametrize(
    ("degrees", "milliarcseconds"),
    [(0.0, 0), (90.0, 324_000_000), (270.0, 972_000_000), (-90.0, 972_000_000), (360.0, 0),
     (450.0, 324_000_000), (0.0001, 360), (359.9999999999, 0)],
)  # fmt: skip
def test_a_place_is_whole_milliarcseconds_of_one_turn(degrees: float, milliarcseconds: int) -> None:
    assert Position(np.radians(degrees), 0.0).place == (milliarcseconds, 0)
    assert Position(0.0, np.radians(degrees), 2).key == (0, milliarcseconds, 2)


def test_a_certificate_finds_its_row_whatever_the_turn() -> None:
    certificate = draw_certificate(1)
    assert certificate.row_of(Position(-np.pi / 2, 2 * np.pi)) == 12  # θ = 270°, ψ = 0
    assert certificate.row_of(Position(0.0, np.pi / 2, repeat=3)) == 1


def test_a_position_outside_the_certificate_is_named() -> None:
    with pytest.raises(ValueError, match="no position θ = 45°, ψ = 90°"):
        draw_certificate(1).row_of(Position(np.pi / 4, np.pi / 2))


def test_drawn_angles_are_of_the_spread_asked_for() -> None:
    angles = np.array([draw_certificate(seed, spread=20 * ARCSEC).angles for seed in range(40)])
    # 40·16·3 independent normal angles: their sum of squares over σ² is χ² with 1920 degrees.
    low, high = chi2.ppf([0.0005, 0.9995], angles.size)
    assert low < np.sum(angles**2) / (20 * ARCSEC) ** 2 < high


def test_drawn_angles_are_whole_milliarcseconds() -> None:
    milliarcseconds = draw_certificate(9).angles / ARCSEC * 1000
    # 1e5 milliarcseconds at most, known to a few eps: 1e-10.
    np.testing.assert_allclose(milliarcseconds, np.rint(milliarcseconds), rtol=0, atol=1e-9)


def test_more_positions_leave_a_drawn_certificate_as_it_was() -> None:
    few = sixteen_positions()[3:7]
    more = (Position(0.3, 1.1), *reversed(sixteen_positions()))
    small, large = draw_certificate(2, few), draw_certificate(2, more)
    rows = [large.row_of(position) for position in few]
    assert small.angles.tobytes() == large.angles[rows].tobytes()


def test_repeats_of_a_place_are_certified_once() -> None:
    assert len(draw_certificate(2, sixteen_positions(repeats=2)).theta) == 16


def test_deviation_has_the_stated_random_and_common_part() -> None:
    u_random, u_common = np.array([1.0, 2.0, 3.0]) * ARCSEC, np.array([0.5, 4.0, 0.0]) * ARCSEC
    certificate = draw_certificate(0, u_random=u_random, u_systematic=u_common)
    seeds, places = 300, 16
    drawn = np.array(
        [[certificate.deviation(position, seed) for position in sixteen_positions()] for seed in range(seeds)]
    )
    # Within one seed the common part drops out: Σ(x − x̄)²/u² is χ² with 15 degrees per seed.
    within = np.sum((drawn - drawn.mean(axis=1, keepdims=True)) ** 2, axis=(0, 1)) / u_random**2
    low, high = chi2.ppf([0.0005, 0.9995], seeds * (places - 1))
    assert ((low < within) & (within < high)).all()
    # The mean over the places has variance u_common² + u_random²/16.
    between = np.sum(drawn.mean(axis=1) ** 2, axis=0) / (u_common**2 + u_random**2 / places)
    low, high = chi2.ppf([0.0005, 0.9995], seeds)
    assert ((low < between) & (between < high)).all()


def test_deviation_is_the_same_for_every_repeat_and_any_other_positions() -> None:
    wide = draw_certificate(0, u_random=ARCSEC)
    narrow = draw_certificate(0, sixteen_positions()[5:6], u_random=ARCSEC)
    place = sixteen_positions()[5]
    again = Position(place.theta, place.psi, repeat=4)
    assert wide.deviation(place, 8).tobytes() == narrow.deviation(again, 8).tobytes()


def test_a_perfectly_known_stand_does_not_deviate() -> None:
    certificate = draw_certificate(0, u_random=0.0, u_systematic=0.0)
    assert not certificate.deviation(sixteen_positions()[0], 8).any()


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"theta": [0.0, 1.0], "psi": [0.0]}, "as many ψ as θ"),
        ({"theta": [0.0, 2 * np.pi], "psi": [1.0, 1.0]}, "each position once"),
        ({"theta": [0.0], "psi": [0.0], "angles": np.nan}, "finite"),
        ({"theta": [0.0], "psi": [0.0], "u_random": -1.0}, "not be negative"),
        ({"theta": [0.0], "psi": [0.0], "u_systematic": -1.0}, "not be negative"),
    ],
)
def test_unusable_certificates_are_refused(arguments: dict[str, object], words: str) -> None:
    with pytest.raises(ValueError, match=words):
        certify(**arguments)


def test_positions_that_cannot_be_are_refused() -> None:
    with pytest.raises(ValueError, match="count from 0"):
        Position(0.0, 0.0, -1)
    with pytest.raises(ValueError, match="finite"):
        Position(np.nan, 0.0)
