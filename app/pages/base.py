"""What every page shares: templates, the person who asks, language and theme.

A handler is synchronous (it runs in a thread), names its reader and the laboratory, and renders::

    @router.get("/stands")
    def listing(request: Request, person: Reader, lab: TheLab) -> Response:
        with lab.read(person) as work:
            found = stands.stands(work)
        return render(request, "stands/list.html", stands=found)
"""

import hashlib
from functools import cache
from http.cookies import SimpleCookie
from pathlib import Path
from typing import Annotated, Any, Final
from urllib.parse import urlencode

import jinja2
from fastapi import Depends, Request, Response
from fastapi.responses import HTMLResponse, RedirectResponse
from starlette.types import ASGIApp, Receive, Scope, Send

from app import figures, i18n
from app.errors import Unauthenticated, problem
from app.pages import labels
from app.services import access, overview, stands
from app.services.drift import alarms
from app.services.lab import Lab, Person

STATIC: Final = Path(__file__).parents[1] / "static"
TEMPLATES: Final = Path(__file__).parents[2] / "templates"
LANGUAGE_COOKIE: Final = "lang"
THEME_COOKIE: Final = "theme"
THEMES: Final = ("light", "dark")
PAGING: Final = ("after", "before", "start")
"""Parts of a query that say where in a list one is; a change of anything else starts it anew."""

_LOGIN: Final = "driftbook_login"


class Language:
    """Pure ASGI middleware: sets `i18n.LOCALE` from the cookie or the browser's wish."""

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer in the language asked for."""
        if scope["type"] == "http":
            i18n.LOCALE.set(_wanted_language(scope))
        await self._app(scope, receive, send)


def _wanted_language(scope: Scope) -> str:
    headers = {name: value.decode("latin-1") for name, value in scope["headers"]}
    cookie = SimpleCookie(headers.get(b"cookie", "")).get(LANGUAGE_COOKIE)
    return i18n.negotiate(cookie.value if cookie else None, headers.get(b"accept-language", ""))


@cache
def static(name: str) -> str:
    """Address of a file of ours, with its digest, so that a new version is fetched at once."""
    digest = hashlib.sha256((STATIC / name).read_bytes()).hexdigest()[:12]
    return f"/static/{name}?v={digest}"


def _environment() -> jinja2.Environment:
    made = jinja2.Environment(
        loader=jinja2.FileSystemLoader(TEMPLATES), autoescape=True, trim_blocks=True, lstrip_blocks=True,
        undefined=jinja2.StrictUndefined, extensions=["jinja2.ext.i18n"],
    )  # fmt: skip
    made.install_gettext_callables(  # type: ignore[attr-defined]
        i18n.gettext, i18n.ngettext, newstyle=True, pgettext=i18n.pgettext, npgettext=i18n.npgettext
    )
    made.globals |= {
        "figures": figures, "labels": labels, "languages": i18n.LANGUAGES, "lang": i18n.LOCALE.get,
        "static": static, "symbol": labels.symbol, "translate": i18n.translate, "themes": THEMES,
        "with_query": with_query,
    }  # fmt: skip
    return made


def with_query(request: Request, **changes: Any) -> str:
    """The address of the page asked for with some of its query changed, at the list's beginning.

    None takes a part away.
    """
    query = {name: value for name, value in request.query_params.items() if name not in PAGING} | changes
    kept = {name: value for name, value in query.items() if value not in (None, "")}
    return f"{request.url.path}?{urlencode(kept)}" if kept else request.url.path


environment: Final = _environment()


def render(request: Request, template: str, /, *, status: int = 200, **context: Any) -> HTMLResponse:
    """A whole page, with navigation for whoever is signed in."""
    person: Person | None = getattr(request.state, "person", None)
    stands_now, open_alarms = _navigation(request, person)
    html = environment.get_template(template).render(
        request=request, person=person, theme=theme_of(request), stands_now=stands_now,
        open_alarms=open_alarms, here=_address(request), **context,
    )  # fmt: skip
    return HTMLResponse(html, status_code=status, headers={"vary": "Cookie, Accept-Language"})


def fragment(template: str, /, **context: Any) -> str:
    """Part of a page, for htmx or a server-sent event."""
    return environment.get_template(template).render(**context)


def _address(request: Request) -> str:
    """Where the person is: of a form's answer, the page to come back to."""
    query = f"?{request.url.query}" if request.url.query and request.method == "GET" else ""
    return request.url.path + query


def _navigation(request: Request, person: Person | None) -> tuple[tuple[overview.StandNow, ...], int]:
    """What each stand does now, and how many alarms are open."""
    if person is None:
        return (), 0
    with lab_of(request).read(person) as work:
        names = tuple(stand.name for stand in stands.stands(work))
        return overview.stands_now(work, names), sum(alarms.counts(work).values())


def theme_of(request: Request) -> str | None:
    """The theme chosen, None for the system's."""
    chosen = request.cookies.get(THEME_COOKIE)
    return chosen if chosen in THEMES else None


def lab_of(request: Request) -> Lab:
    """The laboratory."""
    lab: Lab = request.app.state.lab
    return lab


def login_cookie(lab: Lab) -> str:
    """Name of the cookie: bound to the host where the service is reached by https."""
    return f"__Host-{_LOGIN}" if is_secure(lab) else _LOGIN


def is_secure(lab: Lab) -> bool:
    """Whether the service is reached by https."""
    return lab.settings.origin.startswith("https:")


def person_of(request: Request) -> Person | None:
    """Who is signed in with this browser."""
    lab = lab_of(request)
    secret = request.cookies.get(login_cookie(lab))
    if not secret:
        return None
    with lab.read(access.NOBODY) as work:
        person, stale = access.browser(work, secret), access.wants_touch(work, secret)
    if person is not None and stale:
        with lab.write(person) as work:
            access.touch(work, secret)
    return person


def reader(request: Request) -> Person:
    """Whoever is signed in; anybody else is led to the sign-in (see `errors.page`)."""
    person = person_of(request)
    if person is None:
        raise Unauthenticated(problem("sign-in", "Sign in first."))
    request.state.person = person
    access.require(person, "read")
    return person


def writer(request: Request) -> Person:
    """Whoever is signed in and may register, measure and solve."""
    person = reader(request)
    access.require(person, "upload")
    return person


Reader = Annotated[Person, Depends(reader)]
Writer = Annotated[Person, Depends(writer)]
TheLab = Annotated[Lab, Depends(lab_of)]


def local_path(wanted: str | None, otherwise: str = "/") -> str:
    """An address on this very site, or `otherwise`: nobody is sent elsewhere by a link."""
    if not wanted or not wanted.startswith("/") or wanted.startswith(("//", "/\\")) or "\n" in wanted:
        return otherwise
    return wanted


def see(address: str) -> Response:
    """Go there and GET it: the answer to a form that was used."""
    return RedirectResponse(address, status_code=303)
