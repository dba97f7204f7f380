"""The parts of a session's currents on the bench: each alone, all together, in any order."""

import multiprocessing
import random
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from functools import partial

import allantools
import numpy as np
import pytest
from scipy.stats import chi2

from simdevice import closed_loop, slow
from simdevice.ammeter import Ammeter, Channel
from simdevice.bench import Bench, SimulatedPosition, position_record, run_session, steady_currents
from simdevice.certificate import Position, draw_certificate, sixteen_positions
from simdevice.dynamics import GVK_6
from simdevice.faults import parse
from simdevice.gyro import Gyro
from simdevice.interference import Interference
from simdevice.scenarios import scenario
from simdevice.stand import Stand
from simdevice.thermal import ROOM, Decay, Temperature, WarmUp
from simdevice.timetable import Timetable

GYRO = Gyro(kx=10.0, ky=9.9, kxy=2.0, kyx=-1.5, w0x=7e-6, w0y=-4e-6, wg=3e-5, wk=1e-5)
K = np.array([[10.0, 2.0], [-1.5, 9.9]])
STAND = Stand(0.97, draw_certificate(1), seed=2)
SIXTEEN = sixteen_positions()
PLACE = SIXTEEN[6]
QUIET = Bench(GYRO, STAND, duration=2.0, seed=3)
WARM_UP = WarmUp(Decay(1e-6, 300.0), Decay(-2e-6, 500.0))
TEMPERATURE = Temperature(at_power_up=ROOM - 1.0, drift=1e-3, sensitivity={"kx": -1e-3, "w0y": 1e-7})
PARTS = {
    "white": {"noise": {"angle_random_walk": 8e-8}},
    "flicker": {"noise": {"bias_instability": 3e-9}},
    "walk": {"noise": {"rate_random_walk": 2e-11}},
    "turn-on": {"noise": {"turn_on": 1e-7}},
    "warm-up": {"warm_up": WARM_UP},
    "temperature": {"temperature": TEMPERATURE},
    "mains": {"interference": {"mains": 2e-8}},
    "ripple": {"interference": {"ripple": 5e-8}},
}


def bench_of(*names: str, **further: object) -> Bench:
    """The quiet bench with some of the parts."""
    bench = replace(QUIET, **further)
    for name in names:
        for field, value in PARTS[name].items():
            made = replace(getattr(bench, field), **value) if isinstance(value, dict) else value
            bench = replace(bench, **{field: made})
    return bench


def currents(bench: Bench, position: Position = PLACE) -> np.ndarray:
    record = position_record(bench, position)
    return np.array([record.jx, record.jy])


def bits(record: SimulatedPosition) -> tuple[bytes, ...]:
    return record.t.tobytes(), record.jx.tobytes(), record.jy.tobytes()


@pytest.mark.parametrize("name", PARTS)
@pytest.mark.parametrize("loop", [None, GVK_6], ids=["no-loop", "loop"])
def test_a_part_added_changes_no_other(name: str, loop: object) -> None:
    others = [other for other in PARTS if other != name]
    alone = currents(bench_of(name, loop=loop)) - currents(bench_of(loop=loop))
    added = currents(bench_of(*PARTS, loop=loop)) - currents(bench_of(*others, loop=loop))
    # Sums of nine currents below 1e-5 A in another order: a few roundings of 1e-21.
    np.testing.assert_allclose(added, alone, rtol=0, atol=2e-20)
    assert np.abs(alone).max() > 1e-10


def test_quiet_parts_draw_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    drawn: list[object] = []
    for module in ("interference", "noise", "slow", "currents"):
        monkeypatch.setattr(f"simdevice.{module}.stream", lambda *key: drawn.append(key))
    record = position_record(QUIET, PLACE)
    assert drawn == []
    assert (record.jx == steady_currents(QUIET, [PLACE])[0]).all()
    assert record.temperature is None


