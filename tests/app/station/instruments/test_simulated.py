"""The drivers and `simulated.toml` on the simulated instruments, over real sockets."""

import threading
from dataclasses import replace

import numpy as np
import pytest
from wired import wired

from app.errors import Invalid
from app.station.contracts import EmergencyStop, InstrumentFault, Place
from app.station.instruments.opening import open_ammeter, open_stand
from app.station.instruments.stand import apart_deg
from simdevice.axes import TOLERANCE
from simdevice.bench import position_record
from simdevice.certificate import Position
from solver.units import deg_from_rad

HALF_COUNT_DEG = 0.5e-4  # the encoders are told to 1e-4 deg


@pytest.fixture(scope="module")
def plain():
    with wired() as found:
        found.stand.home()
        found.at_rest()
        yield found


def test_both_say_who_they_are(plain):
    assert plain.stand.identify() == "Driftbook,SIM-STAND,3,1.0"
    assert plain.ammeter.identify() == "Driftbook,SIM-AMMETER,3,1.0"


def test_the_other_one_is_refused_at_once():
    with wired() as found:
        wrong = replace(found.file.stand, connection=found.file.ammeter.connection)
        stand = open_stand(wrong)
        with pytest.raises(InstrumentFault, match="says that it is “Driftbook,SIM-AMMETER"):
            stand.status()
        stand.close()


def test_the_stand_goes_where_it_is_sent(plain):
    for place in (Place(90.0, 180.0), Place(270.0, 0.0), Place(0.0, 90.0)):
        plain.stand.move(place)
        plain.at_rest()
        status = plain.stand.status()
        assert status.homed
        assert not status.emergency_stop
        assert apart_deg(status.place, place) <= deg_from_rad(TOLERANCE) + HALF_COUNT_DEG


def test_a_place_that_the_stand_has_not_is_refused_in_its_own_words(plain):
    with pytest.raises(
        InstrumentFault, match=r"\[stand\] reports after AXIS:POSition 45\.0000,0\.0000: -2\d\d "
    ):
        plain.stand.move(Place(45.0, 0.0))
    plain.stand.status()  # read once, the error is gone


def test_a_place_beyond_the_travel_is_not_even_sent(plain):
    before = plain.laboratory.axes.encoders()
    with pytest.raises(Invalid, match=r"cannot go to ψ = 1000°: it travels from -360° to 360°"):
        plain.stand.move(Place(0.0, 1000.0))
    assert plain.laboratory.axes.encoders() == before
    assert not plain.stand.status().moving


def test_a_stand_without_reference_refuses_to_move():
    with wired() as found:
        assert not found.stand.status().homed
        with pytest.raises(InstrumentFault, match="reference"):
            found.stand.move(Place(90.0, 0.0))


def test_nothing_moves_while_the_emergency_stop_is_pressed():
    with wired() as found:
        found.stand.home()
        found.at_rest()
        found.laboratory.axes.press()
        before = found.laboratory.axes.encoders()
        assert found.stand.status().emergency_stop
        with pytest.raises(EmergencyStop, match="emergency stop is pressed"):
            found.stand.move(Place(90.0, 0.0))
        with pytest.raises(EmergencyStop):
            found.stand.home()
        assert found.laboratory.axes.encoders() == before
        with pytest.raises(InstrumentFault):
            found.stand.release()  # still pressed
        found.laboratory.axes.release()
        found.stand.release()
        assert not found.stand.status().emergency_stop


def test_stopping_stops():
    with wired(speed=20.0) as found:
        found.stand.home()
        found.at_rest()
        found.stand.move(Place(180.0, 180.0))
        found.stand.stop()
        assert not found.stand.status().moving
        assert apart_deg(found.stand.status().place, Place(180.0, 180.0)) > 1.0


def test_samples_are_the_records_own_to_the_bit_whatever_the_blocks(plain):
    plain.stand.move(Place(90.0, 180.0))
    plain.at_rest()
    plain.ammeter.start(label=77, take=1, samples=12000, rate_hz=200.0)
    assert plain.acquired() == 12000
    status = plain.ammeter.status()
    assert (status.label, status.running, status.overload) == (77, False, False)
    blocks = [plain.ammeter.fetch(first, 5000) for first in (0, 5000, 10000)]
    record = position_record(plain.laboratory.bench, Position(np.pi / 2, np.pi, 1))
    for name, true, factor in (("t_s", record.t, 1.0), ("jx_ma", record.jx, 1e3), ("jy_ma", record.jy, 1e3)):
        fetched = np.concatenate([getattr(block, name) for block in blocks])
        assert np.array_equal(fetched, true * factor)  # amperes times 1000: one rounding, on both sides
    assert np.array_equal(plain.ammeter.fetch(11000, 500).jx_ma, record.jx[11000:11500] * 1e3)
    assert len(plain.ammeter.fetch(12000, 10).t_s) == 0


def test_a_reading_is_near_the_mean_of_the_record(plain):
    plain.stand.move(Place(0.0, 0.0))
    plain.at_rest()
    record = position_record(plain.laboratory.bench, Position(0.0, 0.0, 0))
    reading = plain.ammeter.reading()
    # Means of 0.1 s of a gyro with 123 nA in 5 ms scatter by 28 nA; six of these.
    assert reading.jx_ma == pytest.approx(record.jx.mean() * 1e3, abs=1.7e-4)
    assert reading.jy_ma == pytest.approx(record.jy.mean() * 1e3, abs=1.7e-4)


def test_a_refused_question_is_told_in_the_instruments_words_not_as_silence():
    with wired() as found:
        short = replace(found.file.ammeter, connection=replace(found.file.ammeter.connection, timeout_s=0.3))
        ammeter = open_ammeter(short)
        with pytest.raises(InstrumentFault, match=r"-230 .*nothing was acquired"):
            ammeter.fetch(0, 10)
        assert ammeter.status().label == 0
        ammeter.close()


def test_threads_may_look_at_once():
    """Four threads, each with its own questions to both instruments: no answer goes astray."""
    with wired() as found:
        found.stand.home()
        found.at_rest()
        found.stand.move(Place(90.0, 180.0))
        found.at_rest()
        wrong: list[object] = []

        def look() -> None:
            try:
                for _ in range(20):
                    status = found.stand.status()
                    if apart_deg(status.place, Place(90.0, 180.0)) > 0.02 or status.moving:
                        wrong.append(status)
                    if found.ammeter.status().running:
                        wrong.append("running")
                    if not 0.0 < abs(found.ammeter.reading().jx_ma) < 0.05:
                        wrong.append("reading")
            except Exception as error:  # a thread's exception would go unseen
                wrong.append(error)

        threads = [threading.Thread(target=look) for _ in range(4)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        assert not wrong
