"""What stand and ammeter have in common: where the case is, and what is measured there."""

from dataclasses import replace

import numpy as np
import pytest

from simdevice.bench import position_record, steady_currents
from simdevice.certificate import Position, certify
from simdevice.clock import Clock
from simdevice.faults import parse
from simdevice.laboratory import Laboratory
from simdevice.scenarios import scenario
from solver.units import rad_from_deg
from tests.simdevice.instruments import Bench, told


def position(theta_deg, psi_deg, take=0):
    return Position(rad_from_deg(theta_deg), rad_from_deg(psi_deg), take)


def columns(record):
    return np.column_stack([np.arange(len(record.t)), record.t, record.jx, record.jy])


def reading(bench):
    return np.array([float(part) for part in told(bench.ammeter, "MEAS:CURR?").split(",")])


@pytest.mark.parametrize("take", [0, 2])
def test_an_acquired_record_is_that_of_the_bench(take):
    bench = Bench()
    bench.moved(90, 180)
    expected = columns(position_record(bench.bench, position(90, 180, take)))
    assert np.array_equal(bench.acquired(bench.bench.samples, take), expected)


def test_a_shorter_acquisition_is_the_beginning_of_a_longer_one():
    bench = Bench()
    bench.moved(90, 180)
    whole = bench.acquired(12_000)
    assert np.array_equal(bench.acquired(700), whole[:700])


def test_a_record_depends_on_no_history():
    """A process that is killed and started again, later and after other movements, measures the same."""
    one, other = Bench("full-noise"), Bench("full-noise")
    one.moved(0, 90)
    other.wait(12_345.6)
    other.moved(180, 0)
    other.acquired(500, 1)
    other.moved(270, 270)
    other.moved(0, 90)
    assert np.array_equal(one.acquired(2000), other.acquired(2000))


def test_another_rate_is_another_record_in_the_same_slot():
    bench = Bench("full-noise")
    told(bench.ammeter, "SENS:RATE 100;:ACQ:COUN 300;:INIT")
    expected = position_record(replace(bench.bench, rate=100.0), position(0, 0), 300)
    assert np.array_equal(bench.laboratory.acquisition.rows, columns(expected))
    assert expected.t[-1] == pytest.approx(2.99, abs=1e-12)  # rounding


def test_a_wrong_position_is_measured_and_the_next_movement_goes_right():
    bench, sound = Bench(faults=["wrong-position@90/180"]), Bench()
    for item in (bench, sound):
        item.moved(90, 180)
    # What the encoders say is in `test_stand_device`; the case stands at 90/270.
    expected = position_record(
        replace(bench.bench, faults=(parse("wrong-position@90/180"),)), position(90, 180)
    )
    assert np.array_equal(bench.acquired(1000), columns(expected)[:1000])
    there = np.ravel(steady_currents(bench.bench, [position(90, 270)]))
    mean = bench.acquired(1000)[:, 2:].mean(axis=0)
    # Noise of a mean: 3e-4 °/√h is 8.7e-8 rad/√s, over 10 rad/(s·A) and √5 s 4e-9 A; five of them.
    assert np.abs(mean - there).max() < 2e-8
    assert np.abs(there - np.ravel(steady_currents(bench.bench, [position(90, 180)]))).max() > 1e-7
    bench.moved(90, 180)
    assert np.array_equal(bench.acquired(1000), sound.acquired(1000))


def test_a_second_take_at_a_wrong_position_without_a_movement_is_as_wrong():
    bench = Bench("quiet", faults=["wrong-position@90/180"])
    bench.moved(90, 180)
    first, second = bench.acquired(10, 0), bench.acquired(10, 1)
    assert np.array_equal(first, second)


def test_every_movement_goes_wrong_where_the_fault_says_so():
    bench = Bench("quiet", faults=["wrong-position@0/0!"])
    for _ in range(2):
        bench.moved(90, 0)
        bench.moved(0, 0)
        expected = np.ravel(steady_currents(bench.bench, [position(0, 90)]))
        assert np.array_equal(bench.acquired(1)[0, 2:], expected)


def test_a_stand_that_was_not_homed_stands_at_its_first_position():
    bench = Bench("quiet")
    assert np.array_equal(bench.acquired(1)[0, 2:], np.ravel(steady_currents(bench.bench, [position(0, 0)])))


@pytest.mark.parametrize("place", [(0, 0), (90, 180), (270, 90)])
def test_a_reading_at_rest_is_the_steady_current(place):
    bench = Bench("quiet")
    bench.moved(*place)
    expected = np.ravel(steady_currents(bench.bench, [position(*place)]))
    # Printed with nine decimals; transients are over after a minute.
    np.testing.assert_allclose(reading(bench), expected, rtol=1e-9)