def test_records_of_white_noise_have_the_numbers_they_always_had() -> None:
    """Stream (1, axis) is white rate noise, (2, channel) the ammeter's: written out with numpy alone."""
    channel = Channel(step=1e-9, limit=1e-3, noise=5e-9)
    record = position_record(bench_of("white", ammeter=Ammeter(channel, channel)), PLACE)

    def normal(part: int, number: int) -> np.ndarray:
        # θ 90° and ψ 180° in milliarcseconds, repeat 0.
        key = np.random.SeedSequence(3, spawn_key=(part, number, 324_000_000, 648_000_000, 0))
        return np.random.Generator(np.random.PCG64(key)).standard_normal(400)

    rates = 8e-8 * np.sqrt(200.0) * np.array([normal(1, 0), normal(1, 1)])
    determinant = 10.0 * 9.9 + 2.0 * 1.5
    noise = np.array([9.9 * rates[0] - 2.0 * rates[1], 10.0 * rates[1] + 1.5 * rates[0]]) / determinant
    steady = np.array(steady_currents(QUIET, [PLACE]))
    codes = np.rint((steady + noise + 5e-9 * np.array([normal(2, 0), normal(2, 1)])) / 1e-9)
    assert np.rint(np.array([record.jx, record.jy]) / 1e-9).tolist() == codes.tolist()


@pytest.mark.parametrize("loop", [None, GVK_6], ids=["no-loop", "loop"])
def test_angle_random_walk_falls_with_the_root_of_time(loop: object) -> None:
    """Allan deviation N/√τ of the rates of a long record, at τ from 1 to 256 s, within the bounds of χ².

    The loop remembers for 0.06 s, which takes up to 0.3 % of the square at 1 s.
    """
    rate, duration = 50.0, 4096.0
    bench = bench_of("white", rate=rate, duration=duration, loop=loop, timetable=Timetable(0.0, 0.0, 9.0))
    rates = K @ (currents(bench) - np.array(steady_currents(bench, [PLACE])))
    averaged = np.array([50, 200, 800, 3200, 12800])
    dof = np.array([
        allantools.edf_greenhall(0, 2, m, round(rate * duration) + 1, overlapping=True) for m in averaged.tolist()
    ])  # fmt: skip
    for values in rates:
        _, deviations, _, _ = allantools.oadev(values, rate=rate, data_type="freq", taus=averaged / rate)
        squares = deviations**2 / ((8e-8) ** 2 / (averaged / rate))
        assert (chi2.ppf(2e-4, dof) / dof * 0.99 < squares).all()
        assert (squares < chi2.ppf(1 - 2e-4, dof) / dof * 1.01).all()


def test_the_loop_colours_white_noise() -> None:
    """Neighbouring samples are correlated as the loop's answer says, and the first sample is like the last."""
    bench = bench_of("white", loop=GVK_6, duration=600.0)
    rates = K @ (currents(bench) - np.array(steady_currents(bench, [PLACE])))
    pulse = closed_loop.answer(GVK_6, 200.0)
    variance = (8e-8) ** 2 * 200.0
    n = rates.shape[1]
    for lag in (0, 1, 2, 5):
        expected = variance * np.sum(pulse[lag:] * pulse[: len(pulse) - lag].conj()).real
        for values in rates:
            found = np.mean(values[lag:] * values[: n - lag])
            # A sample covariance of n samples, of which one in three is independent: four deviations.
            assert found == pytest.approx(expected, abs=4 * variance * np.sqrt(2 * 3 / n))
    # Over many records the very first sample has that variance too: the noise before it counts.
    firsts = np.array([
        K @ (currents(bench_of("white", loop=GVK_6, duration=0.005), Position(PLACE.theta, PLACE.psi, repeat))
             - np.array(steady_currents(bench, [PLACE])))
        for repeat in range(300)
    ])  # fmt: skip
    squares = np.sum(firsts**2) / (variance * np.sum(np.abs(pulse) ** 2))
    low, high = chi2.ppf([1e-4, 1 - 1e-4], 600)
    assert low < squares < high


