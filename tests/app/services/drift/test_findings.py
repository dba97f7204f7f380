"""What a person is told, in words that fit what is known."""

import numpy as np
import pytest

from app.i18n import speaking
from app.pages import drift_words
from app.services.drift import findings, stand_findings

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


@pytest.mark.parametrize(("probability", "said"), [(1.0, "> 0.999"), (0.99871, "0.999"), (0.9632, "0.963")])
def test_a_turn_of_the_stand_is_never_certain(probability: float, said: str) -> None:
    """A probability is never printed as one: the page of the stand says the same (`stand_drift_words`)."""
    item = {
        "verdict": "stand", "direction": "azimuth", "since": "2026-01-01", "until": "2026-02-01",
        "probability": probability, "size_arcsec": 58.0, "u_arcsec": 4.5, "gyro": None, "calibration": 7,
        "event": None,
    }  # fmt: skip
    (found,) = stand_findings.alarms({"findings": [item]})
    assert f"probability {said}." in drift_words.sentence(found.template, found.values)
    with speaking("ru"):
        assert f"вероятность {said.replace('.', ',')}." in drift_words.sentence(found.template, found.values)
    # As it was written by earlier versions, with a number.
    assert "0.98" in drift_words.sentence("%(probability).3g", {"probability": 0.98})