def test_readings_scatter_like_means_of_a_tenth_of_a_second():
    bench = Bench("gvk-6")
    bench.moved(0, 0)
    found = []
    for _ in range(2000):
        found.append(reading(bench))
        bench.wait(0.1)
    # 3e-4 °/√h over √0.1 s is 2.76e-7 rad/s, over 10 rad/(s·A) 2.8e-8 A; 20 samples of 5 nA add 1 nA.
    sample_std = bench.bench.noise.sample_std(10.0)
    expected = np.hypot(sample_std / np.array([10.0, 9.9]), 5e-9 / np.sqrt(20))
    # The standard deviation of s is s/√(2n) = 1.6 %: four of them. Cross-coupling of 5e-3 is nothing.
    np.testing.assert_allclose(np.std(found, axis=0, ddof=1), expected, rtol=0.065)


def test_a_reading_within_the_same_tenth_of_a_second_is_the_same():
    bench = Bench()
    first = reading(bench)
    assert np.array_equal(reading(bench), first)
    bench.wait(0.1)
    assert not np.array_equal(reading(bench), first)


def test_readings_follow_the_warm_up():
    """`cold-start` drifts while it warms up, and what is shown follows the time since power-on."""
    bench, hours = Bench("cold-start"), 8 * 3600.0

    def mean_reading():
        found = []
        for _ in range(100):
            found.append(reading(bench))
            bench.wait(0.1)
        return np.mean(found, axis=0)

    first = mean_reading()
    bench.wait(hours)
    drifts = bench.bench.warm_up.drifts(np.array([5.0, hours]))
    expected = -(drifts[:, 0] - drifts[:, 1]) / np.array([10.0, 9.9])
    # A mean of 100 readings of 2.8e-8 A has 2.8e-9 A; five times √2 of it.
    np.testing.assert_allclose(first - mean_reading(), expected, rtol=0, atol=2e-8)
    assert np.abs(expected).min() > 8e-8, "a drift that noise could hide shows nothing"


def test_after_a_day_readings_wander_no_more():
    """A process started again after a year need not draw the year's noise before it answers."""
    bench = Bench("full-noise")
    bench.wait(86_400.0)
    bench.laboratory.currents()
    bench.wait(365 * 86_400.0)
    late = reading(bench)
    # 2.8e-8 A of noise, five of √2 times that, and what the temperature does in a day.
    np.testing.assert_allclose(
        late, np.ravel(steady_currents(bench.bench, [position(0, 0)])), rtol=0, atol=1e-6
    )


def test_between_its_positions_the_case_feels_where_the_encoders_say_it_is():
    bench = Bench("quiet")
    told(bench.stand, "AXIS:HOME")
    bench.wait(10)
    told(bench.stand, "AXIS:POS 90,0")
    bench.wait(2)
    told(bench.stand, "ABOR")
    stand = replace(bench.bench.stand, certificate=certify([np.pi / 4], [0.0]))
    expected = np.ravel(steady_currents(replace(bench.bench, stand=stand), [Position(np.pi / 4, 0.0)]))
    np.testing.assert_allclose(reading(bench), expected, rtol=1e-9)


def test_a_stalled_stand_does_not_turn():
    bench = Bench("quiet", faults=["stall@90/0"])
    bench.moved(90, 0)
    # The Earth turns 7.3e-5 rad/s; turning at 30 °/s would be 0.05 A.
    assert np.abs(reading(bench)).max() < 1e-4


def test_faults_without_a_place_get_the_same_one_every_time():
    names = [parse("stall"), parse("spike"), parse("interrupted")]
    bench = scenario("gvk-6").bench(3)
    one, other = (Laboratory(bench, Clock(0.0), names) for _ in range(2))
    assert [str(item) for item in one.bench.faults] == [str(item) for item in other.bench.faults]
    assert len(one.bench.faults) == 1


def test_a_fault_at_a_place_that_there_is_not_is_refused():
    with pytest.raises(ValueError, match="no position"):
        Laboratory(scenario("gvk-6").bench(3), Clock(0.0), [parse("stall@45/0")])


class TestClock:
    def test_laboratory_time_runs_faster_from_power_on(self):
        now = {"wall": 1000.0, "steady": 50.0}
        clock = Clock(990.0, 100.0, lambda: now["wall"], lambda: now["steady"])
        assert clock.now() == 1000.0
        now["steady"] += 2.0
        assert clock.now() == 1200.0
        assert clock.wall_seconds(100.0) == 1.0

    def test_a_jump_of_the_walls_clock_moves_nothing(self):
        now = {"wall": 1000.0, "steady": 50.0}
        clock = Clock(990.0, 1.0, lambda: now["wall"], lambda: now["steady"])
        now["wall"] -= 500.0
        assert clock.now() == 10.0

    @pytest.mark.parametrize(
        ("powered_on", "speed"), [(2000.0, 1.0), (0.0, 0.0), (0.0, np.inf), (0.0, np.nan)]
    )
    def test_power_on_is_past_and_time_goes_on(self, powered_on, speed):
        with pytest.raises(ValueError):
            Clock(powered_on, speed, lambda: 1000.0)