@pytest.mark.parametrize("name", ["flicker", "walk"])
def test_wander_goes_through_the_torquers_at_the_slots_time(name: str) -> None:
    bench = bench_of(name)
    for position in (SIXTEEN[0], replace(PLACE, repeat=2)):
        # 16 places a round, 2 s of record and 15 s for the stand, an hour of warming up.
        slot = 16 * position.repeat + SIXTEEN.index(replace(position, repeat=0))
        t = 3600.0 + 17.0 * slot + np.arange(400) / 200.0
        rates = K @ (currents(bench, position) - np.array(steady_currents(QUIET, [position])))
        # Rates of 1e-9 rad/s out of currents of 1e-5 A: their roundings of 1e-21 A times 10.
        np.testing.assert_allclose(rates, slow.wander(bench.noise, 3, 0, t), rtol=0, atol=1e-19)


def test_warm_up_is_drift_that_decays() -> None:
    drifts = -K @ (currents(bench_of("warm-up")) - np.array(steady_currents(QUIET, [PLACE])))
    t = 3600.0 + 17.0 * 6 + np.arange(400) / 200.0
    expected = np.array([1e-6 * np.exp(-t / 300.0), -2e-6 * np.exp(-t / 500.0)])
    np.testing.assert_allclose(drifts, expected, rtol=0, atol=1e-19)  # as above


def test_temperature_is_that_of_the_slot_and_told() -> None:
    bench = bench_of("temperature")
    record = position_record(bench, PLACE)
    begin = 3600.0 + 17.0 * 6
    assert record.begin == begin
    assert record.temperature == pytest.approx(ROOM - 1.0 + 1e-3 * (begin + 1.0), rel=1e-14)
    for sample in (0, 399):
        warmer = -1.0 + 1e-3 * (begin + sample / 200.0)
        gyro = GYRO.shifted({"kx": -1e-3 * warmer, "w0y": 1e-7 * warmer})
        expected = np.array(steady_currents(replace(QUIET, gyro=gyro), [PLACE]))[:, 0]
        assert currents(bench)[:, sample] == pytest.approx(expected, rel=0, abs=1e-19)


def test_turn_on_offsets_belong_to_the_start() -> None:
    benches = [bench_of("turn-on", start=start) for start in range(400)]
    offsets = np.array(
        [[b.gyro_in_this_start.w0x - GYRO.w0x, b.gyro_in_this_start.w0y - GYRO.w0y] for b in benches]
    )
    low, high = chi2.ppf([1e-4, 1 - 1e-4], 400)
    assert (
        (low < np.sum((offsets / 1e-7) ** 2, axis=0)) & (np.sum((offsets / 1e-7) ** 2, axis=0) < high)
    ).all()
    # In one start every record has the same.
    for position in SIXTEEN[:3]:
        found = -K @ (currents(benches[7], position) - np.array(steady_currents(QUIET, [position])))
        np.testing.assert_allclose(found, np.repeat(offsets[7][:, None], 400, axis=1), rtol=0, atol=1e-19)


def test_jitter_shifts_a_sloped_signal_by_slope_times_delay() -> None:
    slope = Temperature(at_power_up=ROOM, drift=1.0, sensitivity={"w0x": 1e-7})
    plain = replace(QUIET, temperature=slope, gyro=replace(GYRO, kxy=0.0, kyx=0.0), duration=20.0)
    jittered = replace(plain, interference=Interference(jitter=1e-3))
    delay = (currents(jittered) - currents(plain))[0] / (-1e-7 / 10.0)
    # Differences of 1e-11 A out of 1e-4 A: roundings of 1e-20 A over a slope of 1e-8 A/s are 1e-12 s.
    low, high = chi2.ppf([1e-4, 1 - 1e-4], 4000)
    assert low < np.sum((delay / 1e-3) ** 2) < high
    assert position_record(jittered, PLACE).t.tobytes() == position_record(plain, PLACE).t.tobytes()
    # One clock for both channels: a slope in y is shifted by the same delays.
    both = replace(slope, sensitivity={"w0x": 1e-7, "w0y": -1e-7})
    x, y = currents(replace(jittered, temperature=both)) - currents(replace(plain, temperature=both))
    np.testing.assert_allclose(x * 10.0, -y * 9.9, rtol=0, atol=1e-18)


