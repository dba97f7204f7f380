"""Faults: how they are written, where they strike, and what they do to a record."""

from dataclasses import replace

import numpy as np
import pytest

from simdevice.ammeter import Ammeter, Channel
from simdevice.bench import Bench, SimulatedPosition, position_record, run_session
from simdevice.certificate import Position, certify, draw_certificate, sixteen_positions
from simdevice.faults import OF_RECORD, OF_STAND, Fault, Kind, located, parse, wrong
from simdevice.gyro import Gyro
from simdevice.noise import RateNoise
from simdevice.stand import Stand

GYRO = Gyro(kx=10.0, ky=9.9, kxy=0.05, kyx=-0.04, w0x=7e-6, w0y=-4e-6, wg=3e-5, wk=1e-5)
CHANNEL = Channel(step=1e-9, limit=1e-3, noise=5e-9)
STAND = Stand(0.97, draw_certificate(1), seed=2)
BENCH = Bench(GYRO, STAND, Ammeter(CHANNEL, CHANNEL), RateNoise(8e-8), duration=2.0, seed=3)
SIXTEEN = sixteen_positions()
PLACE = SIXTEEN[6]  # θ 90°, ψ 180°
N = 400


def struck(
    text: str, seed: int = 3, position: Position = PLACE
) -> tuple[SimulatedPosition, SimulatedPosition]:
    """The record without and with a fault."""
    bench = replace(BENCH, seed=seed)
    return position_record(bench, position), position_record(replace(bench, faults=(parse(text),)), position)


@pytest.mark.parametrize(
    ("text", "fault"),
    [
        ("dropped", Fault(Kind.DROPPED)),
        ("spike!", Fault(Kind.SPIKE, every=True)),
        ("stuck-x@90/180", Fault(Kind.STUCK_X, np.pi / 2, np.pi)),
        ("saturation@0/22.5!", Fault(Kind.SATURATION, 0.0, np.pi / 8, every=True)),
        (" stall@-90/1e1 ", Fault(Kind.STALL, -np.pi / 2, np.pi / 18)),
    ],
)
def test_the_written_form(text: str, fault: Fault) -> None:
    assert parse(text) == fault
    assert parse(str(fault)) == fault


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "is no fault; write KIND@THETA/PSI"),
        ("@90/180", "is no fault"),
        ("spike@90", "is no fault"),
        ("spike@90/180!!", "is no fault"),
        ("spike@90/180/3", "is no fault"),
        (
            "spikes@90/180",
            "no fault spikes here. There are: dropped, stuck-x, stuck-y, spike, saturation, wrong-",
        ),
        ("spike@a/180", "in degrees, such as spike@90/180"),
        ("spike@nan/180", "finite"),
    ],
)
def test_what_cannot_be_read_is_refused_in_words(text: str, words: str) -> None:
    with pytest.raises(ValueError) as refused:
        parse(text)
    assert words in str(refused.value)


def test_kinds_can_be_limited() -> None:
    with pytest.raises(ValueError, match="no fault stall here") as refused:
        parse("stall", OF_RECORD)
    assert "emergency-stop" not in str(refused.value)
    assert parse("wrong-position", OF_RECORD) == parse("wrong-position", OF_STAND)
    assert set(OF_RECORD) | set(OF_STAND) == set(Kind)


def test_first_take_or_every_take() -> None:
    first, every = parse("spike@90/180"), parse("spike@90/180!")
    again = replace(PLACE, repeat=1)
    assert [fault.hits(take) for fault in (first, every) for take in (PLACE, again)] == [
        True,
        False,
        True,
        True,
    ]
    assert not first.hits(SIXTEEN[0])
    assert not parse("spike").hits(PLACE)
    # 450° is 90°: a place is an orientation.
    assert parse("spike@450/-180").hits(PLACE)


def test_places_are_drawn_from_the_seed_and_differ() -> None:
    faults = [parse(text) for text in ("dropped@0/0", "spike", "spike", "stuck-x")]
    found = located(faults, STAND.certificate, 5)
    places = [fault.position.place for fault in found if fault.position]
    assert len(set(places)) == 4
    assert places[0] == (0, 0)
    assert located(faults, STAND.certificate, 5) == found
    assert located(faults[:3], STAND.certificate, 5) == found[:3]
    # Any of the sixteen can be drawn: 200 draws miss one with a chance of 16·(15/16)^200 = 4e-5.
    drawn = {located(faults[1:2], STAND.certificate, seed)[0].position for seed in range(200)}
    assert len(drawn) == 16


