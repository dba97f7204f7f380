"""`driftbook simulate` and `driftbook solve`: files in, parameters out, clear words for bad ones."""

import json
import shutil

import pytest

from tests.app.cli.worked_case import OFF_GRID, REVERSED, SIXTEEN, TRUTH, write_case


def solve(driftbook, folder, latitude_deg, *more):
    done = driftbook("solve", folder / "currents.csv", "--certificate", folder / "certificate.csv",
                     "--latitude", latitude_deg, "--json", *more)  # fmt: skip
    assert done.code == 0, done.err
    return json.loads(done.out)


@pytest.mark.parametrize(
    ("name", "places", "latitude_deg", "truth", "spread_arcsec"),
    [
        ("moscow", SIXTEEN, 55.7558, TRUTH, 15),
        ("southern", SIXTEEN, -33.9, TRUTH, 15),
        ("equator", SIXTEEN, 0.0, TRUTH, 15),
        ("reversed-torquer", SIXTEEN, 55.7558, REVERSED, 15),
        ("degrees-of-misalignment", SIXTEEN, 48.1, TRUTH, 7200),
        ("off-the-grid", OFF_GRID, 55.7558, TRUTH, 15),
        ("eight", SIXTEEN[:8], 48.1, TRUTH, 60),
    ],
)
def test_exact_currents_give_the_truth(driftbook, tmp_path, name, places, latitude_deg, truth, spread_arcsec):
    result = solve(driftbook, write_case(tmp_path / name, places, latitude_deg, truth, spread_arcsec), latitude_deg,
                   "--method", "both")  # fmt: skip
    answers = [result["least-squares"]]
    if "error" not in result["paper"]:
        answers.append(result["paper"])
    assert len(answers) == (1 if name == "off-the-grid" else 2), result["paper"].get("error")
    for answer in answers:
        for parameter, true in truth.items():
            scale = max(abs(true), 1e-3 * abs(truth["kx"]) if parameter[0] == "k" else 1e-3)
            # Both methods are deterministic: double precision leaves 1e-12 or so; 1e-9 is what is asked of them.
            assert abs(answer["parameters"][parameter]["value"] - true) <= 1e-9 * scale, (name, parameter)


def test_the_order_of_the_rows_does_not_matter_to_the_last_bit(driftbook, tmp_path):
    one, other = (
        solve(driftbook, write_case(tmp_path / str(shuffle), SIXTEEN, 55.7558, TRUTH, 15, shuffle), 55.7558,
              "--method", "both")
        for shuffle in (False, True)
    )  # fmt: skip
    assert one == other


@pytest.mark.parametrize("latitude_deg", [90.0, -90.0])
def test_at_a_pole_what_cannot_be_found_is_named(driftbook, tmp_path, latitude_deg):
    result = solve(driftbook, write_case(tmp_path, SIXTEEN, latitude_deg, TRUTH, 15), latitude_deg)
    unknown = [name for name, entry in result["parameters"].items() if entry["value"] is None]
    assert {"kx", "ky", "wg"} <= set(unknown)
    warning = next(item for item in result["warnings"] if item["code"] == "unobservable")
    assert "ωg" in warning["message"] or "wg" in warning["message"]
    assert result["fit"]["rank"] < 8


def test_a_simulated_session_is_solved_from_its_folder_alone(driftbook, tmp_path):
    assert driftbook("simulate", "--out", tmp_path / "s", "--seed", 7, "--scenario", "exact-stand").code == 0
    done = driftbook("solve", tmp_path / "s", "--json")
    assert done.code == 0, done.err
    result, truth = (
        json.loads(done.out),
        json.loads((tmp_path / "s" / "truth.json").read_text())["parameters"],
    )
    for name, entry in result["parameters"].items():
        true = truth[name]["value"] if isinstance(truth[name], dict) else truth[name]
        # Eight normal deviates beyond 4.5 u: p = 8 · 7e-6; u by batch means is itself uncertain by an eighth.
        assert abs(entry["value"] - true) < 4.5 * entry["standard_uncertainty"], name


@pytest.mark.parametrize("record_format", ["csv", "parquet"])
def test_equal_seeds_give_equal_results_whatever_the_format(driftbook, tmp_path, record_format):
    reference, other = tmp_path / "a", tmp_path / "b"
    driftbook("simulate", "--out", reference, "--seed", 3, "--duration", 2)
    driftbook("simulate", "--out", other, "--seed", 3, "--duration", 2, "--format", record_format)
    hashes = [
        json.loads(driftbook("solve", folder, "--json").out)["input_hash"] for folder in (reference, other)
    ]
    assert hashes[0] == hashes[1]


