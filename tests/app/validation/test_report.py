"""Digits agreed, printed values, verdicts and the JSON of a report."""

from datetime import UTC, datetime

import pytest

from app.validation.report import (
    MOST_DIGITS,
    Case,
    Check,
    Group,
    Report,
    as_printed,
    attempt,
    by_digits,
    digits_agreed,
    holds,
    report_json,
)


@pytest.mark.parametrize(
    ("obtained", "expected", "digits"),
    [
        (1.001, 1.0, 3.0),
        (-2.0 * (1 - 1e-9), -2.0, 9.0),
        (1.0, 1.0, MOST_DIGITS),
        (1e-7, 0.0, 7.0),  # of zero: the decimal places
        (-1.0, 1.0, 0.0),
        (float("nan"), 1.0, 0.0),
        (float("inf"), 1.0, 0.0),
    ],
)
def test_digits_agreed(obtained, expected, digits):
    assert digits_agreed(obtained, expected) == pytest.approx(digits, abs=1e-3)


@pytest.mark.parametrize(
    ("printed", "obtained", "passed"),
    [
        ("127.732", 127.73249, True),
        ("127.732", 127.7326, False),
        ("0.0032", 0.003151, True),
        ("0.0032", 0.003149, False),
        ("-0.588", -0.5884, True),
        ("-0.588", -0.5886, False),
        ("1.2e-3", 1.24e-3, True),
        ("1.2e-3", 1.26e-3, False),
        ("74", 74.4, True),
        ("74", 74.6, False),
    ],
)
def test_a_number_must_round_to_what_is_printed(printed, obtained, passed):
    assert as_printed("q", printed, obtained).passed is passed


def test_a_case_passes_when_every_check_does():
    good, bad = by_digits("a", 1.0, 1.0, 10), by_digits("b", 1.0, 1.1, 10)
    assert Case("one", "", "", (good,)).passed
    assert not Case("two", "", "", (good, bad)).passed
    assert not Case("nothing was checked", "", "").passed
    assert not Group("g", "", ()).passed
    assert Case("two", "", "", (good, bad)).digits == pytest.approx(1.0, abs=0.01)


def test_a_case_that_breaks_is_told_and_fails():
    def breaking():
        yield holds("first", "yes", "yes")
        raise ValueError("no such table")

    case = attempt("broken", "somewhere", "solver", breaking)
    assert not case.passed
    assert case.error == "ValueError: no such table"


def test_the_json_holds_verdicts_and_no_number_that_json_has_not():
    case = Case("c", "s", "f", (Check("q", 1.0, float("nan"), False),))
    report = Report(
        datetime(2026, 5, 1, 12, tzinfo=UTC), 1.5, "quick", 7, "sha256:0", {"numpy": "2"},
        (Group("g", "G", (case,)),),
    )  # fmt: skip
    written = report_json(report)
    assert written["verdict"] == "fail"
    assert written["started_at"] == "2026-05-01T12:00:00+00:00"
    assert written["groups"][0]["cases"][0]["checks"][0]["obtained"] is None
    assert (written["cases"], written["cases_failed"]) == (1, 1)
