"""What a person is told, in words that fit what is known."""

import numpy as np
import pytest

from app.services.drift import findings

LAST = np.datetime64("2026-10-27T12:00:00")


@pytest.mark.parametrize(
    ("earliest", "latest", "code"),
    [
        ("2026-11-20T00:00:00+00:00", "2027-02-01T00:00:00+00:00", "limit-ahead"),
        ("2026-11-20T00:00:00+00:00", None, "limit-ahead-open"),
        ("2026-10-27T12:00:00+00:00", None, "limit-ahead-now"),
        ("2026-10-27T12:00:00+00:00", "2027-02-01T00:00:00+00:00", "limit-ahead-now"),
    ],
)
def test_an_open_end_of_when_a_limit_is_reached_is_said(earliest: str, latest: str | None, code: str) -> None:
    """An interval that begins with the last value, or has no end, is said in words, not as a day gone or a dash."""
    assert findings.ahead_of({"earliest": earliest, "latest": latest}, LAST).code == code


def test_a_single_value_beyond_the_control_limits_is_not_the_last_of_many() -> None:
    assert (
        findings.sentence("beyond-limits", 1).template == "%(value)s %(unit)s lies beyond the control limits."
    )
    assert findings.sentence("beyond-limits", 2).template.startswith("%(count)d beyond the control limits")
