"""The NBS14 suites: the generator gives the published numbers, and the pack sees errors."""

import numpy as np

from app.validation import nbs14
from app.validation.numbers import load
from solver.signals import allan


def test_the_generator_begins_as_published():
    """NIST SP 1065, sec. 12.4: the second to fourth numbers are 395529916, 1209410747, 633705974."""
    numbers = nbs14.generated(load("allan")["thousand"]) * 2147483647
    assert np.rint(numbers[:4]).astype(int).tolist() == [1234567890, 395529916, 1209410747, 633705974]
    assert len(numbers) == 1000


def test_plain_deviations_by_their_definition():
    """SP 1065, eq. (6): half the mean square of differences of adjacent averages."""
    data = load("allan")["thousand"]
    samples = nbs14.generated(data)
    for factor, printed in zip(data["factors"], data["plain"], strict=True):
        averages = samples[: len(samples) // factor * factor].reshape(-1, factor).mean(axis=1)
        assert f"{np.sqrt(0.5 * np.mean(np.diff(averages) ** 2)):.6e}" == f"{float(printed):.6e}"


def test_both_suites_hold():
    found = nbs14.group(lambda fraction, what: None)
    assert found.passed
    assert [len(case.checks) for case in found.cases] == [4, 6]


def test_deviations_that_do_not_overlap_fail(monkeypatch):
    def plain(samples, factors, overlapping):
        return allan.allan_deviation(samples, factors, overlapping=False)

    monkeypatch.setattr(nbs14, "allan_deviation", plain)
    found = nbs14.group(lambda fraction, what: None)
    assert not any(case.passed for case in found.cases)
