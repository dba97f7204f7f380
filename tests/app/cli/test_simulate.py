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
