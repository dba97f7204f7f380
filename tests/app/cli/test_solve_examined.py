"""`driftbook solve`: budget, Monte Carlo, diagnosis against a prior, the further methods."""

import csv
import json

import numpy as np
import pytest

from tests.app.cli.worked_case import SIXTEEN, TRUTH, write_case

LATITUDE_DEG = 55.7558
NOISE_MA = 0.005 / TRUTH["kx"]
"""0.005 °/h of noise in a position's mean."""
PRIOR = {
    "kx": {"value": 2000.0, "standard_uncertainty": 100.0},
    "ky": {"value": 2000.0, "standard_uncertainty": 100.0},
    "wg": {"value": 0.0, "standard_uncertainty": 5.0},
    "wk": {"value": 0.0, "standard_uncertainty": 5.0},
}


@pytest.fixture
def case(tmp_path):
    """A noisy session with u(J), 60″ of certified misalignment known to 1″."""
    folder = write_case(tmp_path / "case", SIXTEEN, LATITUDE_DEG, TRUTH, 60.0)
    rng = np.random.default_rng(3)

    def noisy(row):
        for name in ("jx_ma", "jy_ma"):
            row[name] = repr(float(row[name]) + NOISE_MA * rng.standard_normal())
            row[f"u_{name}"] = repr(NOISE_MA)

    rewrite(folder / "currents.csv", noisy)
    rewrite(
        folder / "certificate.csv",
        lambda row: row.update(u_alpha_arcsec=1, u_beta_arcsec=1, u_gamma_arcsec=1),
    )
    (folder / "prior.json").write_text(json.dumps({"parameters": PRIOR}))
    return folder


def read(path):
    with path.open(newline="") as file:
        return list(csv.DictReader(file))


def rewrite(path, change):
    rows = read(path)
    for row in rows:
        change(row)
    with path.open("w", newline="") as file:
        writer = csv.DictWriter(file, list(rows[0]))
        writer.writeheader()
        writer.writerows(rows)


def solve(driftbook, folder, *more, latitude_deg=LATITUDE_DEG):
    done = driftbook("solve", folder / "currents.csv", "--certificate", folder / "certificate.csv",
                     "--latitude", latitude_deg, "--json", *more)  # fmt: skip
    assert done.code == 0, done.err
    return json.loads(done.out)


def swap_channels(row):
    row["jx_ma"], row["jy_ma"] = row["jy_ma"], row["jx_ma"]


def turn_sign(row):
    row["jy_ma"] = repr(-float(row["jy_ma"]))


def in_microampere(row):
    for name in ("jx_ma", "jy_ma", "u_jx_ma", "u_jy_ma"):
        row[name] = repr(1000 * float(row[name]))


def test_a_good_session_is_met_with_silence(driftbook, case):
    assert solve(driftbook, case)["diagnosis"] == []
    assert solve(driftbook, case, "--prior", case / "prior.json")["diagnosis"] == []


@pytest.mark.parametrize(
    ("blunder", "code", "details"),
    [
        (swap_channels, "channels-swapped", {}),
        (turn_sign, "channel-sign", {"channel": "y"}),
        (in_microampere, "current-unit", {}),
    ],
)
def test_what_the_fit_cannot_show_is_found_against_a_prior(driftbook, case, blunder, code, details):
    rewrite(case / "currents.csv", blunder)
    without = solve(driftbook, case)
    assert without["diagnosis"] == []
    told = " ".join(item["message"] for item in without["not_excluded"])
    assert code in told
    found = solve(driftbook, case, "--prior", case / "prior.json")["diagnosis"][0]
    assert found["code"] == code
    assert details.items() <= found.items()


def test_the_wrong_hemisphere_is_found_against_a_prior(driftbook, case):
    found = solve(driftbook, case, "--prior", case / "prior.json", latitude_deg=-LATITUDE_DEG)["diagnosis"]
    assert found[0]["code"] == "latitude-sign" or "latitude-sign" in [
        item["code"] for item in found[0]["equivalents"]
    ]


