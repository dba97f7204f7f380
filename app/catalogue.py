"""Keep the translations in step with the texts: ``python -m app.catalogue``.

Collects every text that a person may read in a browser (templates, `gettext`, `marked`, and the
templates of `problem`, `refuse` and `Message`) and brings it into each ``driftbook.po``; then it
prints what is still to be translated. The command line and the machine interface speak English.
"""

import os
import sys
from collections.abc import Iterable, Iterator
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Final

from babel.messages.catalog import Catalog, Message
from babel.messages.extract import extract_from_dir
from babel.messages.pofile import read_po, write_po

from app.i18n import DOMAIN, LANGUAGES, po_file

_PROJECT: Final = Path(__file__).parents[1]
_ENGLISH_ONLY: Final = ("app/cli/", "app/api/")
# Spelled out: "_" is a keyword in templates only, in Python it is a name for what is not used.
_PYTHON: Final[dict[str, Any]] = {
    "gettext": None, "marked": None, "ngettext": (1, 2), "pgettext": ((1, "c"), 2),
    "problem": (2,), "refuse": (2,), "Message": (2,),
}  # fmt: skip
_TEMPLATES: Final[dict[str, Any]] = {
    "_": None,
    "gettext": None,
    "ngettext": (1, 2),
    "pgettext": ((1, "c"), 2),
}
_OPTIONS: Final[dict[str, dict[str, Any]]] = {
    "**": {"newstyle_gettext": "true", "trimmed": "true", "silent": "false"}
}


def texts() -> Catalog:
    """Every text there is to be translated, with where it stands."""
    found = Catalog(project="Driftbook", domain=DOMAIN, charset="utf-8")
    for folder, name, text, context in _extracted():
        place = f"{folder}/{name}".replace("\\", "/")
        if not place.startswith(_ENGLISH_ONLY):
            found.add(text, None, [(place, 0)], context=context)
    return found


def _extracted() -> Iterator[tuple[str, str, Any, str | None]]:
    for folder, method, pattern, keywords in (
        ("solver", "python", "**.py", _PYTHON),
        ("app", "python", "**.py", _PYTHON),
        ("templates", "jinja2", "**.html", _TEMPLATES),
    ):
        options = _OPTIONS if method == "jinja2" else None
        for name, _, text, _, context in extract_from_dir(
            _PROJECT / folder, [(pattern, method)], options, keywords=keywords
        ):
            yield folder, name, text, context


def translations(language: str) -> Catalog:
    """What is translated into a language."""
    with po_file(language).open("rb") as file:
        return read_po(file, locale=language, domain=DOMAIN)


def missing(catalogue: Catalog) -> list[Message]:
    """Texts without a translation, or with a plural form missing."""
    return [item for item in catalogue if item.id and not all(_forms(item.string))]


def _forms(string: Any) -> Iterable[str]:
    return (string or "",) if not isinstance(string, tuple) else string


def refresh(language: str) -> Catalog:
    """Bring every text into the language's file; texts that are gone go."""
    kept = translations(language) if po_file(language).exists() else Catalog(locale=language)
    template = texts()
    template.creation_date = kept.creation_date or datetime.now(UTC)
    kept.update(template, no_fuzzy_matching=True)
    kept.project, kept.version, kept.msgid_bugs_address = "Driftbook", "0", ""
    kept.last_translator = kept.language_team = "Driftbook"
    kept.header_comment, kept.fuzzy = (
        f"# Driftbook, language {language}; refreshed by python -m app.catalogue",
        False,
    )
    kept.revision_date = kept.creation_date
    unfinished = po_file(language).with_suffix(f".{os.getpid()}.part")  # two may do this at once
    with unfinished.open("wb") as file:
        write_po(
            file,
            kept,
            width=110,
            omit_header=False,
            sort_output=True,
            include_lineno=False,
            ignore_obsolete=True,
        )
    unfinished.replace(po_file(language))
    return kept


def main() -> int:
    """Refresh every language; 1 when something is still to be translated."""
    unfinished = 0
    for language in LANGUAGES:
        if language == "en":
            continue
        open_texts = missing(refresh(language))
        unfinished += len(open_texts)
        for item in open_texts:
            sys.stdout.write(f"{language}: {item.id if isinstance(item.id, str) else item.id[0]}\n")
    return 1 if unfinished else 0


if __name__ == "__main__":
    sys.exit(main())
