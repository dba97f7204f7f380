"""The NBS14 suites: Allan deviations of nine and of a thousand numbers, to the printed digits."""

from collections.abc import Iterator, Mapping
from typing import Any, Final

import numpy as np

from app.i18n import marked
from app.validation.numbers import load
from app.validation.report import Check, Group, Progress, as_printed, attempt
from solver.records import Array
from solver.signals.allan import allan_deviation

_TITLE: Final = marked("NBS14: Allan deviation")


def group(progress: Progress) -> Group:
    """Compute both suites."""
    data = load("allan")
    progress(0.0, _TITLE)
    function = "solver.signals.allan.allan_deviation"
    cases = (
        attempt(
            marked("Nine values of frequency"),
            marked("NIST SP 1065, sec. 12.4, p. 107, from NBS Monograph 140, annex 8.E; https://www.nist.gov"),
            function, lambda: _suite(data["nine"], np.array(data["nine"]["samples"], dtype=np.float64)),
        ),
        attempt(
            marked("A thousand values of a congruential generator"),
            marked("NIST SP 1065, sec. 12.4, pp. 107-108: n ← 16807·n mod (2³¹ − 1); https://www.nist.gov"),
            function, lambda: _suite(data["thousand"], generated(data["thousand"])),
        ),
    )  # fmt: skip
    return Group("nbs14", _TITLE, cases)


def generated(data: Mapping[str, Any]) -> Array:
    """The thousand values: a prime modulus multiplicative generator, over its modulus."""
    numbers = [int(data["first"])]
    while len(numbers) < data["count"]:
        numbers.append(data["multiplier"] * numbers[-1] % data["modulus"])
    return np.array(numbers, dtype=np.float64) / float(data["modulus"])


def _suite(data: Mapping[str, Any], samples: Array) -> Iterator[Check]:
    for kind, detail in (("plain", ""), ("overlapping", marked("overlapping"))):
        found = allan_deviation(samples, data["factors"], overlapping=kind == "overlapping")
        for factor, printed, value in zip(data["factors"], data[kind], found, strict=True):
            yield as_printed(f"σ(τ = {factor})", printed, value, detail=detail)
