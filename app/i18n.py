"""English and Russian: the language of a request, and every sentence in it.

The English text is the key; translations stand in ``app/locales/<language>/LC_MESSAGES/driftbook.po``
and are read at the start as they are, with no compiled file. After changing a text run
``python -m app.catalogue`` and translate what it names.

The language is a context variable. `app.pages` sets it for each request in pure ASGI middleware: set
in a synchronous dependency it would be lost with the copied context of that thread.
"""

import io
import re
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from contextvars import ContextVar
from gettext import GNUTranslations, NullTranslations
from pathlib import Path
from typing import Any, Final, Protocol

from babel.messages.mofile import write_mo
from babel.messages.pofile import read_po

DOMAIN: Final = "driftbook"
LANGUAGES: Final = {"en": "English", "ru": "Русский"}
"""Languages by their code, each in its own words."""

LOCALE: ContextVar[str] = ContextVar("locale", default="en")
"""Language of whoever is answered now."""

MINUS: Final = "\u2212"
_FOLDER: Final = Path(__file__).parent / "locales"
_PLACEHOLDER = re.compile(r"%\((?P<name>\w+)\)(?P<format>[-+ #0]*\d*(?:\.\d+)?)(?P<kind>[diouxXeEfFgGrs])|%%")


class Sentence(Protocol):
    """A translatable template with its values: `Message`, or the `ProblemView` of a stored problem."""

    @property
    def template(self) -> str:
        """English sentence with ``%(name)s`` placeholders."""

    @property
    def values(self) -> Mapping[str, Any]:
        """What the placeholders stand for."""


def po_file(language: str) -> Path:
    """The file of a language's translations."""
    return _FOLDER / language / "LC_MESSAGES" / f"{DOMAIN}.po"


def _catalogue(language: str) -> NullTranslations:
    path = po_file(language)
    if not path.exists():
        return NullTranslations()
    compiled = io.BytesIO()
    with path.open("rb") as file:
        write_mo(compiled, read_po(file, locale=language))
    compiled.seek(0)
    return GNUTranslations(compiled)


_CATALOGUES: Final = {language: _catalogue(language) for language in LANGUAGES}


@contextmanager
def speaking(language: str) -> Iterator[None]:
    """Answer in this language within the block."""
    token = LOCALE.set(language)
    try:
        yield
    finally:
        LOCALE.reset(token)


def marked(text: str) -> str:
    """Mark a text for the catalogue where it is written; `gettext` translates it where it is shown."""
    return text


def gettext(text: str) -> str:
    """The text in the current language."""
    return _CATALOGUES[LOCALE.get()].gettext(text) if text else ""


def ngettext(singular: str, plural: str, count: int) -> str:
    """The form that fits the count, in the current language."""
    return _CATALOGUES[LOCALE.get()].ngettext(singular, plural, count)


def pgettext(context: str, text: str) -> str:
    """The text in the current language, where English has one word for two things."""
    return _CATALOGUES[LOCALE.get()].pgettext(context, text)


def npgettext(context: str, singular: str, plural: str, count: int) -> str:
    """`ngettext` within a context."""
    return _CATALOGUES[LOCALE.get()].npgettext(context, singular, plural, count)


def translate(sentence: Sentence) -> str:
    """A message in the current language, numbers in it as the language writes them."""

    def filled(match: re.Match[str]) -> str:
        if match["name"] is None:
            return "%"
        value, kind = sentence.values[match["name"]], match["kind"]
        text = f"%{match['format']}{kind}" % value
        return localised(text) if isinstance(value, float) or kind not in "rs" else text

    template = gettext(sentence.template)
    return _PLACEHOLDER.sub(filled, template) if sentence.values else template


def localised(figure: str) -> str:
    """A number as Python writes it, with a true minus and the language's decimal sign."""
    figure = figure.replace("-", MINUS)
    return figure.replace(".", ",") if LOCALE.get() == "ru" else figure


def negotiate(chosen: str | None, accept_language: str) -> str:
    """The language to answer in: the one chosen before, else the browser's first known one."""
    if chosen in LANGUAGES:
        return chosen
    wanted: list[tuple[float, str]] = []
    for item in accept_language.split(","):
        tag, _, quality = item.partition(";q=")
        try:
            weight = float(quality or 1)
        except ValueError:
            continue
        wanted.append((-weight, tag.strip().split("-")[0].lower()))
    return next((tag for weight, tag in sorted(wanted, key=lambda pair: pair[0]) if tag in LANGUAGES), "en")
