import re

import pytest

from app import catalogue
from app.i18n import LANGUAGES

_PLACEHOLDER = re.compile(r"%\(\w+\)[-+ #0]*\d*(?:\.\d+)?[a-zA-Z]")
_MARKUP = re.compile(r"</?\w+>")
OTHERS = [language for language in LANGUAGES if language != "en"]


def _parts(text: str, pattern: re.Pattern[str]) -> list[str]:
    return sorted(set(pattern.findall(text)))


@pytest.fixture(scope="module")
def texts() -> dict[str | tuple[str, ...], str]:
    """Every text that is shown, and where the first of it stands."""
    return {
        tuple(item.id) if isinstance(item.id, list | tuple) else item.id: item.locations[0][0]
        for item in catalogue.texts()
        if item.id
    }


@pytest.mark.parametrize("language", OTHERS)
def test_every_text_is_translated(language: str, texts: dict[str | tuple[str, ...], str]) -> None:
    known = catalogue.translations(language)
    open_texts = {str(item.id) for item in catalogue.missing(known)}
    lacking = [f"{place}: {text}" for text, place in texts.items() if known.get(_key(text)) is None]
    assert lacking == [], "run python -m app.catalogue and translate"
    assert open_texts == set()


@pytest.mark.parametrize("language", OTHERS)
def test_translations_keep_the_placeholders(language: str) -> None:
    for item in catalogue.translations(language):
        if not item.id:
            continue
        sources = item.id if isinstance(item.id, tuple) else (item.id,)
        for form in item.string if isinstance(item.string, tuple) else (item.string,):
            for pattern in (_PLACEHOLDER, _MARKUP):
                assert _parts(form, pattern) == _parts(sources[-1], pattern), form


def test_sources_of_every_kind_are_collected(texts: dict[str | tuple[str, ...], str]) -> None:
    assert "Skip to content" in texts  # a template
    assert ("%(num)d gyro", "%(num)d gyros") in texts  # a plural in a template
    assert "Fixed drift, x" in texts  # marked in Python
    assert "There is no job %(id)s." in texts  # problem(…)
    assert "The columns %(columns)s hold one quantity. Keep one of them." in texts  # Message(…)
    assert not any(place.startswith(("app/cli/", "app/api/")) for place in texts.values())


def _key(text: str | tuple[str, ...]) -> str:
    return text[0] if isinstance(text, tuple) else text
