"""A simulated session on disk says what its certificate's angles have in common."""

import csv
import json

import pytest


def test_the_common_part_stands_in_a_file_that_solve_takes(tmp_path, driftbook):
    folder = tmp_path / "session"
    short = ("--seed", 3, "--duration", 2, "--rate", 50)
    assert driftbook("simulate", "--out", folder, *short).code == 0
    stated = folder / "uncertainties.json"
    assert json.loads(stated.read_text()) == {
        f"u_{name}_common_arcsec": 0.3 for name in ("alpha", "beta", "gamma")
    }
    with (folder / "certificate.csv").open(newline="") as file:
        assert {row["u_alpha_arcsec"] for row in csv.DictReader(file)} == {"0.5"}
    lines = {}
    for name, further in (("without", ()), ("with", ("--uncertainties", stated))):
        outcome = driftbook("solve", folder, "--json", *further)
        assert outcome.code == 0, outcome.err
        lines[name] = {line["code"] for line in json.loads(outcome.out)["budget"]}
    assert lines["with"] - lines["without"] == {"angles-common"}


@pytest.mark.parametrize("scenario", ["exact-stand", "quiet"])
def test_nothing_is_written_where_nothing_is_uncertain(tmp_path, driftbook, scenario):
    arguments = ("--out", tmp_path / "session", "--scenario", scenario, "--duration", 1, "--rate", 10)
    assert driftbook("simulate", *arguments).code == 0
    assert not (tmp_path / "session" / "uncertainties.json").exists()


SHORT = ("--seed", 3, "--duration", 2, "--rate", 50, "--positions", "0/0,0/90,90/180,90/270")


def content(folder, name):
    return json.loads((folder / name).read_text())


def bytes_of(folder):
    return {path.name: path.read_bytes() for path in folder.iterdir()}


@pytest.fixture
def plain(tmp_path, driftbook):
    assert driftbook("simulate", "--out", tmp_path / "plain", *SHORT).code == 0
    return tmp_path / "plain"


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (("--angle-random-walk", 0.002), {"noise": {"angle_random_walk_deg_per_root_h": 0.002}}),
        (("--bias-instability", 0.01), {"noise": {"angle_random_walk_deg_per_root_h": 0.0003,
                                                  "bias_instability_deg_per_h": 0.01}}),
        (("--rate-random-walk", 0.3), {"noise": {"angle_random_walk_deg_per_root_h": 0.0003,
                                                 "rate_random_walk_deg_per_h_per_root_h": 0.3}}),
        (("--turn-on", 0.05), {"noise": {"angle_random_walk_deg_per_root_h": 0.0003, "turn_on_deg_per_h": 0.05}}),
        (("--warm-up", "0.3,-0.2/600", "--since-power-up", 60),
         {"warm_up": {"x_deg_per_h": 0.3, "x_time_constant_s": 600.0, "y_deg_per_h": -0.2,
                      "y_time_constant_s": 600.0},
          "timetable": {"first_s": 60.0, "move_s": 10.0, "settle_s": 5.0}}),
        (("--warm-up", "3/900"), {"warm_up": {"x_deg_per_h": 3.0, "x_time_constant_s": 900.0, "y_deg_per_h": 3.0,
                                              "y_time_constant_s": 900.0}}),
        (("--temperature", "21.5/1.5"), {"temperature": {"at_power_up_c": 21.5, "drift_k_per_h": 1.5, "swing_k": 0.0,
                                                         "period_s": 3600.0, "reference_c": 20.0}}),
        (("--mains", 2e-5), {"mains": {"amplitude_ma": 2e-5, "hz": 50.0}}),
        # 1570 rad/s is 249.873 Hz; five times 50 samples per second is 250 Hz.
        (("--ripple", 5e-5), {"ripple": {"amplitude_ma": 5e-5, "hz": 249.873260654, "seen_at_hz": 0.1267393456}}),
        (("--mains", 2e-5, "--jitter", 1e-3), {"jitter_s": 1e-3}),
    ],
    ids=lambda value: value[0].removeprefix("--") if isinstance(value, tuple) else "",
)  # fmt: skip
def test_what_is_asked_for_is_simulated_and_said(tmp_path, driftbook, plain, options, said):
    folder = tmp_path / "made"
    assert driftbook("simulate", "--out", folder, *SHORT, *options).code == 0
    truth = content(folder, "truth.json")["simulation"]
    assert truth == content(folder, "session.json")["simulation"]
    assert truth["scenario"] == "gvk-6"
    for name, value in said.items():
        # Printed with twelve digits after conversion to SI and back.
        assert truth[name] == pytest.approx(value, rel=1e-9), name
    assert {"mains", "ripple", "warm_up", "temperature"} & set(truth) == {
        "mains",
        "ripple",
        "warm_up",
        "temperature",
    } & (set(said) | ({"mains"} if "--mains" in options else set()))
    before, after = bytes_of(plain), bytes_of(folder)
    assert after["certificate.csv"] == before["certificate.csv"]
    assert all(after[name] != before[name] for name in before if name.startswith("theta"))


