"""Means without records: the distribution of the records' means, and slow parts as the records have them."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import chi2

from simdevice.ammeter import Ammeter, Channel
from simdevice.bench import Bench, mean_currents, run_session, steady_currents
from simdevice.certificate import draw_certificate, sixteen_positions
from simdevice.dynamics import GVK_6
from simdevice.faults import parse
from simdevice.gyro import Gyro
from simdevice.interference import Interference
from simdevice.noise import RateNoise
from simdevice.stand import Stand
from simdevice.thermal import ROOM, Decay, Temperature, WarmUp
from simdevice.timetable import Timetable

GYRO = Gyro(kx=10.0, ky=9.9, kxy=2.0, kyx=-1.5, w0x=7e-6, w0y=-4e-6, wg=3e-5, wk=1e-5)
STAND = Stand(0.97, draw_certificate(1), seed=2)
SIXTEEN = sixteen_positions(repeats=2)
UNSTEADY = Bench(
    GYRO, STAND, duration=30.0, seed=3, timetable=Timetable(first=20.0),
    noise=RateNoise(bias_instability=3e-9, rate_random_walk=1e-10, turn_on=1e-7),
    warm_up=WarmUp(Decay(1e-6, 300.0), Decay(-2e-6, 200.0)),
    temperature=Temperature(at_power_up=ROOM, drift=1e-3, sensitivity={"kx": -1e-3, "wg": 1e-8}),
)  # fmt: skip


ONCE = sixteen_positions()
CHANNEL = Channel(step=1e-9, limit=1e-3, noise=5e-8)
BENCH = Bench(GYRO, STAND, Ammeter(CHANNEL, CHANNEL), RateNoise(8e-8), rate=200.0, duration=2.0, seed=3)
COARSE = Channel(gain=1.001, offset=2e-9, step=3e-7, limit=1e-3, noise=5e-8)


@pytest.mark.parametrize("channel", [CHANNEL, COARSE], ids=["fine", "coarse"])
def test_means_and_records_share_one_distribution(channel: Channel) -> None:
    bench = replace(BENCH, ammeter=Ammeter(channel, channel))
    positions = sixteen_positions(repeats=20)
    means = mean_currents(bench, positions)
    session = run_session(bench, positions)
    from_records = np.array(
        [[p.jx.mean() for p in session.positions], [p.jy.mean() for p in session.positions]]
    )
    expected = np.array(
        [
            [channel.moments(current, np.hypot(*row) * 8e-8 * np.sqrt(200.0))[0] for current in currents]
            for row, currents in zip(
                np.linalg.inv([[10.0, 2.0], [-1.5, 9.9]]), steady_currents(bench, positions), strict=True
            )
        ]
    )
    u = np.array([means.u_jx, means.u_jy])
    low, high = chi2.ppf([0.0005, 0.9995], len(positions))
    for drawn in (np.array([means.jx, means.jy]), from_records):
        # 320 independent means per channel, standardised by the u that `mean_currents` states.
        squares = np.sum(((drawn - expected) / u) ** 2, axis=1)
        assert ((low < squares) & (squares < high)).all()


def test_stated_uncertainty_of_a_mean_is_that_of_white_noise() -> None:
    means = mean_currents(replace(BENCH, duration=60.0), ONCE)
    inverse = np.linalg.inv([[10.0, 2.0], [-1.5, 9.9]])
    # N/√T through the torquers, the ammeter's noise over √n, and 1 nA steps as step²/12 per sample.
    rate = np.hypot(*inverse.T) * 8e-8 / np.sqrt(60.0)
    expected = np.sqrt(rate**2 + ((5e-8) ** 2 + 1e-18 / 12) / 12000)
    # Rounding only: the quantisation of a noise of 100 steps adds exactly step²/12.
    np.testing.assert_allclose(means.u_jx, expected[0], rtol=1e-12)
    np.testing.assert_allclose(means.u_jy, expected[1], rtol=1e-12)
    assert (means.duration, means.rate) == (60.0, 200.0)


def test_means_keep_the_correlation_that_cross_coupling_makes() -> None:
    gyro = replace(GYRO, kxy=8.0, kyx=2.0)
    bench = replace(BENCH, gyro=gyro, ammeter=Ammeter())
    positions = sixteen_positions(repeats=60)
    means = mean_currents(bench, positions)
    jx, jy = steady_currents(bench, positions)
    zx, zy = (means.jx - jx) / means.u_jx, (means.jy - jy) / means.u_jy
    inverse = np.linalg.inv([[10.0, 8.0], [2.0, 9.9]])
    covariance = inverse @ inverse.T
    rho = covariance[0, 1] / np.sqrt(covariance[0, 0] * covariance[1, 1])
    assert abs(rho) > 0.5
    # A sample correlation of n pairs has deviation (1 − ρ²)/√n; four of them.
    assert np.mean(zx * zy) / np.sqrt(np.mean(zx**2) * np.mean(zy**2)) == pytest.approx(
        rho, abs=4 * (1 - rho**2) / np.sqrt(len(positions))
    )


def test_means_without_noise_are_exact_and_certain() -> None:
    bench = replace(BENCH, ammeter=Ammeter(), noise=RateNoise())
    means = mean_currents(bench, ONCE)
    jx, jy = steady_currents(bench, ONCE)
    assert np.array_equal(means.jx, jx)
    assert np.array_equal(means.jy, jy)
    assert not means.u_jx.any()
    assert not means.u_jy.any()


def test_means_do_not_depend_on_order_or_company() -> None:
    whole = mean_currents(BENCH, sixteen_positions(repeats=2))
    part = mean_currents(BENCH, list(reversed(ONCE))[:5])
    rows = [15, 14, 13, 12, 11]
    assert part.jx.tobytes() == whole.jx[rows].tobytes()
    assert part.jy.tobytes() == whole.jy[rows].tobytes()
    assert part.repeat.tolist() == [0] * 5


def of_records(bench: Bench) -> tuple[np.ndarray, np.ndarray]:
    positions = run_session(bench, SIXTEEN).positions
    return np.array([p.jx.mean() for p in positions]), np.array([p.jy.mean() for p in positions])


def test_slow_parts_have_the_mean_of_their_record() -> None:
    means = mean_currents(UNSTEADY, SIXTEEN)
    for mean, record, steady in zip(
        (means.jx, means.jy), of_records(UNSTEADY), steady_currents(UNSTEADY, SIXTEEN), strict=True
    ):
        # An ideal ammeter: means of 6000 numbers below 1e-5 A, in another order of summing.
        np.testing.assert_allclose(mean, record, rtol=0, atol=1e-18)
        assert np.abs(mean - steady).min() > 1e-11
    assert not means.u_jx.any()


def test_a_limit_cuts_what_changes_piece_by_piece() -> None:
    """Currents that run into the limit within the record."""
    warming = replace(UNSTEADY, warm_up=WarmUp(Decay(3e-5, 30.0), Decay(3e-5, 30.0)))
    channel = Channel(limit=3e-6)
    bench = replace(warming, ammeter=Ammeter(channel, channel))
    means = mean_currents(bench, SIXTEEN)
    free = mean_currents(warming, SIXTEEN)
    cut = 0
    for mean, record, ideal in zip((means.jx, means.jy), of_records(bench), (free.jx, free.jy), strict=True):
        # One of 64 pieces may lie across the limit: the current moves by less than 3 µA/64 in it.
        np.testing.assert_allclose(mean, record, rtol=0, atol=3e-6 / 64 / 64)
        cut += np.count_nonzero(np.abs(mean - np.clip(ideal, -3e-6, 3e-6)) > 1e-8)
    assert cut > 0  # cutting the mean would not have done


def test_uncertainty_stays_that_of_the_white_noise() -> None:
    white = replace(UNSTEADY.noise, angle_random_walk=8e-8)
    noisy = mean_currents(replace(UNSTEADY, noise=white), SIXTEEN)
    steady = mean_currents(Bench(GYRO, STAND, noise=RateNoise(8e-8), duration=30.0, seed=3), SIXTEEN)
    # 64 pieces pooled: roundings.
    np.testing.assert_allclose(noisy.u_jx, steady.u_jx, rtol=1e-13)
    # The white error is the same number on top of whatever the currents are.
    drawn = noisy.jx - mean_currents(UNSTEADY, SIXTEEN).jx
    plain = replace(UNSTEADY, noise=RateNoise())
    still = replace(plain, warm_up=WarmUp(), temperature=None)
    np.testing.assert_allclose(drawn, steady.jx - steady_currents(still, SIXTEEN)[0], rtol=0, atol=1e-18)


@pytest.mark.parametrize(
    ("part", "named"),
    [
        ({"loop": GVK_6}, "the rebalance loop"),
        ({"interference": Interference(mains=1e-9)}, "mains, ripple or jitter"),
        ({"interference": Interference(jitter=1e-6)}, "mains, ripple or jitter"),
        ({"faults": (parse("spike"),)}, "faults"),
    ],
    ids=["loop", "mains", "jitter", "faults"],
)
def test_what_only_a_record_shows_is_refused(part: dict[str, object], named: str) -> None:
    with pytest.raises(ValueError, match=f"without their records: the bench has {named}. Make the records"):
        mean_currents(replace(UNSTEADY, **part), SIXTEEN)
