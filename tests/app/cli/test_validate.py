"""`driftbook validate`: table, JSON, reports, exit codes."""

import json

import numpy as np

from app.validation import nist
from app.validation.pack import suites


def only_nist(monkeypatch):
    chosen = {"nist-strd": suites(False, 0)["nist-strd"]}
    monkeypatch.setattr("app.validation.pack.suites", lambda full, seed: chosen)


def test_a_table_for_people(driftbook, monkeypatch):
    only_nist(monkeypatch)
    done = driftbook("validate")
    assert done.code == 0
    assert "NIST StRD" in done.out
    assert "Longley" in done.out
    assert "all 12 cases passed" in done.out


def test_json_for_programs(driftbook, monkeypatch):
    only_nist(monkeypatch)
    done = driftbook("validate", "--json")
    report = json.loads(done.out)
    assert report["verdict"] == "pass"
    assert report["groups"][0]["cases"][0]["checks"][0]["expected"] == -0.262323073774029
    assert set(report["environment"]) >= {
        "driftbook",
        "solver",
        "numpy",
        "scipy",
        "python",
        "blas",
        "platform",
    }
    assert report["input_hash"].startswith("sha256:")


def test_a_report_in_text_holds_every_check(driftbook, monkeypatch, tmp_path):
    only_nist(monkeypatch)
    done = driftbook("validate", "--report", tmp_path / "report.txt", "--report", tmp_path / "report.json")
    assert done.code == 0
    text = (tmp_path / "report.txt").read_text(encoding="utf-8")
    assert "s(B10)" in text
    assert "https://www.itl.nist.gov/div898/strd/" in text
    assert json.loads((tmp_path / "report.json").read_text(encoding="utf-8"))["verdict"] == "pass"


def test_a_report_as_a_page_of_its_own(driftbook, monkeypatch, tmp_path):
    only_nist(monkeypatch)
    assert driftbook("validate", "--report", tmp_path / "report.html").code == 0
    text = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert text.startswith("<!doctype html>")
    assert "All 12 cases passed." in text
    assert text.count("<details") == text.count(" open>") == 12
    assert "<link" not in text  # it stands alone: the stylesheet is inside, nothing is fetched
    assert "<script" not in text


def test_what_fails_is_shown_and_ends_with_1(driftbook, monkeypatch):
    only_nist(monkeypatch)
    monkeypatch.setattr(nist, "estimate", lambda design, y: (np.zeros(design.shape[1]), None))
    done = driftbook("validate")
    assert done.code == 1
    assert "11 of 12 cases failed" in done.out  # all but the centred one, which is not solved that way
    assert "B0, estimate" in done.out


def test_a_report_of_an_unknown_kind_is_refused_before_anything_runs(driftbook, tmp_path):
    done = driftbook("validate", "--report", tmp_path / "report.pdf")
    assert done.code == 2
    assert "A report ends with one of .html, .json, .txt; report.pdf does not." in done.err
    assert driftbook("validate", "--report", tmp_path / "no" / "r.json").code == 2