def test_several_items_give_a_line_each_and_a_bad_one_does_not_stop_the_others(driftbook, tmp_path):
    write_case(tmp_path / "many" / "a", SIXTEEN, 55.7558, TRUTH, 15) if (
        tmp_path / "many"
    ).mkdir() is None else None
    shutil.copytree(tmp_path / "many" / "a", tmp_path / "many" / "b")
    (tmp_path / "many" / "b" / "currents.csv").write_text("theta_deg,psi_deg,jx_ma\n0,0,1\n")
    shutil.copytree(tmp_path / "many" / "a", tmp_path / "many" / "c")
    done = driftbook("solve", tmp_path / "many", "--latitude", 55.7558, "--json")
    lines = [json.loads(line) for line in done.out.splitlines()]
    assert done.code == 2
    assert [line["file"].rsplit("/", 1)[1] for line in lines] == ["a", "b", "c"]
    assert ["error" in line for line in lines] == [False, True, False]
    assert "jy" in lines[1]["error"]["message"]


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["solve", "missing.csv", "--latitude", "50"], "missing.csv"),
        (["solve"], "Missing argument"),
        (["solve", "{case}/currents.csv", "--latitude", "50"], "--certificate"),
        (["solve", "{case}/currents.csv", "--certificate", "{case}/certificate.csv"], "--latitude"),
        (
            ["solve", "{case}/currents.csv", "--certificate", "{case}/none.csv", "--latitude", "50"],
            "none.csv",
        ),
        (["solve", "{case}/currents.csv", "--latitude", "95"], "--latitude"),
        (["simulate", "--out", "{case}"], "not an empty folder"),
        (["simulate", "--out", "{case}/x", "--scenario", "mars"], "no scenario mars"),
        (["simulate", "--out", "{case}/x", "--positions", "0/0,ninety"], "ninety"),
        (["nonsense"], "nonsense"),
        (["simulate", "--out", "{case}/currents.csv/x"], "{case}/currents.csv/x: Not a directory"),
        (["migrate", "--data", "{case}/currents.csv"], "{case}/currents.csv"),
        (["token", "create", "rig", "--data", "{case}/currents.csv"], "{case}/currents.csv"),
    ],
)
def test_bad_usage_is_one_line_and_exit_code_2(driftbook, tmp_path, arguments, words):
    case = write_case(tmp_path / "case", SIXTEEN, 50.0, TRUTH, 15)
    done = driftbook(*(str(item).format(case=case) for item in arguments))
    assert done.code == 2
    assert len(done.err.strip().splitlines()) == 1
    assert words.format(case=case) in done.err
    assert "Traceback" not in done.err


def test_the_table_for_people_has_values_with_u_and_says_what_u_covers(driftbook, tmp_path):
    driftbook("simulate", "--out", tmp_path / "s", "--seed", 7)
    done = driftbook("solve", tmp_path / "s", "--method", "both")
    assert done.code == 0
    assert "least-squares" in done.out
    assert "it comes mostly from noise of the mean currents" in " ".join(done.out.split())
    # of records: each u(J) was estimated with some 50 degrees of freedom
    assert "each is moderated by the other positions of its channel. u(Jx): stated" in " ".join(
        done.out.split()
    )


def test_the_command_line_wins_over_the_sessions_files_and_says_so(driftbook, tmp_path):
    driftbook("simulate", "--out", tmp_path / "s", "--seed", 7, "--duration", 2, "--latitude", 50)
    result = json.loads(driftbook("solve", tmp_path / "s", "--latitude", 51, "--json").out)
    assert "latitude-differs" in [item["code"] for item in result["input_warnings"]]


def test_the_help_lists_every_command_by_name(driftbook):
    words = driftbook("--help").out.split()
    for name in ("demo", "serve", "migrate", "solve", "simulate", "upload", "user", "token"):
        assert name in words
    alone = driftbook()
    assert (alone.code, alone.err) == (2, "")


@pytest.mark.parametrize(
    ("cut", "method", "words"),
    [(slice(1, None), "paper", "(0°, 0°)"), (slice(None), "least-squares", "row 18")],
)
def test_what_is_wrong_between_files_names_the_file(driftbook, tmp_path, cut, method, words):
    case = write_case(tmp_path / "case", SIXTEEN, 50.0, TRUTH, 15)
    header, *rows = (case / "currents.csv").read_text().splitlines()
    rows = rows[cut] + (["33,44,0.001,0.001"] if method != "paper" else [])
    (case / "currents.csv").write_text("\n".join([header, *rows]) + "\n")
    done = driftbook(
        "solve", case / "currents.csv", "--certificate", case / "certificate.csv",
        "--latitude", 50, "--method", method,
    )  # fmt: skip
    assert done.code == 2
    assert done.err.startswith(f"driftbook: {case / 'currents.csv'}")
    assert words in done.err
