import math
from dataclasses import replace

import numpy as np
import pytest

from simdevice.gyro import Gyro
from simdevice.thermal import ROOM, Decay, Temperature, WarmUp

GYRO = Gyro(kx=10.0, ky=9.9, kxy=2.0, kyx=-1.5, w0x=7e-6, w0y=-4e-6, wg=3e-5, wk=1e-5, wn=1e-6)
RATE, FORCE = np.array([3e-5, -2e-5, 5e-5]), np.array([0.3, -0.5, 0.8])
SENSITIVITY = {"kx": -1e-2, "ky": 2e-2, "kxy": 1e-2, "kyx": 5e-3, "w0x": 1e-7, "w0y": -2e-7, "wg": 3e-7, "wk": -1e-7,
               "wn": 4e-8}  # fmt: skip


def test_warm_up_decays_per_bias() -> None:
    warm_up = WarmUp(Decay(2e-6, 600.0), Decay(-1e-6, 300.0))
    drifts = warm_up.drifts(np.array([0.0, 600.0]))
    assert drifts == pytest.approx(np.array([[2e-6, 2e-6 / math.e], [-1e-6, -1e-6 / math.e**2]]), rel=1e-15)
    assert not warm_up.quiet
    assert WarmUp().quiet
    assert not WarmUp(y=Decay(1e-9)).quiet


def test_temperature_rises_and_swings() -> None:
    temperature = Temperature(at_power_up=295.0, drift=1e-3, swing=0.5, period=1000.0)
    # A quarter and a half of the period.
    assert temperature.at(np.array([0.0, 250.0, 500.0])) == pytest.approx([295.0, 295.75, 295.5], rel=1e-14)


@pytest.mark.parametrize("only", [*SENSITIVITY, "all"])
def test_currents_are_those_of_the_gyro_at_its_temperature(only: str) -> None:
    sensitivity = SENSITIVITY if only == "all" else {only: SENSITIVITY[only]}
    temperature = Temperature(at_power_up=ROOM + 1.0, drift=0.1, sensitivity=sensitivity)
    t = np.array([0.0, 3.0, 40.0])
    added = temperature.currents(GYRO, RATE, FORCE, t)
    cold = np.array(GYRO.steady_currents(RATE, FORCE))
    for moment, column in zip(t, added.T, strict=True):
        warmer = 1.0 + 0.1 * moment
        gyro = GYRO.shifted({name: slope * warmer for name, slope in sensitivity.items()})
        # Differences of currents of 1e-5 A: their roundings.
        assert cold + column == pytest.approx(np.array(gyro.steady_currents(RATE, FORCE)), rel=0, abs=1e-20)
        assert np.abs(column).max() > 1e-10


def test_at_its_reference_the_gyro_is_itself() -> None:
    temperature = Temperature(at_power_up=300.0, reference=300.0, sensitivity=SENSITIVITY)
    assert not temperature.currents(GYRO, RATE, FORCE, np.array([0.0, 9.0])).any()
    assert (
        not replace(temperature, at_power_up=310.0, sensitivity={})
        .currents(GYRO, RATE, FORCE, np.zeros(2))
        .any()
    )


def test_what_cannot_be_is_refused() -> None:
    with pytest.raises(ValueError, match="amplitude must be"):
        Decay(math.nan)
    with pytest.raises(ValueError, match="time constant must be"):
        Decay(1.0, 0.0)
    with pytest.raises(ValueError, match="no parameter kz"):
        Temperature(sensitivity={"kz": 1.0})
    with pytest.raises(ValueError, match="must be finite"):
        Temperature(drift=math.inf)
    with pytest.raises(ValueError, match="period of the temperature's swing"):
        Temperature(period=0.0)
