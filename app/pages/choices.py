"""Language and theme: kept in cookies, so that the server writes the page in them at once."""

from typing import Annotated

from fastapi import APIRouter, Query, Response

from app.i18n import LANGUAGES
from app.pages.base import LANGUAGE_COOKIE, THEME_COOKIE, THEMES, local_path, see

router = APIRouter()

_YEAR_S = 365 * 86400


@router.get("/choose")
def choose(back: Annotated[str, Query(alias="next")] = "/", lang: str = "", theme: str = "") -> Response:
    """Keep a language or a theme (``auto``: the system's), then go back."""
    answer = see(local_path(back))
    if lang in LANGUAGES:
        answer.set_cookie(LANGUAGE_COOKIE, lang, max_age=_YEAR_S, samesite="lax")
    if theme in THEMES:
        answer.set_cookie(THEME_COOKIE, theme, max_age=_YEAR_S, samesite="lax")
    elif theme == "auto":
        answer.delete_cookie(THEME_COOKIE)
    return answer
