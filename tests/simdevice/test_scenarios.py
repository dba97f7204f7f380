from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import chi2

from simdevice.ammeter import Ammeter
from simdevice.bench import mean_currents, position_record, run_session, steady_currents
from simdevice.certificate import Position, sixteen_positions
from simdevice.noise import RateNoise
from simdevice.scenarios import GVK_6, SCENARIOS, TYPES, draw_gyro, scatter, scenario

DPH = np.pi / 180 / 3600


UNSTEADY = ("full-noise", "cold-start", "restless", "drifting-temperature")


@pytest.mark.parametrize("name", SCENARIOS)
def test_every_scenario_makes_a_session_of_known_truth(name: str) -> None:
    bench = scenario(name).bench(5)
    session = run_session(replace(bench, duration=0.1), sixteen_positions())
    if name in UNSTEADY:
        # Biases by less than 0.35 °/h, scale factors by the temperature's 2 K: see each alone below.
        assert session.truth != scenario(name).gyro
        assert session.truth.values == pytest.approx(scenario(name).gyro.values, rel=2.1e-4, abs=0.35 * DPH)
    else:
        assert session.truth == scenario(name).gyro
    assert all(np.isfinite(p.jx).all() and np.isfinite(p.jy).all() for p in session.positions)
    assert (bench.rate, bench.duration) == (200.0, 60.0)


def test_cold_start_drifts_and_an_hour_later_it_does_not() -> None:
    bench = replace(scenario("cold-start").bench(5), noise=RateNoise(), ammeter=Ammeter(), rate=10.0)
    assert bench.begin(Position(0.0, 0.0)) == 15.0
    first, again = (position_record(bench, Position(0.0, 0.0, repeat)) for repeat in (0, 3))
    # 0.3 °/h decays with 600 s: from 15 s on, and from an hour later on, when three rounds are over.
    steady = steady_currents(bench, sixteen_positions()[:1])[0]
    early, late = (-10.0 / DPH * (record.jx - steady) for record in (first, again))
    # The cross-coupling of 0.5 % carries some of y's −0.2 °/h over.
    assert early[0] == pytest.approx(0.3 * np.exp(-15 / 600), rel=0.01)
    assert np.abs(late).max() < 0.3 * np.exp(-3600 / 600) * 1.01


def test_a_warming_room_warms_the_gyro_by_two_kelvin_in_an_hour() -> None:
    bench = scenario("drifting-temperature").bench(5)
    record = position_record(bench, Position(0.0, 0.0))
    # At 18 °C at power-up, the first record begins an hour later and lasts a minute.
    assert record.temperature == pytest.approx(293.15 + 2.0 / 3600.0 * 30.0, rel=1e-12)


@pytest.mark.parametrize(("name", "hz", "amplitude"), [("mains", 50.0, 2e-8), ("ripple", 49.873, 5e-8)])
def test_disturbances_stand_out_at_their_frequency(name: str, hz: float, amplitude: float) -> None:
    record = position_record(replace(scenario(name).bench(5), noise=RateNoise()), sixteen_positions()[4])
    # A window of Hann makes the height independent of where in its bin the line is, but for 15 %.
    heights = np.abs(np.fft.rfft((record.jx - record.jx.mean()) * np.hanning(12000))) * 4 / 12000
    assert np.argmax(heights) / 60.0 == pytest.approx(hz, abs=1 / 60.0)
    # The ammeter's noise of 5 nA makes 0.1 nA in a bin.
    assert 0.84 * amplitude < heights.max() < 1.02 * amplitude


def test_jitter_takes_from_the_ripples_line_and_gives_to_the_noise() -> None:
    """A line of phase noise ω·σ keeps exp(−(ω·σ)²/2) of its height: 1570 rad/s · 0.2 ms makes 5 % less."""
    heights, floors = [], []
    for name in ("ripple", "jitter"):
        record = position_record(replace(scenario(name).bench(5), noise=RateNoise()), sixteen_positions()[4])
        t = np.arange(12000) / 200.0
        columns = np.column_stack([np.cos(1570.0 * t), np.sin(1570.0 * t), np.ones(12000)])
        fitted, (rest,), *_ = np.linalg.lstsq(columns, record.jx)
        heights.append(np.hypot(fitted[0], fitted[1]))
        floors.append(rest / 12000)
    # Noise of 5 nA and of the jitter, 11 nA rms, over 12000 samples: 0.15 nA of 50.
    assert heights[1] / heights[0] == pytest.approx(np.exp(-((1570.0 * 2e-4) ** 2) / 2), abs=0.015)
    lost = (5e-8) ** 2 / 2 * (1 - np.exp(-((1570.0 * 2e-4) ** 2)))
    # A variance of 12000 samples: its deviation is 1.3 %; five of them.
    assert floors[1] - floors[0] == pytest.approx(lost, rel=0.07)


