import pytest

from app import i18n
from solver.errors import Message


@pytest.mark.parametrize(
    ("chosen", "header", "language"),
    [
        ("ru", "en", "ru"),
        ("en", "ru", "en"),
        (None, "ru-RU,ru;q=0.9,en;q=0.8", "ru"),
        (None, "de, en;q=0.3, ru;q=0.7", "ru"),
        ("xx", "", "en"),
        (None, "fr;q=nonsense, de", "en"),
    ],
)
def test_the_choice_counts_before_the_browser(chosen: str | None, header: str, language: str) -> None:
    assert i18n.negotiate(chosen, header) == language


def test_a_message_is_translated_with_its_numbers() -> None:
    message = Message("bad-latitude", "The latitude %(latitude)g° does not lie between −90° and 90°. "
                      "South is negative.", {"latitude": -90.5})  # fmt: skip
    assert i18n.translate(message).startswith("The latitude −90.5° does not")
    with i18n.speaking("ru"):
        assert i18n.translate(message).startswith("Широта −90,5° не лежит")


def test_texts_in_a_message_stay_as_they_are() -> None:
    message = Message("any", "%(file)s, 5 %% of %(count)d", {"file": "run-1.csv", "count": -3})
    with i18n.speaking("ru"):
        assert i18n.translate(message) == "run-1.csv, 5 % of −3"


def test_a_percent_sign_without_values_is_left_alone() -> None:
    assert i18n.translate(Message("any", "100 % of it")) == "100 % of it"


@pytest.mark.parametrize(
    ("count", "text"), [(1, "1 гироскоп"), (3, "3 гироскопа"), (5, "5 гироскопов"), (21, "21 гироскоп")]
)
def test_russian_has_three_plurals(count: int, text: str) -> None:
    with i18n.speaking("ru"):
        assert i18n.ngettext("%(num)d gyro", "%(num)d gyros", count) % {"num": count} == text