def test_parts_with_a_mean_change_the_truth(tmp_path, driftbook, plain):
    """Turn-on, warm-up and temperature move what can be found; zero of them says the truth of without."""
    true = content(plain, "truth.json")["parameters"]
    folders = {}
    for name, options in {
        "turn-on": ("--turn-on", 0.05),
        "warm-up": ("--warm-up", "0.3/1e9"),
        "temperature": ("--temperature", 30),
        "nothing": ("--turn-on", 0, "--warm-up", "0/600", "--temperature", 20),
    }.items():
        assert driftbook("simulate", "--out", tmp_path / name, *SHORT, *options).code == 0
        folders[name] = content(tmp_path / name, "truth.json")["parameters"]
    assert folders["nothing"] == true
    assert 0 < abs(folders["turn-on"]["w0x"]["value"] - true["w0x"]["value"]) < 5 * 0.05
    # A decay in 30 years stands still in an hour.
    assert folders["warm-up"]["w0x"]["value"] - true["w0x"]["value"] == pytest.approx(0.3, rel=1e-5)
    # The type GVK-6 loses 1e-3 rad/(s·A) per kelvin of its 10.
    assert folders["temperature"]["kx"]["value_si"] == pytest.approx(9.99, rel=1e-12)
    assert content(tmp_path / "temperature", "session.json")["temperature_c"] == 30.0
    assert "temperature_c" not in content(plain, "session.json")


def test_each_record_has_its_temperature(tmp_path, driftbook):
    folder = tmp_path / "made"
    assert (
        driftbook("simulate", "--out", folder, *SHORT, "--temperature", "20/36", "--since-power-up", 100).code
        == 0
    )
    # 36 K/h is 0.01 K/s; records of 2 s begin every 17 s.
    listed = [item["temperature_c"] for item in content(folder, "session.json")["positions"]]
    assert listed == pytest.approx([21.01, 21.18, 21.35, 21.52], abs=1e-9)


def test_equal_commands_give_equal_bytes(tmp_path, driftbook):
    options = ("--scenario", "full-noise", "--fault", "spike", "--fault", "interrupted@0/90", *SHORT)
    for name in ("a", "b"):
        assert driftbook("simulate", "--out", tmp_path / name, *options).code == 0
    assert bytes_of(tmp_path / "a") == bytes_of(tmp_path / "b")


def test_faults_strike_one_record_and_are_told(tmp_path, driftbook, plain):
    folder = tmp_path / "made"
    faults = ("--fault", "stuck-x@90/180", "--fault", "spike")
    assert driftbook("simulate", "--out", folder, *SHORT, *faults).code == 0
    before, after = bytes_of(plain), bytes_of(folder)
    changed = {name for name in before if after[name] != before[name] and name.startswith("theta")}
    told = content(folder, "truth.json")["simulation"]["faults"]
    assert told[0] == {"kind": "stuck-x", "theta_deg": 90.0, "psi_deg": 180.0, "every_take": False}
    assert changed == {f"theta{fault['theta_deg']:03.0f}_psi{fault['psi_deg']:03.0f}.csv" for fault in told}
    assert len(changed) == 2
    assert told[1]["kind"] == "spike"
    with (folder / "theta090_psi180.csv").open(newline="") as file:
        readings = [row["jx_ma"] for row in csv.DictReader(file)]
    assert len(set(readings[60:])) == 1 < len(set(readings[:10]))


def test_repeats_measure_every_position_again(tmp_path, driftbook, plain):
    folder = tmp_path / "made"
    assert driftbook("simulate", "--out", folder, *SHORT, "--repeats", 2, "--fault", "spike@0/0").code == 0
    listed = content(folder, "session.json")["positions"]
    assert [item["repeat"] for item in listed] == [0] * 4 + [1] * 4
    before, after = bytes_of(plain), bytes_of(folder)
    # The first round is what it was without a second one, but for the place of the fault.
    assert {name for name in before if name.startswith("theta") and before[name] != after[name]} == {
        "theta000_psi000.csv"
    }
    assert len([name for name in after if name.startswith("theta")]) == 8


