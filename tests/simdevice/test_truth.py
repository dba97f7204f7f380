from dataclasses import replace

import numpy as np
import pytest

from simdevice.bench import Bench, mean_gyro, run_session
from simdevice.certificate import draw_certificate, sixteen_positions
from simdevice.gyro import Gyro
from simdevice.noise import RateNoise
from simdevice.stand import Stand
from simdevice.thermal import ROOM, Decay, Temperature, WarmUp
from simdevice.timetable import Timetable

GYRO = Gyro(kx=10.0, ky=9.9, kxy=0.0, kyx=0.0, w0x=7e-6, w0y=-4e-6, wg=3e-5, wk=1e-5)
QUIET = Bench(GYRO, Stand(0.97, draw_certificate(1), seed=2), duration=60.0, seed=3,
              timetable=Timetable(first=40.0, move=10.0, settle=5.0))  # fmt: skip
SIXTEEN = sixteen_positions()
BEGINS = 40.0 + 75.0 * np.arange(16)


def test_what_does_not_change_is_its_own_mean() -> None:
    noisy = replace(QUIET, noise=RateNoise(1e-7))
    assert mean_gyro(noisy, SIXTEEN) is GYRO


def test_warm_up_counts_with_its_mean_over_the_records() -> None:
    bench = replace(QUIET, warm_up=WarmUp(Decay(1e-6, 300.0), Decay(-2e-6, 500.0)))
    gyro = mean_gyro(bench, SIXTEEN)
    for name, amplitude, tau in (("w0x", 1e-6, 300.0), ("w0y", -2e-6, 500.0)):
        # ∫ exp(−t/τ) over each record; the midpoint rule's error is (60/64/τ)²/24 of it.
        each = amplitude * tau / 60.0 * (np.exp(-BEGINS / tau) - np.exp(-(BEGINS + 60.0) / tau))
        assert getattr(gyro, name) - getattr(GYRO, name) == pytest.approx(each.mean(), rel=1e-6)
    # Half of the session, another mean.
    first = mean_gyro(bench, SIXTEEN[:8]).w0x - GYRO.w0x
    assert first > mean_gyro(bench, SIXTEEN[8:]).w0x - GYRO.w0x > 0


def test_temperature_counts_with_its_mean() -> None:
    known = Temperature(at_power_up=ROOM - 1.0, drift=1e-3, sensitivity={"kx": 1e-3, "wg": -1e-8})
    gyro = mean_gyro(replace(QUIET, temperature=known), SIXTEEN)
    warmer = -1.0 + 1e-3 * (BEGINS.mean() + 30.0)
    assert gyro.kx == pytest.approx(10.0 + 1e-3 * warmer, rel=1e-14)
    assert gyro.wg == pytest.approx(3e-5 - 1e-8 * warmer, rel=1e-12)
    assert gyro.ky == GYRO.ky


def test_wander_and_turn_on_count_as_the_currents_show_them() -> None:
    bench = replace(QUIET, noise=RateNoise(bias_instability=3e-9, rate_random_walk=1e-10, turn_on=1e-7))
    session, still = run_session(bench, SIXTEEN), run_session(QUIET, SIXTEEN)
    for name, channel, scale in (("w0x", "jx", 10.0), ("w0y", "jy", 9.9)):
        lost = [
            getattr(plain, channel).mean() - getattr(moved, channel).mean()
            for moved, plain in zip(session.positions, still.positions, strict=True)
        ]
        # 64 moments of a record instead of its 12000 samples: 0.1·B each at most, over √16 records.
        expected = getattr(GYRO, name) + scale * np.mean(lost)
        assert getattr(session.truth, name) == pytest.approx(expected, rel=0, abs=0.03 * 3e-9)
        assert abs(expected - getattr(GYRO, name)) > 3e-9
