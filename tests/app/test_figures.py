from datetime import UTC, date, datetime, timedelta

import pytest
from hypothesis import given
from hypothesis import strategies as st

from app import figures
from app.i18n import speaking


@pytest.mark.parametrize(
    ("value", "expanded", "text"),
    [
        (2063.2549, 0.4412, "2063.25 ± 0.44"),  # numbers of the mock-up of the result
        (-0.23017, 0.0024, "−0.2302 ± 0.0024"),
        (1.48251, 0.00214, "1.4825 ± 0.0021"),
        (1.0, 0.0996, "1.00 ± 0.10"),  # U rounds up to a further digit
        (1234.5, 123.0, "1230 ± 120"),
        (-0.00001, 0.0021, "0.0000 ± 0.0021"),  # no minus before a zero
        (0.5, 12.0, "0 ± 12"),
    ],
)
def test_value_and_uncertainty_end_at_the_second_digit_of_u(value: float, expanded: float, text: str) -> None:
    assert str(figures.measured(value, expanded)) == text


def test_russian_has_a_decimal_comma_and_both_a_true_minus() -> None:
    with speaking("ru"):
        shown = figures.measured(-0.79812, 0.0021)
    assert (shown.value.whole, shown.value.fraction) == ("−0", ",7981")
    assert str(shown.expanded) == "0,0021"


def test_a_change_says_which_way() -> None:
    assert str(figures.measured(0.5112, 0.0214, sign=True)) == "+0.511 ± 0.021"
    assert str(figures.measured(-57.4, 26.0, sign=True)) == "−57 ± 26"
    assert str(figures.measured(0.00001, 0.0021, sign=True)) == "0.0000 ± 0.0021"  # no way at all


@pytest.mark.parametrize("expanded", [None, 0.0, float("nan"), float("inf")])
def test_without_a_usable_u_nothing_is_claimed(expanded: float | None) -> None:
    shown = figures.measured(1.23456789, expanded)
    assert shown.expanded is None
    assert str(shown) == "1.2346"


@given(st.floats(-1e6, 1e6), st.floats(1e-9, 1e5))
def test_rounding_moves_a_value_by_half_a_step_at_most(value: float, expanded: float) -> None:
    decimals = figures.decimals_of(expanded)
    assert decimals is not None
    shown = float(figures.rounded(value, decimals))
    # Half of the step, and what two float64 numbers of this size cannot tell apart.
    assert abs(shown - value) <= 0.5 * 10.0**-decimals + 1e-15 * abs(value) + 1e-15
    # Two significant digits: the step is between a hundredth and a tenth of U, rounding of U allowed for.
    assert 10.0**-decimals <= 0.1 * expanded * 1.06
    assert 10.0**-decimals >= 0.0099 * expanded


def test_a_plus_stands_before_differences_only() -> None:
    assert str(figures.figure(0.04, 2)) == "0.04"
    assert str(figures.figure(0.04, 2, sign=True)) == "+0.04"
    assert str(figures.figure(-0.14, 2, sign=True)) == "−0.14"
    assert str(figures.figure(0.0, 2, sign=True)) == "0.00"


@given(st.floats(allow_nan=False, allow_infinity=False, width=64))
def test_what_stands_in_a_field_reads_back_as_the_same_number(value: float) -> None:
    text = figures.entered(value)
    assert float(text.replace("−", "-")) == value


def test_numbers_are_shown_as_they_were_given() -> None:
    assert figures.plain(55.7558) == "55.7558"
    assert figures.plain(-0.0) == "0"
    assert figures.plain(180.0) == "180"
    assert figures.places([6.9, 16.0, -0.25, None]) == 2
    assert figures.places([]) == 0
    assert figures.significant(1.234e-5) == "1.23·10⁻⁵"


NOW = datetime(2026, 11, 20, 14, 32, tzinfo=UTC)


@pytest.mark.parametrize(
    ("before", "english", "russian"),
    [
        (timedelta(seconds=3), "3 s ago", "3 с назад"),
        (timedelta(minutes=23), "23 min ago", "23 мин назад"),
        (timedelta(hours=5), "5 h ago", "5 ч назад"),
        (timedelta(days=1), "1 day ago", "1 день назад"),
        (timedelta(days=4), "4 days ago", "4 дня назад"),
    ],
)
def test_ages(before: timedelta, english: str, russian: str) -> None:
    assert figures.age(NOW - before, NOW) == english
    with speaking("ru"):
        assert figures.age(NOW - before, NOW) == russian


def test_dates_and_terms() -> None:
    due, today = date(2027, 2, 18), date(2026, 11, 20)
    assert (figures.day(due), figures.term(due, today)) == ("18 Feb 2027", "in 90 days")
    with speaking("ru"):
        assert (figures.day(due), figures.term(due, today)) == ("18.02.2027", "через 90 дней")
    assert figures.term(today, today) == "today"
    assert figures.term(today - timedelta(days=18), today) == "18 days ago"
    assert figures.long_day(today) == "Friday 20 November 2026"


def test_lengths_of_time() -> None:
    assert [figures.duration(seconds) for seconds in (0.44, 60, 125, 180)] == [
        "0.4 s",
        "60 s",
        "2 min 5 s",
        "3 min",
    ]
