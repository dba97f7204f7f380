"""What a simulated session's files say of how it was made."""

from dataclasses import replace

import pytest

from app.services.simulated import records_lab
from app.services.simulated_facts import simulation_facts
from app.services.simulated_files import cut_short
from simdevice.bench import position_record
from simdevice.certificate import sixteen_positions
from simdevice.faults import parse
from simdevice.scenarios import scenario


def test_a_plain_scenario_says_its_white_noise_only() -> None:
    # 3e-4 °/√h is the GVK-6's.
    assert simulation_facts(scenario("gvk-6").bench(7), "gvk-6") == {
        "scenario": "gvk-6", "seed": 7, "duration_s": 60.0, "rate_hz": 200.0,
        "noise": {"angle_random_walk_deg_per_root_h": 0.0003},
    }  # fmt: skip
    assert set(simulation_facts(scenario("quiet").bench(7), "quiet")) == {
        "scenario",
        "seed",
        "duration_s",
        "rate_hz",
    }


def test_full_noise_says_every_part() -> None:
    facts = simulation_facts(scenario("full-noise").bench(7), "full-noise")
    assert set(facts) == {
        "scenario", "seed", "duration_s", "rate_hz", "noise", "warm_up", "temperature", "mains", "ripple", "jitter_s",
        "ammeter", "loop", "timetable",
    }  # fmt: skip
    assert facts["ammeter"] == {
        "gain_error_x_ppm": 10.0, "offset_x_ma": 1e-7, "gain_error_y_ppm": -10.0, "offset_y_ma": -1e-7,
    }  # fmt: skip
    assert (facts["loop"]["angular_momentum_nms"], facts["loop"]["t1_s"]) == (1.4e-3, 1.5e-2)
    assert facts["ripple"]["seen_at_hz"] == pytest.approx(1570 / 6.283185307179586 - 200, rel=1e-9)


def test_faults_are_told_with_the_places_that_were_drawn() -> None:
    bench = replace(scenario("gvk-6").bench(7), faults=(parse("spike"), parse("dropped@90/180!")))
    drawn, named = simulation_facts(bench, "gvk-6")["faults"]
    (hit,) = [p for p in sixteen_positions() if "spike" in bench.kinds_at(p)]
    assert (drawn["theta_deg"], drawn["psi_deg"]) == pytest.approx(
        (hit.theta * 57.29578, hit.psi * 57.29578), rel=1e-6
    )
    assert named == {"kind": "dropped", "theta_deg": 90.0, "psi_deg": 180.0, "every_take": True}


def test_a_record_carries_its_temperature() -> None:
    bench = replace(scenario("drifting-temperature").bench(7), duration=1.0, rate=10.0)
    (record,) = records_lab([position_record(bench, sixteen_positions()[0])])
    # 18 °C at power-up and 2 K an hour later, to the millikelvin.
    assert record.temperature_c == 20.0
    (record,) = records_lab([position_record(scenario("gvk-6").bench(7), sixteen_positions()[0])])
    assert record.temperature_c is None


@pytest.mark.parametrize("end", [b"\n", b"\r\n"])
def test_what_was_cut_short_lacks_half_a_line_or_half_its_bytes(end: bytes) -> None:
    lines = [b"t_s,jx_ma,jy_ma", b"0.0,0.001,0.002", b"0.005,0.0011,0.0021"]
    cut = cut_short(end.join(lines) + end, "csv")
    assert cut == end.join(lines[:2]) + end + b"0.005,0.0"
    assert cut_short(b"PAR1....PAR1", "parquet") == b"PAR1.."
