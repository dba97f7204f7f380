"""Good simulated records pass, each fault of a record is named, and everything else a check objects to."""

from collections import Counter
from dataclasses import replace

import numpy as np
import pytest

from app.station.instruments.description import SIMULATED, station_file
from app.station.judgement.checks import Take, judged
from app.station.judgement.expectations import Expectations, Thresholds
from simdevice.ammeter import Ammeter, Channel
from simdevice.bench import Bench, position_record
from simdevice.certificate import Position, sixteen_positions
from simdevice.faults import Fault, Kind
from simdevice.scenarios import scenario

FILE = station_file(SIMULATED)
PLACES = sixteen_positions()
TYPE_OF = {"dtg-4": "DTG-4"}  # the others are GVK-6
NA_PER_MA = 1e6


def take_of(bench: Bench, position: Position) -> Take:
    record = position_record(bench, position)
    return Take(record.t, record.jx * 1e3, record.jy * 1e3)


def codes_of(take: Take, name: str = "gvk-6", **changes) -> list[str]:
    expected = FILE.types[TYPE_OF.get(name, "GVK-6")]
    found = judged(take, replace(FILE.checks, **changes), expected, largest_ma=FILE.ammeter.largest_ma)
    return [finding.code for finding in found]


def noise(seed: int = 1, n: int = 12000, scale_na: float = 123.0, mean_ma: float = 0.004) -> Take:
    """A record like a GVK-6's without a simulator: white noise rounded to 1 nA."""
    rng = np.random.default_rng(seed)
    jx, jy = np.rint(mean_ma * NA_PER_MA + scale_na * rng.standard_normal((2, n))) / NA_PER_MA
    return Take(np.arange(n) / 200.0, jx, jy)


@pytest.mark.parametrize(
    "name", ["gvk-6", "dtg-4", "poor-ammeter", "full-noise", "mains", "ripple", "jitter"]
)
def test_good_records_pass(name):
    """Of 32 records each check may object to one in a million: one alarm among all here has a chance below 1e-3."""
    for seed in (1, 2):
        bench = scenario(name).bench(seed)
        for place in PLACES:
            assert codes_of(take_of(bench, place), name) == []


def test_good_records_of_a_coarse_ammeter_pass():
    """Steps from a third of the noise to twice it."""
    for step in (4e-8, 1.2e-7, 2.5e-7):
        channel = Channel(step=step, limit=1e-3, noise=5e-9)
        bench = replace(scenario("gvk-6").bench(3), ammeter=Ammeter(channel, channel))
        for place in PLACES:
            assert codes_of(take_of(bench, place)) == []


FAULTS = {
    Kind.DROPPED: "gap",
    Kind.INTERRUPTED: "too-short",
    Kind.STUCK_X: "stuck",
    Kind.STUCK_Y: "stuck",
    Kind.SPIKE: "spike",
    Kind.SATURATION: "saturation",
}


@pytest.mark.parametrize("kind", FAULTS)
def test_each_fault_of_a_record_is_named_and_nothing_else_is(kind):
    """300 of 300 found: the probability of finding one is above 99 % with 95 % confidence (0.99^300 = 0.049).

    Sizes are the simulator's: 1–5 % of the samples dropped, 20–80 % there, stuck for 40–90 %, a leap of 5–20 times
    the largest reading, 10–30 % at the limit. Short records, to be many: what matters is the share.
    """
    found = Counter()
    for seed in range(75):
        for place in PLACES[seed % 4 :: 4]:
            fault = Fault(kind, place.theta, place.psi)
            bench = replace(scenario("gvk-6").bench(seed), duration=10.0, faults=(fault,))
            found[tuple(codes_of(take_of(bench, place), shortest_s=10.0))] += 1
    assert found == {(FAULTS[kind],): 300}


def changed(take: Take, **columns) -> Take:
    return replace(take, **columns)


def test_one_missing_sample_is_a_gap_and_is_counted():
    good = noise()
    keep = np.arange(12000) != 700
    (finding,) = judged(
        changed(good, t_s=good.t_s[keep], jx_ma=good.jx_ma[keep], jy_ma=good.jy_ma[keep]), Thresholds()
    )
    assert finding.code == "gap"
    assert finding.message.values == {"count": 1, "missing": 1}
    assert (finding.level, finding.again) == ("error", True)


