from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import chi2

from simdevice.bench import mean_currents, run_session, steady_currents
from simdevice.certificate import Position, sixteen_positions
from simdevice.scenarios import GVK_6, SCENARIOS, TYPES, draw_gyro, scatter, scenario

DPH = np.pi / 180 / 3600


@pytest.mark.parametrize("name", SCENARIOS)
def test_every_scenario_makes_a_session_of_known_truth(name: str) -> None:
    bench = scenario(name).bench(5)
    session = run_session(replace(bench, duration=0.1), sixteen_positions())
    assert session.truth == scenario(name).gyro
    assert all(np.isfinite(p.jx).all() and np.isfinite(p.jy).all() for p in session.positions)
    assert (bench.rate, bench.duration) == (200.0, 60.0)


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