def test_a_wrong_position_is_drawn_where_it_can_be() -> None:
    turned = certify([0.0, 0.0, 1.0], [0.0, np.pi / 2, 0.5])
    for seed in range(10):
        (fault,) = located([parse("wrong-position")], turned, seed)
        assert fault.position == Position(0.0, 0.0)
    with pytest.raises(ValueError, match="another one 90° further"):
        located([parse("wrong-position")], certify([0.0], [0.0]), 1)
    with pytest.raises(ValueError, match="no position θ = 0°, ψ = 180°"):
        located([parse("wrong-position@0/90")], turned, 1)


@pytest.mark.parametrize("kind", OF_RECORD)
@pytest.mark.parametrize("where", ["", "@90/180"])
def test_exactly_one_record_differs(kind: Kind, where: str) -> None:
    bench = replace(BENCH, faults=(parse(f"{kind}{where}"),))
    takes = sixteen_positions(repeats=2)
    good, bad = run_session(BENCH, takes), run_session(bench, takes)
    differ = [
        other
        for one, other in zip(good.positions, bad.positions, strict=True)
        if (one.t.tobytes(), one.jx.tobytes(), one.jy.tobytes())
        != (other.t.tobytes(), other.jx.tobytes(), other.jy.tobytes())
    ]
    assert [item.faults for item in differ] == [(kind,)]
    assert [item.faults for item in bad.positions].count(()) == 31
    assert differ[0].repeat == 0
    if where:
        assert (differ[0].theta, differ[0].psi) == (PLACE.theta, PLACE.psi)
    every = run_session(replace(bench, faults=(parse(f"{kind}{where}!"),)), takes)
    assert [item.repeat for item in every.positions if item.faults] == [0, 1]


@pytest.mark.parametrize("seed", range(5))
def test_dropped_samples_leave_one_gap(seed: int) -> None:
    good, bad = struck("dropped@90/180", seed)
    steps = np.diff(np.rint(bad.t * BENCH.rate))
    (gap,) = steps[steps != 1]
    assert 3 <= gap <= 1 + 0.05 * N
    assert len(bad.t) == N - (gap - 1)
    kept = np.isin(good.t, bad.t)
    assert bad.jx.tobytes() == good.jx[kept].tobytes()
    assert bad.jy.tobytes() == good.jy[kept].tobytes()


@pytest.mark.parametrize("channel", ["x", "y"])
def test_a_stuck_channel_repeats_from_some_sample_on(channel: str) -> None:
    good, bad = struck(f"stuck-{channel}@90/180")
    stuck, other = (f"j{name}" for name in (("x", "y") if channel == "x" else ("y", "x")))
    first = np.flatnonzero(getattr(bad, stuck) != getattr(good, stuck))[0] - 1
    assert 0.1 * N <= first + 1 <= 0.6 * N + 1
    assert (getattr(bad, stuck)[first:] == getattr(good, stuck)[first]).all()
    assert getattr(bad, other).tobytes() == getattr(good, other).tobytes()