@pytest.mark.parametrize("how", ["stands still", "goes back", "leaps"])
def test_time_that_is_irregular_is_a_gap(how):
    t_s = np.arange(12000) / 200.0
    if how == "stands still":
        t_s[500] = t_s[499]
    elif how == "goes back":
        t_s[500:] -= 1.0
    else:
        t_s[500] += 0.004
    assert codes_of(changed(noise(), t_s=t_s)) == ["gap"] if how != "goes back" else ["gap", "too-short"]


def test_time_that_does_not_go_on_at_all_is_a_gap_and_no_more_is_judged():
    assert codes_of(changed(noise(), t_s=np.zeros(12000))) == ["gap"]


def test_a_clock_that_jitters_is_no_gap_but_a_missing_sample_beside_it_is():
    """Jitter of 5 % of the step: steps scatter by 7 %, 12,000 of them by up to 30 %."""
    good = noise()
    t_s = good.t_s + 0.05 * 0.005 * np.random.default_rng(5).standard_normal(12000)
    assert codes_of(changed(good, t_s=t_s)) == []
    keep = np.arange(12000) != 6000
    assert codes_of(Take(t_s[keep], good.jx_ma[keep], good.jy_ma[keep])) == ["gap"]


@pytest.mark.parametrize(
    ("samples", "codes"), [(12000, []), (11989, []), (11987, ["too-short"]), (1, ["too-short"])]
)
def test_sixty_seconds_with_a_tolerance_of_a_thousandth(samples, codes):
    """0.1 % of 12,000 samples are twelve."""
    assert codes_of(noise(n=samples)) == codes


@pytest.mark.parametrize(("rate", "codes"), [(200.0, []), (199.81, []), (199.79, ["too-slow"]), (400.0, [])])
def test_two_hundred_per_second_with_a_tolerance_of_a_thousandth(rate, codes):
    n = int(61 * rate)
    good = noise(n=n, scale_na=123.0 * (rate / 200.0) ** 0.5)
    assert codes_of(changed(good, t_s=np.arange(n) / rate)) == codes


def test_another_rate_cannot_be_mended_by_measuring_again():
    good = noise(n=6100)
    (finding,) = judged(changed(good, t_s=np.arange(6100) / 100.0), Thresholds())
    assert (finding.code, finding.again) == ("too-slow", False)


def test_a_reading_at_the_end_of_the_range_is_saturation():
    good = noise()
    jx = good.jx_ma.copy()
    jx[77] = -1.0
    found = judged(changed(good, jx_ma=jx), Thresholds(), largest_ma=1.0)
    assert [finding.code for finding in found] == ["saturation"]
    assert found[0].message.values == {"channel": "Jx", "count": 1, "value": -1.0}


def test_noise_cut_below_the_stated_range_is_saturation():
    """The ammeter's limit is 2 µA, lower than its description says: what is cut at it shows all the same.

    A channel that never leaves the limit repeats one value; which of the two it is only the ammeter can tell.
    """
    bench = scenario("saturated").bench(1)
    for place in PLACES:
        take = take_of(bench, place)
        cut = [np.mean(np.abs(values) == np.abs(values).max()) for values in (take.jx_ma, take.jy_ma)]
        codes = codes_of(take)
        if any(0.005 < share < 1.0 for share in cut):
            assert "saturation" in codes
        if 1.0 in cut:
            assert "stuck" in codes


def test_the_ammeters_own_flag_is_saturation_once():
    assert codes_of(changed(noise(), overload=True)) == ["saturation"]
    jx = np.full(12000, 1.0)
    assert codes_of(changed(noise(), jx_ma=jx, overload=True)) == ["saturation"]