def test_exchanged_positions_are_named_in_degrees_with_their_chi_squares(driftbook, case):
    rows = read(case / "currents.csv")
    at = {(row["theta_deg"], row["psi_deg"]): row for row in rows}
    one, other = dict(at["90", "180"]), dict(at["90", "270"])

    def exchange(row):
        place = (row["theta_deg"], row["psi_deg"])
        source = {("90", "180"): other, ("90", "270"): one}.get(place)
        if source:
            row.update(jx_ma=source["jx_ma"], jy_ma=source["jy_ma"])

    rewrite(case / "currents.csv", exchange)
    result = solve(driftbook, case)
    found = result["diagnosis"][0]
    assert found["code"] == "positions-swapped"
    assert sorted(found["positions"]) == [[90.0, 180.0], [90.0, 270.0]]
    # 24 degrees of freedom: beyond 52 with probability 1e-3 (tables of χ²)
    assert found["chi2_after"] < 52 < 1000 < found["chi2_before"]
    assert f"{result['fit']['chi2']:.3g}" == f"{found['chi2_before']:.3g}"
    for angle in ("180°", "270°"):
        assert angle in found["message"]


def test_a_stated_gain_moves_the_scale_factors_by_as_much_and_nothing_else(driftbook, case):
    (case / "u.json").write_text(json.dumps({"u_gain_x_ppm": 1000.0}))
    result = solve(driftbook, case, "--uncertainties", case / "u.json")
    lines = {line["code"]: line for line in result["budget"]}
    gain = lines["ammeter-gain"]["standard_uncertainties"]
    # K·J is what is observed: a relative gain error of Jx changes Kx and Kyx by as much, the others not at all.
    assert gain["kx"] == pytest.approx(1e-3 * abs(result["parameters"]["kx"]["value"]), rel=1e-9)
    assert gain["kyx"] == pytest.approx(1e-3 * abs(result["parameters"]["kyx"]["value"]), rel=1e-9)
    assert max(gain[name] for name in ("ky", "kxy", "w0x", "w0y", "wg", "wk")) < 1e-9 * gain["kx"]
    assert result["parameters"]["kx"]["dominated_by"] == "ammeter-gain"
    assert result["stated"]["uncertainties"] == {"u_gain_x_ppm": 1000.0}
    for name, entry in result["parameters"].items():
        assert sum(line["shares"][name] for line in result["budget"]) == pytest.approx(1.0, abs=1e-12)
        parts = sum(line["standard_uncertainties"][name] ** 2 for line in result["budget"])
        assert entry["standard_uncertainty"] ** 2 == pytest.approx(parts, rel=1e-9)
        expanded = entry["coverage_factor"] * entry["standard_uncertainty"]
        assert entry["expanded_uncertainty"] == pytest.approx(expanded, rel=1e-15)  # one rounding


def test_draws_confirm_the_first_order_and_equal_seeds_give_equal_bytes(driftbook, case):
    first, again, other = (
        solve(driftbook, case, "--monte-carlo", 20_000, "--seed", seed) for seed in (7, 7, 8)
    )
    assert first == again
    assert first["monte_carlo"]["parameters"] != other["monte_carlo"]["parameters"]
    assert (first["monte_carlo"]["trials"], first["monte_carlo"]["seed"]) == (20_000, 7)
    for name, entry in first["monte_carlo"]["parameters"].items():
        u = first["parameters"][name]["standard_uncertainty"]
        # The standard deviation of 20,000 normal draws scatters by 1/√(2·20000) = 0.5 %: four of those.
        assert entry["standard_uncertainty"] == pytest.approx(u, rel=0.02)
        low, high = entry["symmetric"]
        assert low < first["parameters"][name]["value"] < high
        assert entry["shortest"][1] - entry["shortest"][0] <= high - low


def test_as_many_draws_as_needed(driftbook, case):
    found = solve(driftbook, case, "--monte-carlo", "adaptive")["monte_carlo"]
    # JCGM 101, 7.9.4: at least ten blocks of 10⁴; two digits of u take some hundred thousands
    assert found["trials"] >= 100_000
    assert found["verdict"] in ("agree", "disagree", "open")


