"""Decision rule with guard band w = U (ILAC-G8:2019, 4.2.2)."""

import pytest

from app.services.verdicts import judge, worst


@pytest.mark.parametrize(
    ("value", "u", "verdict"),
    [
        (0.0, 0.1, "conforms"),
        (0.8, 0.1, "conforms"),  # exactly U = 0.2 inside
        (0.81, 0.1, "conditional"),
        (-1.0, 0.1, "conditional"),  # on the limit
        (1.01, 0.1, "fails"),
        (-1.01, 0.0, "fails"),
        (0.0, None, "conditional"),  # nobody knows how far inside
        (None, None, "undetermined"),
    ],
)
def test_a_value_against_its_limits(value, u, verdict):
    assert judge(value, u, -1.0, 1.0) == verdict


def test_without_limits_nothing_is_judged():
    assert judge(5.0, 0.1, None, None) == "no-limit"


@pytest.mark.parametrize(
    ("all_of_them", "together"),
    [
        (["conforms", "no-limit"], "conforms"),
        (["no-limit", "no-limit"], "no-limit"),
        (["conforms", "conditional"], "conditional"),
        (["conditional", "undetermined"], "undetermined"),
        (["undetermined", "fails"], "fails"),
    ],
)
def test_the_worst_verdict_speaks_for_all(all_of_them, together):
    assert worst(all_of_them) == together
