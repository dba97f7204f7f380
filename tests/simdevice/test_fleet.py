import numpy as np
import pytest
from scipy.stats import chi2

from simdevice.bench import mean_currents
from simdevice.certificate import draw_certificate, sixteen_positions
from simdevice.fleet import DAY, REPAIRED, YEAR, Ageing, FleetGyro, Jump, demonstration_fleet
from simdevice.scenarios import DTG_4, GVK_6
from simdevice.stand import Stand

GYRO = FleetGyro(
    "1",
    GVK_6,
    GVK_6.nominal,
    seed=4,
    drift={"w0x": 2e-6 / YEAR},
    jumps=(Jump(100 * DAY, {"wk": 3e-6}), Jump(200 * DAY, {"wk": -1e-6, "w0y": 5e-7})),
)


def test_drift_is_linear_in_time() -> None:
    birth = GVK_6.nominal.w0x
    # One product and one sum: rounding.
    assert GYRO.settled(YEAR / 4).w0x - birth == pytest.approx(5e-7, rel=1e-9)
    assert GYRO.settled(YEAR).w0x - birth == pytest.approx(2e-6, rel=1e-9)
    assert GYRO.settled(0.0) == GVK_6.nominal


def test_jumps_stay_and_add_up() -> None:
    wk = GVK_6.nominal.wk
    assert GYRO.settled(100 * DAY - 1).wk == wk
    assert GYRO.settled(100 * DAY).wk == pytest.approx(wk + 3e-6, rel=1e-12)
    later = GYRO.settled(300 * DAY)
    assert later.wk == pytest.approx(wk + 2e-6, rel=1e-12)
    assert later.w0y == pytest.approx(GVK_6.nominal.w0y + 5e-7, rel=1e-12)


def test_starts_scatter_by_the_types_figure_around_the_settled_truth() -> None:
    starts = np.array([GYRO.truth(0.0, start).values for start in range(400)]) - GVK_6.nominal.values
    names = ("kx", "ky", "kxy", "kyx", "w0x", "w0y", "wg", "wk")
    std = np.array([GVK_6.start_scatter.get(name, 0.0) for name in names])
    assert not starts[:, std == 0].any()
    squares = np.sum((starts[:, std > 0] / std[std > 0]) ** 2, axis=0)
    # χ² with 400 degrees for each of six parameters: 99.99 % each.
    low, high = chi2.ppf([5e-5, 1 - 5e-5], 400)
    assert ((low < squares) & (squares < high)).all()


def test_one_start_has_one_scatter() -> None:
    early, late = GYRO.truth(0.0, 3), GYRO.truth(0.0, 3)
    assert early == late
    assert GYRO.truth(0.0, 4) != early


def test_sessions_of_one_start_differ_in_noise_only() -> None:
    stand = Stand(0.97, draw_certificate(1))
    one, other = (GYRO.bench(stand, 5 * DAY, 2, session) for session in (0, 1))
    assert one.gyro == other.gyro == GYRO.truth(5 * DAY, 2)
    positions = sixteen_positions()
    difference = mean_currents(one, positions).jx - mean_currents(other, positions).jx
    assert difference.all()
    # Two noises of about 1.1 nA each.
    assert np.abs(difference).max() < 6 * np.sqrt(2) * 1.13e-9


def test_ageing_settles_with_its_time_constant() -> None:
    gyro = FleetGyro("1", GVK_6, GVK_6.nominal, 4, ageing=(Ageing(50 * DAY, {"w0y": -2e-6}),))
    birth = GVK_6.nominal.w0y
    # 1 − 1/e of the change after one time constant, all of it in the end; differences of 1e-6: rounding.
    assert gyro.settled(0.0).w0y == birth
    assert gyro.settled(50 * DAY).w0y - birth == pytest.approx(-2e-6 * 0.6321205588285577, rel=1e-9)
    assert gyro.settled(100 * YEAR).w0y - birth == pytest.approx(-2e-6, rel=1e-9)


def test_the_demonstration_fleet_is_six_gyros_of_two_types_with_their_stories() -> None:
    fleet = {gyro.serial: gyro for gyro in demonstration_fleet(1)}
    assert sorted(gyro.kind.name for gyro in fleet.values()) == ["DTG-4"] * 2 + ["GVK-6"] * 4
    changed = {
        serial: {
            name
            for name in ("kx", "ky", "kxy", "kyx", "w0x", "w0y", "wg", "wk")
            if getattr(gyro.settled(YEAR), name) != getattr(gyro.settled(0.0), name)
        }
        for serial, gyro in fleet.items()
    }
    assert changed == {
        "0412": set(), "0417": {"w0x", "wg", "wk"}, "0419": {"w0x", "wg", "wk"}, "0423": {"w0y", "wk"},
        "D-031": {"w0y"}, "D-034": set(),
    }  # fmt: skip
    # Changes that a calibration sees: well beyond the start-to-start scatter.
    drifting, repaired, jumping, ageing, restless = list(fleet.values())[1:]
    assert drifting.settled(YEAR).w0x - drifting.birth.w0x > 10 * GVK_6.start_scatter["w0x"]
    assert (
        repaired.settled(REPAIRED[1]).w0x - repaired.settled(REPAIRED[1] - 1).w0x
        > 5 * GVK_6.start_scatter["w0x"]
    )
    assert jumping.settled(YEAR).wk - jumping.birth.wk > 10 * GVK_6.start_scatter["wk"]
    assert ageing.birth.w0y - ageing.settled(YEAR).w0y > 10 * DTG_4.start_scatter["w0y"]
    assert restless.kind.start_scatter["w0x"] > 3 * DTG_4.start_scatter["w0x"]


def test_gyros_of_a_fleet_are_individuals_and_repeatable() -> None:
    fleet = demonstration_fleet(1)
    assert len({gyro.birth for gyro in fleet}) == 6
    assert len({gyro.seed for gyro in fleet}) == 6
    assert fleet == demonstration_fleet(1)
    assert fleet[0].birth != demonstration_fleet(2)[0].birth