def test_an_interrupted_csv_ends_in_the_middle_of_a_line(tmp_path, driftbook, plain):
    folder = tmp_path / "made"
    assert driftbook("simulate", "--out", folder, *SHORT, "--fault", "interrupted@0/90").code == 0
    whole, cut = ((path / "theta000_psi090.csv").read_bytes() for path in (plain, folder))
    assert whole.startswith(cut)
    assert 0 < len(cut) < 0.9 * len(whole)
    assert not cut.endswith(b"\n")
    assert cut.rsplit(b"\n", 1)[1].count(b",") < 2
    refused = driftbook("solve", folder)
    assert refused.code == 2
    assert "theta000_psi090.csv, row" in refused.err


def test_an_interrupted_parquet_file_cannot_be_read(tmp_path, driftbook):
    folder = tmp_path / "made"
    options = ("--format", "parquet", "--fault", "interrupted@0/90")
    assert driftbook("simulate", "--out", folder, *SHORT, *options).code == 0
    refused = driftbook("solve", folder)
    assert refused.code == 2
    assert "theta000_psi090.parquet" in refused.err


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (("--fault", "stall"), "--fault: There is no fault stall here. There are: dropped, stuck-x"),
        (("--fault", "spike@45/0"), "--fault: The certificate has no position θ = 45°, ψ = 0°."),
        (("--fault", "spike@here"), "--fault: “spike@here” is no fault; write KIND@THETA/PSI"),
        (("--fault", "wrong-position@0/90"), "--fault: The certificate has no position θ = 0°, ψ = 180°."),
        (("--fault", "saturation", "--scenario", "quiet"), "--fault: saturation: this ammeter has no limit"),
        (("--warm-up", "3"), "--warm-up: “3”: write °/h and seconds"),
        (("--warm-up", "1,2,3/600"), "--warm-up: “1,2,3/600”: write °/h and seconds"),
        (("--warm-up", "1/0"), "--warm-up: The warm-up's time constant must be"),
        (("--warm-up", "nan/60"), "--warm-up: The warm-up's amplitude must be"),
        (("--temperature", "warm"), "--temperature: “warm” is no number."),
        (("--temperature", "-300"), "--temperature: -300 °C is not above absolute zero."),
        (("--temperature", "20/1/1"), "--temperature: “20/1/1”: write °C at power-up"),
        (("--temperature", "20/inf"), "--temperature: Temperatures, their drift"),
        (("--angle-random-walk", 1, "--noise-deg-per-h", 1), "--angle-random-walk: This and --noise-deg-per-h both"),
        (("--bias-instability", -1), "--bias-instability"),
        (("--jitter", "nan"), "--jitter"),
        (("--repeats", 0), "--repeats"),
        (("--mains", "much"), "--mains"),
    ],
    ids=lambda value: "=".join(map(str, value[:2])) if isinstance(value, tuple) else "",
)  # fmt: skip
def test_what_cannot_be_is_refused_in_one_line(tmp_path, driftbook, options, words):
    refused = driftbook("simulate", "--out", tmp_path / "made", *SHORT, *options)
    assert refused.code == 2
    assert words in refused.err
    assert refused.err.count("\n") == 1
    assert not (tmp_path / "made").exists()


def test_full_noise_is_solved_to_its_truth(tmp_path, driftbook):
    """Eight normal deviates beyond 4.5 u: p = 6e-5. Slow noise, in no u, adds half a u at this size."""
    folder = tmp_path / "made"
    options = ("--scenario", "full-noise", "--format", "parquet", "--seed", 7)
    assert driftbook("simulate", "--out", folder, *options).code == 0
    done = driftbook("solve", folder, "--json")
    assert done.code == 0, done.err
    truth = content(folder, "truth.json")["parameters"]
    for name, entry in json.loads(done.out)["parameters"].items():
        assert abs(entry["value"] - truth[name]["value"]) < 5 * entry["standard_uncertainty"], name
    # Its turn-on offset is many u: the truth without it would be missed.
    assert (
        abs(truth["w0x"]["value"] - 1.5)
        > 5 * json.loads(done.out)["parameters"]["w0x"]["standard_uncertainty"]
    )
