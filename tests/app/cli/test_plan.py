"""`driftbook plan`: files in, uncertainties and positions out, clear words for what cannot be planned."""

import json

import pytest

CERTIFICATE = "theta_deg,psi_deg,alpha_arcsec,beta_arcsec,gamma_arcsec\n" + "".join(
    f"{theta},{psi},{theta / 100},{-psi / 50},3\n" for theta in (0, 90, 180, 270) for psi in (0, 90, 180, 270)
)


@pytest.fixture
def certificate(tmp_path):
    path = tmp_path / "certificate.csv"
    path.write_text(CERTIFICATE)
    return path


@pytest.fixture
def plan(driftbook, certificate):
    def run(*arguments):
        return driftbook("plan", "--certificate", certificate, "--latitude", 55.7558, *arguments)

    return run


def test_the_certificate_is_judged(plan):
    done = plan()
    assert done.code == 0, done.err
    assert "16 positions, 90 s at each" in done.out
    assert "rank 8" in done.out
    row = next(line for line in done.out.splitlines() if line.startswith("Kx"))
    assert "currents 100 %" in row


def test_json_for_programs_holds_everything_that_was_asked_for(plan):
    done = plan("--count", 8, "--criterion", "A", "--counts", "--trade", "--json")
    answer = json.loads(done.out)
    assert len(answer["plan"]["positions"]) == 8
    assert answer["plan"]["search"]["exhaustive"] is True
    assert [item["count"] for item in answer["counts"]] == list(range(4, 17))
    assert {point["kind"] for point in answer["trade"]["marked"]} == {"paper", "all", "plan"}
    # The criterion is the root mean square of eight rates, K at the current of the whole Earth rate.
    u = {item["name"]: item["u"] for item in answer["plan"]["parameters"]}
    earth = 15.041067  # °/h
    rates = [u[name] * earth / 2062.648 if name[0] == "k" else u[name] for name in u]
    assert answer["plan"]["search"]["figure"] == pytest.approx(
        (sum(r * r for r in rates) / 8) ** 0.5, rel=1e-5
    )  # Earth rate and K are written with seven digits
    assert "counts" not in json.loads(plan("--json").out)


def test_a_list_that_leaves_something_open_says_so_in_words(plan, tmp_path):
    level = tmp_path / "level.csv"
    level.write_text(CERTIFICATE.splitlines()[0] + "\n0,0,0,0,0\n0,90,0,0,0\n0,180,0,0,0\n0,270,0,0,0\n")
    done = plan("--certificate", level, "--positions", "0/0,0/90,0/180,0/270")
    assert done.code == 0
    assert "not determined" in done.out
    assert "wg +1 °/h/g" in done.err
    pole = plan("--latitude", 90, "--count", 8)
    assert "No choice of 8 positions" in pole.out
    assert "at a pole" in pole.err


def test_tables_of_what_is_compared(plan):
    done = plan("--counts", "--trade", "--count", 6, "--grid", 90)
    told = " ".join(done.out.split())
    assert (
        "best of 8008 sets, every one tried, those that bury the scale factors in noise last" in told
    )  # 16 over 6
    assert "How many positions are worth it" in done.out
    assert "the paper's eight" in done.out


def test_nominal_values_and_common_uncertainties_come_from_files(plan, tmp_path):
    nominal, common = tmp_path / "nominal.json", tmp_path / "common.json"
    nominal.write_text('{"parameters": {"kx": 1000, "ky": {"value": 1100}}}')
    common.write_text('{"u_gain_x_ppm": 5000}')
    answer = json.loads(plan("--nominal", nominal, "--uncertainties", common, "--json").out)
    found = {item["name"]: item for item in answer["plan"]["parameters"]}
    assert (found["kx"]["nominal"], found["ky"]["nominal"]) == (1000, 1100)
    assert found["kx"]["dominating"] == "ammeter-gain"
    assert found["kx"]["u"] == pytest.approx(0.005 * 1000, rel=0.05)  # 0.5 % of K beside the noise
    assert answer["nominal_source"] == "the file nominal.json"


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--count", 3], "--count"),
        (["--count", 20], "--count"),
        (["--count", 8, "--grid", 44], "--grid"),
        (["--count", 8, "--criterion", "E"], "--criterion"),
        (["--positions", "0/0,ninety"], "ninety"),
        (["--time", 600], "--time"),
        (["--moving", -1], "--moving"),
        (["--noise", 0], "--noise"),
        (["--floor", -1], "--floor"),
        (["--nominal", "missing.json"], "missing.json"),
        (["--certificate", "missing.csv"], "missing.csv"),
        (["--latitude", 95], "--latitude"),
    ],
)
def test_bad_usage_is_one_line_and_exit_code_2(plan, arguments, words):
    done = plan(*arguments)
    assert done.code == 2
    assert len(done.err.strip().splitlines()) == 1
    assert words in done.err