def test_a_transient_is_left_after_a_short_settling_only() -> None:
    hasty, patient = (bench_of(loop=GVK_6, timetable=Timetable(settle=settle)) for settle in (0.0, 5.0))
    old, new = (np.array(steady_currents(QUIET, [position]))[:, 0] for position in SIXTEEN[5:7])
    record = currents(hasty)
    # At rest again the loop's measured rates, and so the currents, are still those of the place before.
    assert record[:, 0] == pytest.approx(old, rel=0, abs=1e-9 * np.abs(new - old).max())
    assert record[:, -1] == pytest.approx(new, rel=0, abs=1e-12)
    assert currents(patient).tobytes() == currents(QUIET).tobytes()
    # Nothing is known of a place before the first.
    assert currents(hasty, SIXTEEN[0]).tobytes() == currents(QUIET, SIXTEEN[0]).tobytes()
    # The first place again follows the last of the round before.
    again = currents(hasty, replace(SIXTEEN[0], repeat=1))[:, 0]
    last = np.array(steady_currents(QUIET, SIXTEEN[15:]))[:, 0]
    assert again == pytest.approx(last, rel=0, abs=1e-9 * np.abs(last).max())


EVERYTHING = replace(
    scenario("full-noise").bench(4), duration=2.0, timetable=Timetable(first=30.0, settle=0.01),
    faults=tuple(map(parse, ("spike", "dropped@90/180", "stuck-x!", "wrong-position", "interrupted"))),
)  # fmt: skip


def test_bytes_do_not_depend_on_workers_order_or_company() -> None:
    takes = list(sixteen_positions(repeats=2))
    slow._axis.cache_clear()
    reference = {(p.theta, p.psi, p.repeat): bits(p) for p in run_session(EVERYTHING, takes).positions}
    for workers in (1, 2, 4):
        random.Random(workers).shuffle(takes)
        slow._axis.cache_clear()
        session = run_session(EVERYTHING, takes[: 32 // workers], workers=workers)
        for record in session.positions:
            assert bits(record) == reference[record.theta, record.psi, record.repeat]


def test_bytes_do_not_depend_on_the_process() -> None:
    with ProcessPoolExecutor(2, mp_context=multiprocessing.get_context("spawn")) as pool:
        there = list(pool.map(partial(position_record, EVERYTHING), SIXTEEN[:4]))
    assert [bits(record) for record in there] == [bits(position_record(EVERYTHING, p)) for p in SIXTEEN[:4]]


@pytest.mark.parametrize("count", [1, 2, 170, 399, 700])
def test_the_first_samples_are_those_of_a_shorter_record(count: int) -> None:
    bench = replace(EVERYTHING, faults=())
    whole, part = position_record(bench, PLACE, 700), position_record(bench, PLACE, count)
    assert bits(part) == (whole.t[:count].tobytes(), whole.jx[:count].tobytes(), whole.jy[:count].tobytes())
    assert bits(position_record(bench, PLACE)) == bits(position_record(bench, PLACE, 400))


def test_impossible_benches_are_refused() -> None:
    with pytest.raises(ValueError, match="starts count from 0"):
        replace(QUIET, start=-1)
    with pytest.raises(ValueError, match="unstable"):
        replace(QUIET, loop=replace(GVK_6, integral_time=1.5e-3))
    with pytest.raises(ValueError, match="at least one sample"):
        position_record(QUIET, PLACE, 0)
