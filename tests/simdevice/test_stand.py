import numpy as np
import pytest
from numpy.typing import NDArray

from simdevice.certificate import Position, certify, draw_certificate, sixteen_positions
from simdevice.stand import Stand

Array = NDArray[np.float64]
OMEGA = 7.292115e-5  # rad/s, the Earth's rate (GRS 80)
ARCSEC = np.pi / 180 / 3600


def r1(t: float) -> Array:
    return np.array([[1, 0, 0], [0, np.cos(t), np.sin(t)], [0, -np.sin(t), np.cos(t)]])


def r2(t: float) -> Array:
    return np.array([[np.cos(t), 0, -np.sin(t)], [0, 1, 0], [np.sin(t), 0, np.cos(t)]])


def r3(t: float) -> Array:
    return np.array([[np.cos(t), np.sin(t), 0], [-np.sin(t), np.cos(t), 0], [0, 0, 1]])


def case_from_geographic(position: Position, angles: Array, base: tuple[float, float, float]) -> Array:
    """Paper, eq. (9), by passive matrices: R₃(γ)R₂(β)R₁(α) · R₃(ψ)R₁(θ) · R₃(ε₃)R₂(ε₂)R₁(ε₁)."""
    small = r3(angles[2]) @ r2(angles[1]) @ r1(angles[0])
    tilt = r3(base[2]) @ r2(base[1]) @ r1(base[0])
    turned: Array = small @ r3(position.psi) @ r1(position.theta) @ tilt
    return turned


def test_orientation_is_the_papers_for_any_angles() -> None:
    rng = np.random.default_rng(11)
    positions = [Position(*rng.uniform(0, 2 * np.pi, 2)) for _ in range(20)]
    angles = rng.normal(0, 0.5, (20, 3))  # tens of degrees: nothing may assume small angles
    base = (0.3, -0.4, 0.7)
    certificate = certify([p.theta for p in positions], [p.psi for p in positions], angles)
    stand = Stand(0.9, certificate, base)
    rate, force = stand.felt(positions)
    for row, position in enumerate(positions):
        turned = case_from_geographic(position, angles[row], base)
        # A few dozen roundings of numbers below 1.
        np.testing.assert_allclose(force[row], turned @ [0, 0, 1], rtol=0, atol=1e-14)
        earth = turned @ [0, np.cos(0.9), np.sin(0.9)]
        np.testing.assert_allclose(rate[row] / OMEGA, earth, rtol=0, atol=1e-14)


def test_what_the_case_feels_in_plain_words() -> None:
    latitude = np.radians(60.0)
    north, up = OMEGA * 0.5, OMEGA * np.sqrt(3) / 2
    places = [(0.0, 0.0), (np.pi / 2, 0.0), (np.pi / 2, np.pi / 2), (np.pi, 0.0), (0.0, np.pi / 2)]
    positions = [Position(*place) for place in places]
    rate, force = Stand(latitude, certify(*zip(*places, strict=True))).felt(positions)
    expected = [
        # case x, y, z:                   rate                 specific force
        ([0, north, up], [0, 0, 1]),  # x east, y north, z up
        ([0, up, -north], [0, 1, 0]),  # tipped back about east: y up, z south
        ([up, 0, -north], [1, 0, 0]),  # then turned about z: x up, y west
        ([0, -north, -up], [0, 0, -1]),  # upside down: y south
        ([north, 0, up], [0, 0, 1]),  # turned about the vertical: x north, y west
    ]
    # Rounding of cosines of right angles: below 1e-15.
    for row, (omega, n) in enumerate(expected):
        np.testing.assert_allclose(rate[row], omega, rtol=0, atol=1e-15 * OMEGA * 2)
        np.testing.assert_allclose(force[row], n, rtol=0, atol=2e-15)


def test_southern_latitude_turns_the_vertical_rate_down() -> None:
    rate, _ = Stand(-np.pi / 2, certify([0.0], [0.0])).felt([Position(0.0, 0.0)])
    np.testing.assert_allclose(rate[0], [0, 0, -OMEGA], rtol=0, atol=1e-15 * OMEGA)


def test_true_misalignment_is_certified_plus_deviation() -> None:
    certificate = draw_certificate(3, u_random=2 * ARCSEC, u_systematic=ARCSEC)
    stand = Stand(0.9, certificate, seed=5)
    for row, position in enumerate(sixteen_positions()):
        moved = stand.misalignment(position) - certificate.angles[row]
        # Subtraction of angles below 1e-3 rad: rounding 1e-19.
        np.testing.assert_allclose(moved, certificate.deviation(position, 5), rtol=0, atol=1e-18)
        assert moved.all()


def test_exactly_certified_stands_are_where_the_certificate_says() -> None:
    certificate = draw_certificate(3, u_random=0.0, u_systematic=0.0)
    stand = Stand(0.9, certificate, seed=5)
    truth = np.array([stand.misalignment(position) for position in sixteen_positions()])
    assert truth.tobytes() == certificate.angles.tobytes()


def test_one_position_alone_feels_the_same_bits() -> None:
    stand = Stand(0.9, draw_certificate(3), (1e-4, 2e-4, -1e-3), seed=5)
    positions = sixteen_positions()
    rate, force = stand.felt(positions)
    for row, position in enumerate(positions):
        alone_rate, alone_force = stand.felt([position])
        assert alone_rate[0].tobytes() == rate[row].tobytes()
        assert alone_force[0].tobytes() == force[row].tobytes()


def test_a_new_certificate_leaves_the_truth_and_errs_differently() -> None:
    stand = Stand(0.9, draw_certificate(3), (1e-4, 0.0, 0.0), seed=5)
    renewed = stand.recertified(6)
    for position in sixteen_positions():
        before, after = stand.misalignment(position), renewed.misalignment(position)
        # Half of the printed milliarcsecond, and rounding.
        assert np.abs(before - after).max() <= 0.0005 * ARCSEC * (1 + 1e-6)
    difference = (renewed.certificate.angles - stand.certificate.angles) / ARCSEC
    # Two errors of 0.5″ and 0.3″ each: differences of about 0.8″.
    assert 0.3 < np.std(difference) < 1.6
    assert renewed.base == stand.base


@pytest.mark.parametrize("latitude", [1.6, -1.6, np.nan])
def test_an_impossible_latitude_is_refused(latitude: float) -> None:
    with pytest.raises(ValueError, match="latitude"):
        Stand(latitude, draw_certificate(1))


def test_an_impossible_base_is_refused() -> None:
    with pytest.raises(ValueError, match="base"):
        Stand(0.9, draw_certificate(1), (0.0, np.inf, 0.0))