@pytest.mark.parametrize("method", ["robust", "generalised"])
def test_further_methods_agree_with_least_squares_on_good_data(driftbook, case, method):
    plain, other = solve(driftbook, case), solve(driftbook, case, "--method", method)
    assert other["method"] == method
    for name, entry in other["parameters"].items():
        u = plain["parameters"][name]["standard_uncertainty"]
        assert abs(entry["value"] - plain["parameters"][name]["value"]) < 2 * u
        # Huber's estimate has 95 % efficiency at the normal: u larger by at most a few per cent.
        assert 0.9 * u < entry["standard_uncertainty"] < 1.2 * u


def test_the_robust_method_withstands_a_blunder(driftbook, case):
    def spoil(row):
        if (row["theta_deg"], row["psi_deg"]) == ("90", "0"):
            row["jx_ma"] = repr(float(row["jx_ma"]) + 100 * NOISE_MA)

    rewrite(case / "currents.csv", spoil)
    plain, robust = solve(driftbook, case), solve(driftbook, case, "--method", "robust")
    assert plain["diagnosis"][0]["code"] == "outlier"

    def worst(result):
        return max(
            abs(result["parameters"][name]["value"] - TRUTH[name])
            / robust["parameters"][name]["standard_uncertainty"]
            for name in TRUTH
        )

    assert worst(robust) < 5 < worst(plain)  # eight deviates beyond 5 u: p = 5e-6


@pytest.mark.parametrize(
    ("option", "text", "words"),
    [
        ("--uncertainties", '{"u_gain_x": 3}', "u_gain_x"),
        ("--uncertainties", '{"u_level_1_arcsec": -3}', "u_level_1_arcsec"),
        ("--prior", '{"parameters": {"kx": {"value": 2000}}}', "standard uncertainty"),
        ("--prior", "[]", "JSON object"),
    ],
)
def test_a_bad_file_is_one_line_and_exit_code_2(driftbook, case, option, text, words):
    (case / "bad.json").write_text(text)
    done = driftbook("solve", case / "currents.csv", "--certificate", case / "certificate.csv",
                     "--latitude", LATITUDE_DEG, option, case / "bad.json")  # fmt: skip
    assert done.code == 2
    assert len(done.err.strip().splitlines()) == 1
    assert "bad.json" in done.err
    assert words in done.err


@pytest.mark.parametrize("text", ["many", "1", "9999", "-1", "1e5"])
def test_no_number_of_draws_is_one_line(driftbook, case, text):
    """Fewer than 10,000 are refused, as in the laboratory: the ends of their intervals say nothing."""
    done = driftbook("solve", case / "currents.csv", "--certificate", case / "certificate.csv",
                     "--latitude", LATITUDE_DEG, "--monte-carlo", text)  # fmt: skip
    assert (done.code, len(done.err.strip().splitlines())) == (2, 1)
    assert f"“{text}”" in done.err
    assert "10000" in done.err


def test_the_table_tells_of_the_diagnosis_and_the_draws(driftbook, case):
    rewrite(case / "currents.csv", swap_channels)
    done = driftbook("solve", case / "currents.csv", "--certificate", case / "certificate.csv",
                     "--latitude", LATITUDE_DEG, "--prior", case / "prior.json", "--monte-carlo", 10_000)  # fmt: skip
    assert "diagnosis 1:" in done.out
    assert "Monte Carlo:" in done.out


def test_where_the_draws_refute_u_their_intervals_are_printed(driftbook, case):
    """A base known to 60 000″: large rotations shorten the components, which first order does not know."""
    stated = {"u_level_1_arcsec": 10_000, "u_azimuth_arcsec": 60_000}
    (case / "u.json").write_text(json.dumps(stated))
    asked = ("--uncertainties", case / "u.json", "--monte-carlo", 10_000)
    found = solve(driftbook, case, *asked)["monte_carlo"]
    assert found["verdict"] == "disagree"
    done = driftbook("solve", case / "currents.csv", "--certificate", case / "certificate.csv",
                     "--latitude", LATITUDE_DEG, *asked)  # fmt: skip
    (line,) = [line for line in done.out.splitlines() if line.strip().startswith("kx: 95 % within")]
    low, high = line.split("within ")[1].removesuffix(" °/h/mA").split(" … ")
    tolerance = found["parameters"]["kx"]["tolerance"]
    assert [float(low), float(high)] == pytest.approx(
        found["parameters"]["kx"]["symmetric"], abs=2 * tolerance
    )
