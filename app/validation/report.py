"""What a validation found: groups of cases, cases of checks; frozen, and as JSON.

Digits agreed are the log relative error, −log₁₀(|q − c|/|c|) for an obtained q and an expected c, and
−log₁₀|q| for c = 0 (B. D. McCullough, The American Statistician 52, 1998, 358-366).
"""

import json
from collections.abc import Callable, Iterable, Mapping
from dataclasses import asdict, dataclass, field
from datetime import datetime
from math import isfinite, log10
from typing import Any, Final

Progress = Callable[[float, str], None]
"""Takes a fraction of the whole and what is being done."""

MOST_DIGITS: Final = 15.0
"""Published values have fifteen digits at the most, and a double hardly more."""
JSON_FORMAT: Final = "driftbook-validation-1"


@dataclass(frozen=True, slots=True)
class Check:
    """One expected value beside the obtained one.

    Attributes
    ----------
    name
        Of the quantity: a symbol, or words.
    expected, obtained
        A number, or a word for what is no number; `expected` may hold a number's printed digits.
    passed
    unit
        Empty for pure numbers.
    detail
        Which of several values of the quantity: a method, an end of an interval.
    digits
        How many digits agree; None where that says nothing.
    required
        Digits that must agree; None when the range decides.
    low, high
        Range in which the obtained number must lie; None when the digits decide.
    """

    name: str
    expected: float | str
    obtained: float | str
    passed: bool
    unit: str = ""
    detail: str = ""
    digits: float | None = None
    required: float | None = None
    low: float | None = None
    high: float | None = None


@dataclass(frozen=True, slots=True)
class Case:
    """A problem with its source.

    Attributes
    ----------
    name
    source
        Title, table or page, and address of the publisher; for our own cases how the truth is made.
    function
        What of the product computes it.
    checks
    note
        What a reader must know: why so many digits are required, how a tolerance comes about.
    error
        Why it could not be computed; such a case has failed.
    """

    name: str
    source: str
    function: str
    checks: tuple[Check, ...] = ()
    note: str = ""
    error: str = ""

    @property
    def passed(self) -> bool:
        """Whether it was computed, and every check holds."""
        return not self.error and bool(self.checks) and all(check.passed for check in self.checks)

    @property
    def digits(self) -> float | None:
        """Fewest digits agreed among the checks that count them."""
        return min((item.digits for item in self.checks if item.required is not None and item.digits is not None),
                   default=None)  # fmt: skip

    @property
    def required(self) -> float | None:
        """Fewest digits required."""
        return min((item.required for item in self.checks if item.required is not None), default=None)


@dataclass(frozen=True, slots=True)
class Group:
    """Cases that belong together."""

    key: str
    title: str
    cases: tuple[Case, ...]

    @property
    def passed(self) -> bool:
        """Whether every case passed."""
        return bool(self.cases) and all(case.passed for case in self.cases)


@dataclass(frozen=True, slots=True)
class Report:
    """A validation of one build on one machine.

    Attributes
    ----------
    started_at
        With its time zone.
    duration_s
    mode
        ``quick`` or ``full``.
    seed
        Of everything random.
    input_hash
        SHA-256 of the data, the mode and the seed.
    environment
        Versions and platform by their names.
    groups
    """

    started_at: datetime
    duration_s: float
    mode: str
    seed: int
    input_hash: str
    environment: Mapping[str, str]
    groups: tuple[Group, ...] = field(default=())

    @property
    def cases(self) -> list[Case]:
        """Every case of every group."""
        return [case for group in self.groups for case in group.cases]

    @property
    def passed(self) -> bool:
        """Whether everything passed."""
        return bool(self.groups) and all(group.passed for group in self.groups)


def digits_agreed(obtained: float, expected: float) -> float:
    """Log relative error, at most `MOST_DIGITS`; 0 when not even the size is right or it is no number."""
    if not isfinite(obtained):
        return 0.0
    error = abs(obtained - expected) / abs(expected) if expected else abs(obtained)
    return MOST_DIGITS if error == 0 else min(MOST_DIGITS, max(0.0, -log10(error)))


