import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from solver import geometry
from tests.solver.sessions import grid, to_case

ROUNDING = 1e-15  # a few products of numbers up to 1: some 2⁻⁵³ each
angle = st.floats(-20.0, 20.0)


@pytest.mark.parametrize(
    ("rotate", "axis"), [(geometry.rotation_1, 0), (geometry.rotation_2, 1), (geometry.rotation_3, 2)]
)
def test_elementary_rotations_turn_the_frame(rotate, axis):
    turned = rotate(np.array([0.3, -2.0]))
    for matrix, angle in zip(turned, (0.3, -2.0), strict=True):
        # Turning the frame forwards turns the vector's components backwards.
        expected = Rotation.from_rotvec(-angle * np.eye(3)[axis]).as_matrix()
        np.testing.assert_allclose(matrix, expected, rtol=0, atol=ROUNDING)


def test_rotation_1_is_the_one_written_in_the_specification():
    cosine, sine = np.cos(0.7), np.sin(0.7)
    np.testing.assert_array_equal(
        geometry.rotation_1(0.7), [[1, 0, 0], [0, cosine, sine], [0, -sine, cosine]]
    )


@given(angle, angle, angle, angle, angle, angle, angle, angle)
def test_every_orientation_is_a_rotation(theta, psi, alpha, beta, gamma, level_1, level_2, azimuth):
    base = geometry.base(level_1, level_2, azimuth)
    matrix = geometry.case_orientation(theta, psi, alpha, beta, gamma, base)
    np.testing.assert_allclose(matrix @ matrix.T, np.eye(3), rtol=0, atol=10 * ROUNDING)
    assert abs(np.linalg.det(matrix) - 1) < 10 * ROUNDING


@given(angle, angle, angle, angle, angle)
def test_orientation_is_that_of_an_independent_route(theta, psi, alpha, beta, gamma):
    matrix = geometry.case_orientation(theta, psi, alpha, beta, gamma)
    expected = to_case(np.array([[theta, psi]]), np.array([[alpha, beta, gamma]]))[0]
    # The other route reduces angles of up to 20 rad by half angles: 20·2⁻⁵³ each.
    np.testing.assert_allclose(matrix, expected, rtol=0, atol=20 * ROUNDING)


def test_the_base_turns_first(rng):
    level_1, level_2, azimuth, *angles = rng.uniform(-0.5, 0.5, 8)
    base = geometry.base(level_1, level_2, azimuth)
    expected = Rotation.from_rotvec([0, 0, -azimuth]) * Rotation.from_rotvec([0, -level_2, 0])
    expected = expected * Rotation.from_rotvec([-level_1, 0, 0])
    np.testing.assert_allclose(base, expected.as_matrix(), rtol=0, atol=ROUNDING)
    np.testing.assert_allclose(
        geometry.case_orientation(*angles, base),
        geometry.case_orientation(*angles) @ base,
        rtol=0,
        atol=ROUNDING,
    )


def test_sixteen_positions_of_the_paper():
    """Commanded positions at right angles: where the platform's x and y point, by hand.

    At θ = 0, ψ = 0 x points east and y north; ψ turns x towards y; θ lifts the north side of the
    platform, so that at θ = 90° y points up.
    """
    north_x, north_y, up_x, up_y, up_z = geometry.elements(geometry.commanded(*np.radians(grid()).T))
    sine, cosine = np.array([0, 1, 0, -1]), np.array([1, 0, -1, 0])  # of 0, 90, 180, 270°
    for row, (sine_theta, cosine_theta) in enumerate(zip(sine, cosine, strict=True)):
        part = slice(4 * row, 4 * row + 4)
        np.testing.assert_allclose(north_x[part], cosine_theta * sine, rtol=0, atol=4e-16)
        np.testing.assert_allclose(north_y[part], cosine_theta * cosine, rtol=0, atol=4e-16)
        np.testing.assert_allclose(up_x[part], sine_theta * sine, rtol=0, atol=4e-16)
        np.testing.assert_allclose(up_y[part], sine_theta * cosine, rtol=0, atol=4e-16)
        np.testing.assert_allclose(up_z[part], cosine_theta, rtol=0, atol=4e-16)


def test_orientations_are_stacked_along_the_leading_axes(rng):
    angles = rng.uniform(-3, 3, (5, 4, 7))
    stacked = geometry.case_orientation(*angles)
    assert stacked.shape == (4, 7, 3, 3)
    np.testing.assert_array_equal(stacked[2, 3], geometry.case_orientation(*angles[:, 2, 3]))