@pytest.mark.parametrize("seed", range(5))
def test_a_spike_is_one_reading_far_off(seed: int) -> None:
    good, bad = struck("spike@90/180", seed)
    off = np.array([bad.jx - good.jx, bad.jy - good.jy])
    ((channel,), _) = np.nonzero(off)
    size = np.abs((good.jx, good.jy)[channel][: N // 4]).max()
    # The reading is a whole number of steps of 1 nA: half of one.
    assert 5 * size - 5e-10 <= np.abs(off).max() <= 20 * size + 5e-10
    assert np.abs(off).max() > 20 * np.std((good.jx, good.jy)[channel])


def test_a_spike_stays_within_the_ammeters_range() -> None:
    # Currents of up to 9 µA in a range of 9 µA.
    narrow = Channel(step=1e-9, limit=9e-6, noise=5e-9)
    bench = replace(BENCH, ammeter=Ammeter(narrow, narrow), faults=(parse("spike@90/180"),))
    record = position_record(bench, PLACE)
    assert max(np.abs(record.jx).max(), np.abs(record.jy).max()) == 9000 * 1e-9
    assert record.overload


@pytest.mark.parametrize("seed", range(5))
def test_saturation_is_a_stretch_at_the_limit(seed: int) -> None:
    good, bad = struck("saturation@90/180", seed)
    changed = np.array([bad.jx != good.jx, bad.jy != good.jy])
    (channel,) = np.flatnonzero(changed.any(axis=1))
    stretch = np.flatnonzero(changed[channel])
    assert (np.diff(stretch) == 1).all()
    assert 0.1 * N <= len(stretch) <= 0.3 * N
    readings, before = ((bad.jx, bad.jy)[channel], (good.jx, good.jy)[channel])
    # The limit is 1 mA, a million steps; on the side where the current is.
    assert (readings[stretch] == np.sign(before[0]) * 1_000_000 * 1e-9).all()
    assert bad.overload
    assert not good.overload


def test_a_wrong_position_stands_90_degrees_further() -> None:
    quiet = replace(BENCH, ammeter=Ammeter(), noise=RateNoise(), faults=(parse("wrong-position@90/180"),))
    there = Position(PLACE.theta, PLACE.psi + np.pi / 2)
    assert wrong(PLACE) == there
    bad = position_record(quiet, PLACE)
    assert (bad.theta, bad.psi, bad.repeat) == (PLACE.theta, PLACE.psi, 0)
    assert bad.jx[0] == position_record(quiet, there).jx[0]
    # The noise stays that of the position asked for.
    good, noisy = struck("wrong-position@90/180")
    shift = bad.jx[0] - position_record(quiet, replace(PLACE, repeat=1)).jx[0]
    # Both readings are rounded to 1 nA.
    assert noisy.jx - good.jx == pytest.approx(np.full(N, shift), rel=0, abs=1.001e-9)
    assert abs(shift) > 1e-7


@pytest.mark.parametrize("seed", range(5))
def test_an_interrupted_record_ends_early(seed: int) -> None:
    good, bad = struck("interrupted@90/180", seed)
    assert 0.2 * N - 1 <= len(bad.t) <= 0.8 * N
    for name in ("t", "jx", "jy"):
        assert getattr(bad, name).tobytes() == getattr(good, name)[: len(bad.t)].tobytes()


def test_faults_of_one_record_do_not_disturb_each_other() -> None:
    texts = [f"{kind}@90/180" for kind in ("stuck-x", "spike", "dropped", "interrupted")]
    bench = replace(BENCH, faults=tuple(map(parse, texts)))
    record = position_record(bench, PLACE)
    assert set(record.faults) == {Kind.STUCK_X, Kind.SPIKE, Kind.DROPPED, Kind.INTERRUPTED}
    gap, end = struck("dropped@90/180")[1].t, struck("interrupted@90/180")[1].t
    assert record.t.tolist() == [moment for moment in gap.tolist() if moment <= end[-1]]
    turned = position_record(replace(bench, faults=bench.faults[::-1]), PLACE)
    assert turned.jx.tobytes() == record.jx.tobytes()


def test_the_first_samples_do_not_depend_on_how_many_are_asked_for() -> None:
    for kind in OF_RECORD:
        bench = replace(BENCH, faults=(parse(f"{kind}@90/180"),))
        whole = position_record(bench, PLACE)
        for count in (1, 50, 150, 399):
            part = position_record(bench, PLACE, count)
            m = int(np.searchsorted(whole.t, count / BENCH.rate - 1e-9))
            assert part.t.tobytes() == whole.t[:m].tobytes()
            assert (part.jx.tobytes(), part.jy.tobytes()) == (whole.jx[:m].tobytes(), whole.jy[:m].tobytes())


def test_a_fault_elsewhere_changes_nothing_and_one_that_cannot_be_is_refused() -> None:
    good, bad = struck("spike@0/0")
    assert bad.jx.tobytes() == good.jx.tobytes()
    for texts, words in (
        (["spike@45/45"], "no position θ = 45°"),
        (["stall"], "befalls the stand"),
        (["emergency-stop@0/0"], "befalls the stand"),
    ):
        with pytest.raises(ValueError, match=words):
            replace(BENCH, faults=tuple(map(parse, texts)))
    with pytest.raises(ValueError, match="no limit"):
        replace(BENCH, ammeter=Ammeter(), faults=(parse("saturation"),))
    with pytest.raises(ValueError, match="too short for a fault"):
        replace(BENCH, duration=0.05, faults=(parse("spike"),))
    with pytest.raises(ValueError, match="both θ and ψ"):
        Fault(Kind.SPIKE, theta=1.0)