def by_digits(
    name: str, expected: float, obtained: float, required: float, unit: str = "", detail: str = ""
) -> Check:
    """Check that so many digits agree."""
    digits = digits_agreed(float(obtained), expected)
    return Check(name, expected, float(obtained), digits >= required, unit, detail, digits, required)


def as_printed(
    name: str, printed: str, obtained: float, unit: str = "", last_place: float = 0.5, detail: str = ""
) -> Check:
    """Check against a value as it is printed: the obtained one must round to it.

    `last_place` is the tolerance in units of the last printed place; more than a half where the
    publication itself computed with rounded intermediate values.
    """
    mantissa, _, exponent = printed.lower().partition("e")
    unit_of_last = 10.0 ** (int(exponent or 0) - len(mantissa.partition(".")[2]))
    expected = float(printed)
    reach = last_place * unit_of_last * (1 + 1e-9)
    return in_range(name, printed, obtained, expected - reach, expected + reach, unit, detail)


def in_range(
    name: str,
    expected: float | str,
    obtained: float,
    low: float,
    high: float,
    unit: str = "",
    detail: str = "",
) -> Check:
    """Check that a number lies in a range; the digits agreed are told, but do not decide."""
    obtained = float(obtained)
    digits = digits_agreed(obtained, float(expected))
    return Check(name, expected, obtained, low <= obtained <= high, unit, detail, digits, None, low, high)


def holds(name: str, expected: str, obtained: str, detail: str = "") -> Check:
    """Check that words are the expected ones."""
    return Check(name, expected, obtained, obtained == expected, detail=detail)


def attempt(
    name: str, source: str, function: str, compute: Callable[[], Iterable[Check]], note: str = ""
) -> Case:
    """Make a case; whatever prevents its computation is told in it, so that the others are still computed."""
    try:
        checks = tuple(compute())
    except Exception as error:
        return Case(name, source, function, note=note, error=f"{type(error).__name__}: {error}")
    return Case(name, source, function, checks, note)


def report_json(report: Report) -> dict[str, Any]:
    """A report as programs get it, and as it is stored."""
    return {
        "format": JSON_FORMAT,
        "verdict": _verdict(report.passed),
        "started_at": report.started_at.isoformat(timespec="seconds"),
        "duration_s": round(report.duration_s, 3),
        "mode": report.mode,
        "seed": report.seed,
        "input_hash": report.input_hash,
        "environment": dict(report.environment),
        "cases": len(report.cases),
        "cases_failed": sum(not case.passed for case in report.cases),
        "groups": [
            {
                "key": group.key,
                "title": group.title,
                "verdict": _verdict(group.passed),
                "cases": [_case_json(case) for case in group.cases],
            }
            for group in report.groups
        ],
    }


def json_text(written: Mapping[str, Any]) -> str:
    """What `report_json` gave, as the one line that is printed, answered and kept."""
    return json.dumps(written, ensure_ascii=False, allow_nan=False)


def _case_json(case: Case) -> dict[str, Any]:
    return {
        "name": case.name,
        "verdict": _verdict(case.passed),
        "source": case.source,
        "function": case.function,
        "digits": _rounded(case.digits),
        "required_digits": case.required,
        "note": case.note,
        "error": case.error or None,
        "checks": [_check_json(check) for check in case.checks],
    }


def _check_json(check: Check) -> dict[str, Any]:
    written = asdict(check)
    written["verdict"] = _verdict(written.pop("passed"))
    written["digits"] = _rounded(check.digits)
    written["required_digits"] = written.pop("required")
    return {
        name: None if isinstance(value, float) and not isfinite(value) else value
        for name, value in written.items()
    }


def _rounded(digits: float | None) -> float | None:
    return None if digits is None else round(digits, 2)


def _verdict(passed: bool) -> str:
    return "pass" if passed else "fail"
