import numpy as np
import pytest

from simdevice.gyro import Gyro

GYRO = Gyro(kx=10.0, ky=-4.0, kxy=0.7, kyx=-0.3, w0x=3e-5, w0y=-2e-5, wg=4e-5, wk=1e-5, wn=6e-6)


def test_steady_currents_satisfy_the_full_model() -> None:
    rng = np.random.default_rng(3)
    rate = rng.normal(0, 7e-5, (50, 3))
    force = rng.normal(0, 1, (50, 3))
    jx, jy = GYRO.steady_currents(rate, force)
    nx, ny, nz = force.T
    # Paper, eq. (3) with no deflection, and the rotor held: torquer rate + drift = case rate.
    x = 10.0 * jx + 0.7 * jy + 3e-5 + 4e-5 * nx - 1e-5 * ny + 6e-6 * nx * nz
    y = -0.3 * jx - 4.0 * jy - 2e-5 + 1e-5 * nx + 4e-5 * ny + 6e-6 * ny * nz
    # A dozen roundings of terms up to 3e-4 rad/s: 12·1.1e-16·3e-4, well below 1e-12 of 7e-5 rad/s.
    np.testing.assert_allclose(x, rate[:, 0], rtol=0, atol=1e-12 * 7e-5)
    np.testing.assert_allclose(y, rate[:, 1], rtol=0, atol=1e-12 * 7e-5)


def test_one_position_alone_has_the_same_bits_as_among_others() -> None:
    rng = np.random.default_rng(4)
    rate, force = rng.normal(0, 7e-5, (7, 3)), rng.normal(0, 1, (7, 3))
    together = np.array(GYRO.steady_currents(rate, force))
    alone = np.array([GYRO.steady_currents(rate[i], force[i]) for i in range(7)]).T
    assert together.tobytes() == np.ascontiguousarray(alone).tobytes()


def test_values_stand_in_the_methods_order() -> None:
    assert GYRO.values.tolist() == [10.0, -4.0, 0.7, -0.3, 3e-5, -2e-5, 4e-5, 1e-5]


def test_shifted_adds_to_the_named_parameters_only() -> None:
    moved = GYRO.shifted({"wg": 1e-5, "wn": -6e-6})
    assert moved.wg == 4e-5 + 1e-5
    assert moved.wn == 0.0
    assert np.array_equal(np.delete(moved.values, 6), np.delete(GYRO.values, 6))


def test_shifted_refuses_an_unknown_parameter() -> None:
    with pytest.raises(ValueError, match="no parameter kz"):
        GYRO.shifted({"kz": 1.0})


def test_a_gyro_whose_torquers_act_about_one_axis_is_refused() -> None:
    with pytest.raises(ValueError, match="one axis only"):
        Gyro(kx=2.0, ky=3.0, kxy=6.0, kyx=1.0, w0x=0, w0y=0, wg=0, wk=0)


def test_a_value_that_is_not_finite_is_refused_by_name() -> None:
    with pytest.raises(ValueError, match="w0y is nan"):
        Gyro(kx=2.0, ky=3.0, kxy=0, kyx=0, w0x=0, w0y=float("nan"), wg=0, wk=0)