def test_full_noise_has_every_part() -> None:
    bench = scenario("full-noise").bench(5)
    noise, interference = bench.noise, bench.interference
    assert min(noise.angle_random_walk, noise.bias_instability, noise.rate_random_walk, noise.turn_on) > 0
    assert not bench.warm_up.quiet
    assert bench.temperature is not None
    assert bench.temperature.sensitivity
    assert min(interference.mains, interference.ripple, interference.jitter) > 0
    assert bench.loop is not None
    channel = bench.ammeter.x
    assert (channel.gain, channel.offset) != (1.0, 0.0)
    assert min(channel.step, channel.noise) > 0
    assert bench.noise.angle_random_walk == scenario("gvk-6").noise.angle_random_walk


@pytest.mark.parametrize("name", TYPES)
def test_a_types_full_noise_has_its_white_noise(name: str) -> None:
    kind = TYPES[name]
    assert kind.full_noise.angle_random_walk == kind.noise.angle_random_walk
    assert kind.noise == RateNoise(kind.noise.angle_random_walk)


def test_the_nominal_gyro_has_the_papers_torquer_scale() -> None:
    # 10 rad/(s·A) is 2062.65 °/h/mA.
    assert scenario("gvk-6").gyro.kx / (DPH * 1000) == pytest.approx(2062.65, abs=0.005)


def test_a_scenario_draws_all_but_the_truth_from_its_seed() -> None:
    one, again, other = (scenario("gvk-6").bench(seed) for seed in (1, 1, 2))
    positions = sixteen_positions()
    assert mean_currents(one, positions).jx.tobytes() == mean_currents(again, positions).jx.tobytes()
    assert (one.stand.certificate.angles != other.stand.certificate.angles).all()
    assert one.gyro == other.gyro
    noise_of_one, noise_of_other = (
        mean_currents(bench, positions).jx - steady_currents(bench, positions)[0] for bench in (one, other)
    )
    # Equal noise on other steady currents would agree to rounding, 1e-21 A; it is of 1e-9 A.
    assert np.abs(noise_of_one - noise_of_other).min() > 1e-15


def test_a_scenario_covers_the_positions_asked_for() -> None:
    place = Position(0.5, 0.25)
    bench = scenario("gvk-6").bench(1, (place,))
    assert len(mean_currents(bench, [place]).jx) == 1


def test_quiet_is_without_any_error() -> None:
    bench = scenario("quiet").bench(4)
    means = mean_currents(bench, sixteen_positions())
    assert np.array_equal(means.jx, steady_currents(bench, sixteen_positions())[0])
    assert (
        bench.stand.misalignment(Position(0.0, 0.0)).tobytes() == bench.stand.certificate.angles[0].tobytes()
    )


def test_saturated_saturates_in_some_positions_only() -> None:
    session = run_session(replace(scenario("saturated").bench(4), duration=1.0), sixteen_positions())
    full = [bool((np.abs(p.jx) == np.abs(p.jx).max()).all()) for p in session.positions]
    assert any(full)
    assert not all(full)


def test_an_unknown_scenario_names_those_there_are() -> None:
    with pytest.raises(ValueError, match=r"no scenario gvk-7\. There are: gvk-6, dtg-4"):
        scenario("gvk-7")


@pytest.mark.parametrize("name", TYPES)
def test_individuals_scatter_by_the_types_spread(name: str) -> None:
    kind = TYPES[name]
    drawn = np.array([draw_gyro(kind, seed).values for seed in range(400)])
    spread = np.array([kind.spread[key] for key in ("kx", "ky", "kxy", "kyx", "w0x", "w0y", "wg", "wk")])
    squares = np.sum(((drawn - kind.nominal.values) / spread) ** 2, axis=0)
    # χ² with 400 degrees for each of eight parameters: 99.99 % each.
    low, high = chi2.ppf([5e-5, 1 - 5e-5], 400)
    assert ((low < squares) & (squares < high)).all()


def test_an_individual_is_its_seeds() -> None:
    assert draw_gyro(GVK_6, 3) == draw_gyro(GVK_6, 3)
    assert draw_gyro(GVK_6, 3) != draw_gyro(GVK_6, 4)


def test_naming_one_more_parameter_changes_no_other_draw() -> None:
    few = scatter(np.random.default_rng(1), {"wk": 1.0})
    more = scatter(np.random.default_rng(1), {"kx": 1.0, "wn": 1.0, "wk": 1.0})
    assert few["wk"] == more["wk"]


def test_scatter_of_an_unknown_parameter_is_refused() -> None:
    with pytest.raises(ValueError, match="no parameter kz"):
        scatter(np.random.default_rng(1), {"kz": 1.0})
