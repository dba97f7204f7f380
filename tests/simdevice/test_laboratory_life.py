from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import kstest

from simdevice.bench import mean_currents
from simdevice.fleet import DAY, YEAR, Jump
from simdevice.laboratory_life import (
    LABORATORY_GYRO,
    NOISE,
    LivingStand,
    Move,
    Recertification,
    draw_laboratory,
)

ARCMIN = np.pi / 180 / 60
MOVES = {0: [Move(0.5 * YEAR, (0.0, ARCMIN, 0.0)), Move(0.7 * YEAR, (ARCMIN, 0.0, -ARCMIN))]}


@pytest.fixture(scope="module")
def laboratory():
    """Five gyros on two stands for a year; the first stand moves twice and is certified anew in between."""
    return draw_laboratory(
        3, gyros=5, stands=2, years=1.0, moves=MOVES, recertifications={0: [Recertification(0.6 * YEAR, 9)]}
    )


def test_every_gyro_comes_monthly_to_its_stand_in_a_start_of_its_own(laboratory):
    visits = laboratory.visits
    assert [visit.time for visit in visits] == sorted(visit.time for visit in visits)
    for gyro in range(5):
        mine = [visit for visit in visits if visit.gyro == gyro]
        assert [int(visit.time // (YEAR / 12)) for visit in mine] == list(range(12))
        assert {visit.stand for visit in mine} == {gyro % 2}
        assert len({visit.start for visit in mine}) == 12


def test_means_without_noise_are_the_benchs(laboratory):
    """Beside `simdevice.means`, which makes one session on one bench: with moved bases and new certificates."""
    means = laboratory.means(noise=0.0)
    for number in (0, 13, 31, 36, 45, 59):
        bench = laboratory.bench(number)
        single = mean_currents(
            replace(bench, noise=replace(bench.noise, angle_random_walk=0.0)), laboratory.positions
        )
        # The same closed form: rounding of microamperes.
        np.testing.assert_allclose(means.jx[number], single.jx, rtol=0, atol=1e-19)
        np.testing.assert_allclose(means.jy[number], single.jy, rtol=0, atol=1e-19)
        np.testing.assert_array_equal(means.angles[number], bench.stand.certificate.angles)


def test_noise_is_of_the_stated_size_normal_and_that_of_the_bench(laboratory):
    still, noisy = laboratory.means(noise=0.0), laboratory.means()
    single = mean_currents(laboratory.bench(7), laboratory.positions)
    np.testing.assert_allclose(noisy.u_jx[7], single.u_jx, rtol=1e-12)
    np.testing.assert_allclose(noisy.u_jy[7], single.u_jy, rtol=1e-12)
    assert noisy.u_jx[7][0] * laboratory.bench(7).gyro.kx == pytest.approx(NOISE, rel=1e-3)
    z = np.concatenate([(noisy.jx - still.jx) / noisy.u_jx, (noisy.jy - still.jy) / noisy.u_jy])
    # 1,920 deviates; one seed: p above 1e-3.
    assert kstest(z.ravel(), "norm").pvalue > 1e-3


def test_a_stand_moves_for_good_and_gets_its_certificates(laboratory):
    living = laboratory.stands[0]
    assert living.at(0.4 * YEAR).base == (0.0, 0.0, 0.0)
    assert living.at(0.5 * YEAR).base == (0.0, ARCMIN, 0.0)
    assert living.at(0.9 * YEAR).base == (ARCMIN, ARCMIN, -ARCMIN)
    assert [living.certificate(time * YEAR) for time in (0.59, 0.61)] == [0, 1]
    before, after = living.at(0.59 * YEAR), living.at(0.61 * YEAR)
    assert not np.array_equal(before.certificate.angles, after.certificate.angles)
    # The truth stays, but for the milliarcsecond of the printed certificate.
    position = laboratory.positions[5]
    np.testing.assert_allclose(before.misalignment(position), after.misalignment(position), atol=3e-9)
    assert LivingStand(living.birth).at(YEAR).base == living.birth.base


def test_the_truth_is_the_gyros_own_life(laboratory):
    gyros = list(laboratory.gyros)
    gyros[2] = replace(gyros[2], jumps=(Jump(100 * DAY, {"wk": 1e-6}),))
    changed = replace(laboratory, gyros=tuple(gyros))
    differences = [changed.truth(visit)[7] - laboratory.truth(visit)[7] for visit in laboratory.visits]
    expected = [1e-6 if visit.gyro == 2 and visit.time >= 100 * DAY else 0.0 for visit in laboratory.visits]
    # Rounding of a sum of 1e-5.
    np.testing.assert_allclose(differences, expected, atol=1e-20)


def test_starts_scatter_in_the_biases_alone(laboratory):
    scatter = LABORATORY_GYRO.start_scatter
    assert set(scatter) == {"w0x", "w0y"}
    truths = np.array([laboratory.truth(visit) for visit in laboratory.visits if visit.gyro == 0])
    moved = np.ptp(truths, axis=0) > 0
    assert moved.tolist() == [False] * 4 + [True] * 2 + [False] * 2


def test_equal_seeds_give_equal_laboratories():
    one, other = (draw_laboratory(8, gyros=2, stands=1, years=0.25) for _ in range(2))
    np.testing.assert_array_equal(one.means().jx, other.means().jx)
    assert not np.array_equal(one.means().jx, draw_laboratory(9, gyros=2, stands=1, years=0.25).means().jx)