def test_an_overload_is_told_as_such_and_as_nothing_else():
    """The ammeter knows that its range is too small, however its samples look: stuck, leaping, noisy."""
    bench = scenario("saturated").bench(1)
    alike = Counter()
    for place in PLACES:
        take = take_of(bench, place)
        cut = max(np.mean(np.abs(values) == np.abs(values).max()) for values in (take.jx_ma, take.jy_ma))
        if cut > 0.005:
            alike[codes_of(take) == ["saturation"]] += 1
            assert set(codes_of(changed(take, overload=True))) == {"saturation"}
    assert alike[False] > 0  # without the flag some look like something else
    stuck = changed(noise(), jx_ma=np.full(12000, 0.002), overload=True)
    (finding,) = judged(stuck, Thresholds(), largest_ma=1.0)
    assert finding.message.text.startswith("The ammeter reports an overload.")


def test_a_channel_with_one_value_is_stuck_and_not_judged_further():
    assert codes_of(changed(noise(), jy_ma=np.full(12000, 0.004))) == ["stuck"]


def test_a_leap_too_small_to_move_the_mean_is_let_through():
    """8 σ is found: it moves the mean of 12,000 samples by 0.07 of its uncertainty. 5 σ is not."""
    for size, codes in ((8.0, ["spike"]), (5.0, [])):
        good = noise()
        jx = good.jx_ma.copy()
        jx[4000] = np.median(jx) + size * 123.0 / NA_PER_MA
        assert codes_of(changed(good, jx_ma=jx)) == codes


def test_a_spike_is_told_with_its_size_and_time():
    good = noise()
    jy = good.jy_ma.copy()
    jy[2000] += 0.02
    (finding,) = judged(changed(good, jy_ma=jy), Thresholds())
    assert finding.message.values["channel"] == "Jy"
    assert finding.message.values["when"] == 10.0
    # Its own noise and that of the median: five times 123 nA.
    assert finding.message.values["size"] == pytest.approx(20000.0, abs=615.0)


@pytest.mark.parametrize(
    ("scale", "codes"),
    [(1.0, []), (1.9, []), (2.1, ["noise"] * 2), (0.52, []), (0.48, ["noise"] * 2), (0.04, ["noise"] * 2)],
)
def test_noise_is_compared_with_the_types_both_ways(scale, codes):
    """Half and twice, known to 0.65 % from 12,000 samples; an ammeter with nothing connected shows 4 %."""
    assert codes_of(noise(scale_na=123.0 * scale)) == codes


def test_noise_of_an_unknown_type_is_not_judged():
    assert judged(noise(scale_na=2000.0), Thresholds(), Expectations()) == ()


def test_a_current_larger_than_any_of_the_type_is_asked_about():
    found = judged(noise(mean_ma=0.06), FILE.checks, FILE.types["GVK-6"], largest_ma=1.0)
    assert [(finding.code, finding.level, finding.again) for finding in found] == [
        ("too-large", "warning", False)
    ] * 2


def test_a_drift_within_the_record_is_found_when_it_matters():
    """A straight change of 60 nA is known to 4 nA (√12·123/√12000), and the limit with Student's t to about 29 nA."""
    ramp = np.linspace(-0.5, 0.5, 12000) / NA_PER_MA
    missed = alarms = 0
    for seed in range(30):
        good = noise(seed)
        alarms += codes_of(changed(good, jx_ma=good.jx_ma + 10.0 * ramp)) != []
        missed += codes_of(changed(good, jx_ma=good.jx_ma + 60.0 * ramp)) != ["drifting"]
    assert (missed, alarms) == (0, 0)


def test_drift_and_spike_are_both_named():
    good = noise()
    jx = good.jx_ma + np.linspace(-5e-5, 5e-5, 12000)
    jx[300] += 0.02
    assert codes_of(changed(good, jx_ma=jx)) == ["spike", "drifting"]


def test_every_sentence_has_its_values():
    bad = [
        Take(np.arange(2) / 200.0, np.zeros(2), np.zeros(2)),
        changed(noise(), overload=True),
        noise(scale_na=500.0, mean_ma=0.07),
        noise(scale_na=10.0),
    ]
    for take in bad:
        for finding in judged(take, FILE.checks, FILE.types["GVK-6"], largest_ma=1.0):
            assert "%(" not in finding.message.text
            assert finding.message.text.endswith(".")
