"""The whole pack, with suites that take no time."""

import json
from pkgutil import resolve_name

from app.validation import coverage, pack
from app.validation.numbers import digest
from app.validation.report import Case, Group, holds, report_json


def test_suites_follow_one_another_and_progress_rises(monkeypatch):
    seen = []

    def suite(key):
        def compute(progress):
            for step in range(3):
                progress(step / 3, key)
            return Group(key, key, (Case(key, "", "", (holds("q", "1", "1"),)),))

        return compute

    monkeypatch.setattr(pack, "suites", lambda full, seed: {"a": (1.0, suite("a")), "b": (3.0, suite("b"))})
    report = pack.run(lambda fraction, what: seen.append((round(fraction, 3), what)), seed=5)
    assert seen == [(0.0, "a"), (0.083, "a"), (0.167, "a"), (0.25, "b"), (0.5, "b"), (0.75, "b")]
    assert report.passed
    assert report.mode == "quick"
    assert report.started_at.tzinfo is not None
    written = report_json(report)
    assert json.loads(json.dumps(written, allow_nan=False)) == written


def test_the_pack_holds_what_it_promises():
    quick = pack.suites(full=False, seed=1)
    assert list(quick) == ["nist-strd", "gum", "jcgm101", "nbs14", "worked", "coverage"]


def test_the_input_hash_depends_on_data_mode_and_seed():
    assert digest("quick", "1") == digest("quick", "1")
    assert len({digest("quick", "1"), digest("full", "1"), digest("quick", "2")}) == 3


def test_the_functions_that_reports_name_exist(monkeypatch):
    monkeypatch.setattr(coverage, "QUICK", 1)
    monkeypatch.setattr(coverage, "_RECORDS", 32)
    for _, suite in pack.suites(full=False, seed=1).values():
        for case in suite(lambda fraction, what: None).cases:
            before = ""
            for name in case.function.split(", "):
                before = resolved(name, before)


def resolved(name, before):
    """Full name of a function; a short one lies beside the one named before, or in a package above it."""
    above = before.split(".")[:-1]
    places = [name] + [".".join((*above[:depth], name)) for depth in range(len(above), 0, -1)]
    return next(place for place in places if exists(place))


def exists(place):
    try:
        return callable(resolve_name(place))
    except (ImportError, AttributeError):
        return False
