"""Live currents follow the actual time; at the times of the timetable they are a record without its noise."""

from dataclasses import replace

import numpy as np
import pytest

from simdevice.bench import position_record, steady_currents
from simdevice.certificate import Position, sixteen_positions
from simdevice.faults import parse
from simdevice.live import live_current
from simdevice.scenarios import scenario

SIXTEEN = sixteen_positions()
PLACE = SIXTEEN[6]
BENCH = scenario("full-noise").bench(4)
SILENT = replace(
    BENCH,
    noise=replace(BENCH.noise, angle_random_walk=0.0),
    interference=type(BENCH.interference)(),
    ammeter=type(BENCH.ammeter)(),
    timetable=replace(BENCH.timetable, settle=0.02),
)


def test_at_the_times_of_the_timetable_it_is_the_record() -> None:
    record = position_record(SILENT, PLACE)
    for sample in (0, 3, 11999):
        t = sample / 200.0
        live = live_current(BENCH, PLACE, SILENT.begin(PLACE) + t, 0.02 + t, SIXTEEN[5])
        # Sums of a few currents below 1e-5 A.
        assert live == pytest.approx((record.jx[sample], record.jy[sample]), rel=0, abs=1e-20)


def test_a_move_shows_and_is_forgotten() -> None:
    old, new = (live_current(BENCH, place, 4000.0, np.inf, None) for place in SIXTEEN[5:7])
    at_once, later = (live_current(BENCH, PLACE, 4000.0, t, SIXTEEN[5]) for t in (0.0, 10.0))
    # The transient does not know the temperature's 1e-5 of the scale factors.
    assert at_once == pytest.approx(old, rel=0, abs=1e-4 * max(map(abs, old)))
    assert later == new != old


def test_a_gyro_that_was_just_powered_up_drifts() -> None:
    # 0.3 and −0.2 °/h decay: from power-up to an hour later K·J has gained them, but for what wanders.
    cold, warm = (np.array(live_current(BENCH, PLACE, t, 1e9, None)) for t in (0.0, 3600.0))
    gain = np.array([[10.0, 0.05], [-0.04, 9.9]]) @ (warm - cold) * 180 * 3600 / np.pi
    assert gain == pytest.approx([0.3, -0.2], abs=0.01)


def test_takes_and_faults_do_not_matter() -> None:
    faulty = replace(BENCH, faults=(parse("wrong-position@90/180!"),))
    assert live_current(faulty, PLACE, 4000.0, 9.0, None) == live_current(
        BENCH, Position(PLACE.theta, PLACE.psi, 3), 4000.0, 9.0, None
    )


def test_a_plain_bench_shows_its_steady_current() -> None:
    plain = scenario("gvk-6").bench(4)
    jx, jy = steady_currents(plain, [PLACE])
    assert live_current(plain, PLACE, 0.0, 0.0, SIXTEEN[5]) == (jx[0], jy[0])
