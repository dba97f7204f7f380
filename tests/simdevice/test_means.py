"""Means without records, where currents change slowly: the same as the means of the records."""

from dataclasses import replace

import numpy as np
import pytest

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
