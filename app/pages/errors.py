"""An error as a page: what happened, where, and what to do next."""

import logging
from typing import Final
from urllib.parse import quote

import structlog
from fastapi import Request, Response
from fastapi.exceptions import RequestValidationError
from fastapi.responses import RedirectResponse
from starlette.exceptions import HTTPException

from app.errors import AppError, NotFound, Unauthenticated
from app.i18n import gettext, marked
from app.pages.base import local_path, person_of, render
from app.pages.forms import sentence

_log = structlog.get_logger(__name__)

_TITLES: Final = {
    400: marked("This request cannot be used"),
    403: marked("You may not do this"),
    404: marked("Nothing is here"),
    405: marked("This address takes no such request"),
    409: marked("This contradicts what is there"),
    413: marked("This is too large"),
    422: marked("This input cannot be used"),
    500: marked("Something went wrong on our side"),
}
_NEXT: Final = {
    403: marked("Ask whoever looks after this installation for the right, or go back."),
    404: marked("Check the address, or start from one of the lists."),
    500: marked("What was saved before is kept. Try again; if it happens again, tell whoever looks after "
                "this installation the time and the address."),
}  # fmt: skip


def page(request: Request, error: AppError | Exception) -> Response:
    """The page for an error; whoever is not signed in is led to the sign-in and back."""
    if isinstance(error, Unauthenticated):
        return _to_sign_in(request)
    status, sentences = _said(error)
    if status >= 500:
        _log.log(logging.ERROR, "page-failed", path=request.url.path, exc_info=error)
        request.state.person = None  # the navigation asks the database, which may be what failed
    elif not hasattr(request.state, "person"):
        request.state.person = person_of(request)
    title = gettext(_TITLES.get(status, _TITLES[400 if status < 500 else 500]))
    return render(
        request, "errors/page.html", status=status, code=status, title=title, sentences=sentences,
        advice=gettext(_NEXT.get(status, "")),
    )  # fmt: skip


def _said(error: Exception) -> tuple[int, list[str]]:
    if isinstance(error, AppError):
        return error.status, [sentence(item) for item in error.problems]
    if isinstance(error, RequestValidationError):
        # A part of the address is no number, say: such a page does not exist.
        in_path = any(item["loc"][0] == "path" for item in error.errors())
        return (NotFound.status if in_path else 422), []
    if isinstance(error, HTTPException):
        return error.status_code, []
    return 500, []


def _to_sign_in(request: Request) -> Response:
    came_from = request.url.path
    if request.url.query:
        came_from += f"?{request.url.query}"
    if request.method not in ("GET", "HEAD"):
        came_from = "/"
    target = "/sign-in" if came_from == "/" else _sign_in_url(came_from)
    if request.headers.get("hx-request"):
        return Response(status_code=200, headers={"hx-redirect": target})
    return RedirectResponse(target, status_code=303)


def _sign_in_url(came_from: str) -> str:
    return f"/sign-in?next={quote(local_path(came_from), safe='/')}"
