"""Around every request, in pure ASGI: log and count, protect, bound.

`main.create_app` puts them together, outermost first: `RequestLog`, `SecurityHeaders`,
`SameSite`, `BodyLimit`, `LastResort`.
"""

import time
from collections.abc import Awaitable, Callable
from typing import Final
from urllib.parse import urlsplit

import structlog
from anyio import BrokenResourceError
from starlette.datastructures import Headers, MutableHeaders
from starlette.exceptions import HTTPException
from starlette.requests import ClientDisconnect, Request
from starlette.responses import Response
from starlette.types import ASGIApp, Message, Receive, Scope, Send

SAFE_METHODS: Final = frozenset({"GET", "HEAD", "OPTIONS", "TRACE"})

POLICY: Final = "; ".join(
    (
        "default-src 'none'",
        "script-src 'self'",
        "style-src 'self'",
        "img-src 'self' data:",
        "connect-src 'self'",
        "font-src 'self'",
        "base-uri 'none'",
        "form-action 'self'",
        "frame-ancestors 'none'",
    )
)
"""Content-Security-Policy of every answer: nothing from elsewhere, nothing inline."""

_HEADERS: Final = {
    "content-security-policy": POLICY,
    "x-content-type-options": "nosniff",
    "referrer-policy": "same-origin",
    "cross-origin-opener-policy": "same-origin",
    "cross-origin-resource-policy": "same-origin",
    "permissions-policy": "camera=(), geolocation=(), microphone=()",
}
_HSTS: Final = "max-age=31536000"
IN_MEMORY_BYTES: Final = 8 * 2**20

_log = structlog.get_logger("driftbook.request")


class RequestLog:
    """One line per request, and `observe(method, route, status, seconds)` for the metrics.

    A path may hold a secret (a sign-in link), so the line has the route's pattern; only the API's
    paths, which hold none, are written out. The query is never written.
    """

    def __init__(self, app: ASGIApp, observe: Callable[[str, str, int, float], None]) -> None:
        self._app = app
        self._observe = observe

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass on, then tell."""
        if scope["type"] != "http":
            return await self._app(scope, receive, send)
        started, status = time.perf_counter(), 500

        async def noted(message: Message) -> None:
            nonlocal status
            if message["type"] == "http.response.start":
                status = message["status"]
            await send(message)

        path, method = scope["path"], scope["method"]
        try:
            await self._app(scope, receive, noted)
        finally:
            seconds, route = time.perf_counter() - started, _route(scope, path)
            self._observe(method, route, status, seconds)
            shown = path if path.startswith("/api/") else route
            _log.info(
                "request", method=method, path=shown, status=status, duration_ms=round(seconds * 1e3, 1)
            )


def _route(scope: Scope, path: str) -> str:
    """The pattern of the route that answered; an unknown path is not written out."""
    pattern = getattr(scope.get("route"), "path", None)
    if not isinstance(pattern, str):
        return "-"
    prefix = "/api/v1"
    inside = path.startswith(prefix + "/") and not pattern.startswith(prefix)
    return prefix + pattern if inside else pattern


class SecurityHeaders:
    """Puts the policy and its companions on every answer; a header that is set already stays."""

    def __init__(self, app: ASGIApp, *, https: bool) -> None:
        self._app = app
        self._headers = _HEADERS | ({"strict-transport-security": _HSTS} if https else {})

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass on and add."""
        if scope["type"] != "http":
            return await self._app(scope, receive, send)

        async def protected(message: Message) -> None:
            if message["type"] == "http.response.start":
                headers = MutableHeaders(scope=message)
                for name, value in self._headers.items():
                    headers.setdefault(name, value)
            await send(message)

        return await self._app(scope, receive, protected)


class SameSite:
    """Refuses what another site makes a browser send.

    A browser says where a request comes from (Sec-Fetch-Site, else Origin), and only a browser
    carries somebody's cookie without being told to. So an unsafe request passes when it comes from
    this site, when no browser sent it, or when it brings a bearer token, which no foreign page has.
    """

    def __init__(self, app: ASGIApp, *, origin: str, refusal: Callable[[Scope], Response]) -> None:
        self._app = app
        self._origin = origin.rstrip("/")
        self._refusal = refusal

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass on or refuse."""
        if scope["type"] == "http" and scope["method"] not in SAFE_METHODS and self._is_foreign(scope):
            return await self._refusal(scope)(scope, receive, send)
        return await self._app(scope, receive, send)

    def _is_foreign(self, scope: Scope) -> bool:
        headers = Headers(scope=scope)
        if headers.get("authorization", "").lower().startswith("bearer "):
            return False
        site, origin = headers.get("sec-fetch-site"), headers.get("origin")
        if site is not None:
            return site not in ("same-origin", "none")
        if origin is None:
            return False
        if self._origin:
            return origin != self._origin
        return urlsplit(origin).netloc != headers.get("host", "")


class Budget:
    """How many bytes the body of this request may have."""

    def __init__(self, limit: int) -> None:
        self.limit = limit


class BodyLimit:
    """Bounds the request's body, declared or not, by 413.

    What is read into memory has a small bound. A handler that streams its body to a file sets
    ``scope["state"]["body_budget"].limit`` to its own before it reads; forms of the pages, whose
    files the form parser keeps on disk, have the large one.
    """

    def __init__(self, app: ASGIApp, *, largest: int, in_memory: int = IN_MEMORY_BYTES) -> None:
        self._app = app
        self._largest = largest
        self._in_memory = in_memory

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass on, counting."""
        if scope["type"] != "http":
            return await self._app(scope, receive, send)
        headers, taken = Headers(scope=scope), 0
        declared = headers.get("content-length", "")
        announced = int(declared) if declared.isdecimal() else 0
        form = headers.get("content-type", "").startswith("multipart/form-data")
        spooled = form and not scope["path"].startswith("/api/")
        budget = Budget(self._largest if spooled else min(self._largest, self._in_memory))
        scope.setdefault("state", {})["body_budget"] = budget

        async def counted() -> Message:
            nonlocal taken
            message = await receive()
            taken += len(message.get("body", b""))
            if max(taken, announced) > budget.limit:
                raise HTTPException(413)
            return message

        return await self._app(scope, counted, send)


class LastResort:
    """Answers an error that nobody foresaw, inside the other middleware, which then does its part."""

    def __init__(self, app: ASGIApp, answer: Callable[[Request, Exception], Awaitable[Response]]) -> None:
        self._app = app
        self._answer = answer

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass on; answer what fails before it has answered."""
        if scope["type"] != "http":
            return await self._app(scope, receive, send)
        begun = False

        async def noted(message: Message) -> None:
            nonlocal begun
            begun = True
            await send(message)

        try:
            await self._app(scope, receive, noted)
        except Exception as error:
            if _is_gone(error):
                return None  # nobody is left to be answered
            if begun:  # half an answer: the connection has to break, so that nobody takes it for a whole one
                raise
            answer = await self._answer(Request(scope, receive), error)
            await answer(scope, receive, send)


def _is_gone(error: Exception) -> bool:
    """Whether all that failed is that the client has gone; a stream's keep-alive meets its closed end."""
    if isinstance(error, ExceptionGroup):
        return all(_is_gone(part) for part in error.exceptions)
    return isinstance(error, ClientDisconnect | BrokenResourceError)
