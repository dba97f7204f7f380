"""Each middleware alone, around a small application."""

from typing import Any

import httpx
import pytest
from anyio import BrokenResourceError
from starlette.applications import Starlette
from starlette.requests import Request
from starlette.responses import PlainTextResponse, Response, StreamingResponse
from starlette.routing import Route
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from app.middleware import BodyLimit, LastResort, RequestLog, SameSite, SecurityHeaders


async def echo(request: Request) -> Response:
    body = await request.body()
    return PlainTextResponse(str(len(body)))


async def large(request: Request) -> Response:
    request.state.body_budget.limit = 100
    return await echo(request)


async def broken(_request: Request) -> Response:
    raise RuntimeError("secret of the house")


async def broken_midway(_request: Request) -> Response:
    async def pieces() -> Any:
        yield b"half"
        raise RuntimeError("secret of the house")

    return StreamingResponse(pieces())


APP = Starlette(
    routes=[
        Route("/", echo, methods=["GET", "POST", "PUT"]),
        Route("/large", large, methods=["POST"]),
        Route("/api/v1/things/{id}", echo),
        Route("/links/{secret}", echo),
    ]
)


async def ask(app: ASGIApp, method: str = "GET", path: str = "/", **what: Any) -> httpx.Response:
    transport = httpx.ASGITransport(app=app, raise_app_exceptions=True)
    async with httpx.AsyncClient(transport=transport, base_url="http://lab.example") as client:
        return await client.request(method, path, **what)


def same_site(origin: str = "") -> SameSite:
    return SameSite(APP, origin=origin, refusal=lambda _scope: PlainTextResponse("foreign", 403))


@pytest.mark.anyio
@pytest.mark.parametrize(
    ("headers", "status"),
    [
        ({}, 200),  # no browser
        ({"sec-fetch-site": "same-origin"}, 200),
        ({"sec-fetch-site": "none"}, 200),  # typed by the person
        ({"sec-fetch-site": "same-site"}, 403),
        ({"sec-fetch-site": "cross-site"}, 403),
        ({"sec-fetch-site": "cross-site", "authorization": "Bearer x"}, 200),
        ({"sec-fetch-site": "cross-site", "authorization": "Basic x"}, 403),
        ({"sec-fetch-site": "cross-site", "origin": "http://lab.example"}, 403),
        ({"origin": "http://lab.example"}, 200),  # a browser before Sec-Fetch-Site
        ({"origin": "http://lab.example:81"}, 403),
        ({"origin": "http://lab.example.evil.example"}, 403),
        ({"origin": "null"}, 403),
    ],
)
async def test_where_a_request_comes_from(headers: dict[str, str], status: int) -> None:
    assert (await ask(same_site(), "POST", headers=headers)).status_code == status


@pytest.mark.anyio
async def test_reading_is_free() -> None:
    assert (await ask(same_site(), "GET", headers={"sec-fetch-site": "cross-site"})).status_code == 200


@pytest.mark.anyio
async def test_with_a_configured_origin() -> None:
    app = same_site("https://gyros.example/")
    assert (await ask(app, "POST", headers={"origin": "https://gyros.example"})).status_code == 200
    assert (await ask(app, "POST", headers={"origin": "http://gyros.example"})).status_code == 403
    assert (await ask(app, "POST", headers={"origin": "http://lab.example"})).status_code == 403


@pytest.mark.anyio
@pytest.mark.parametrize(
    ("path", "size", "status"), [("/", 10, 200), ("/", 11, 413), ("/large", 100, 200), ("/large", 101, 413)]
)
@pytest.mark.parametrize("declared", [True, False])
async def test_a_body_is_bounded(path: str, size: int, status: int, declared: bool) -> None:
    async def pieces() -> Any:
        for _ in range(size):
            yield b"x"

    content = b"x" * size if declared else pieces()
    answer = await ask(BodyLimit(APP, largest=1000, in_memory=10), "POST", path, content=content)
    assert answer.status_code == status


@pytest.mark.anyio
async def test_forms_of_pages_are_kept_on_disk_and_may_be_large() -> None:
    app = BodyLimit(APP, largest=1000, in_memory=10)
    for path, status in (("/", 200), ("/api/v1/things/1", 405)):
        assert (await ask(app, "POST", path, files={"file": b"x" * 100})).status_code == status
    assert (await ask(app, "POST", "/", files={"file": b"x" * 1000})).status_code == 413


@pytest.mark.anyio
async def test_a_header_set_by_the_answer_stays() -> None:
    async def own(_request: Request) -> Response:
        return Response(headers={"referrer-policy": "no-referrer"})

    app = SecurityHeaders(Starlette(routes=[Route("/", own)]), https=True)
    headers = (await ask(app)).headers
    assert headers["referrer-policy"] == "no-referrer"
    assert headers["strict-transport-security"].startswith("max-age=")
    assert headers["cross-origin-resource-policy"] == "same-origin"


@pytest.mark.anyio
async def test_patterns_are_counted_and_secrets_are_not() -> None:
    seen: list[tuple[str, str, int]] = []
    app = RequestLog(APP, lambda method, route, status, _seconds: seen.append((method, route, status)))
    for path in ("/links/abc", "/api/v1/things/7", "/unknown/abc"):
        await ask(app, path=path)
    assert seen == [("GET", "/links/{secret}", 200), ("GET", "/api/v1/things/{id}", 200), ("GET", "-", 404)]


@pytest.mark.anyio
async def test_the_last_resort_answers_what_failed() -> None:
    errors: list[Exception] = []

    async def answer(_request: Request, error: Exception) -> Response:
        errors.append(error)
        return PlainTextResponse("sorry", 500)

    routes = [Route("/broken", broken), Route("/midway", broken_midway)]
    app = Starlette(routes=routes)
    app.add_middleware(LastResort, answer=answer)
    answered = await ask(app, path="/broken")
    assert (answered.status_code, answered.text) == (500, "sorry")
    assert str(errors[0]) == "secret of the house"
    with pytest.raises(RuntimeError):  # half an answer must not look like a whole one
        await ask(app, path="/midway")
    assert len(errors) == 1


@pytest.mark.anyio
async def test_a_client_that_has_gone_is_no_failure_but_a_failure_beside_it_is() -> None:
    raised: list[Exception] = []

    async def stream(_scope: Scope, _receive: Receive, send: Send) -> None:
        await send({"type": "http.response.start", "status": 200, "headers": []})
        raise ExceptionGroup("of a stream's tasks", raised)

    async def answer(_request: Request, _error: Exception) -> Response:
        raise AssertionError("nobody is there to be answered")

    app = LastResort(stream, answer)

    async def receive() -> Message:
        return {"type": "http.disconnect"}

    async def send(message: Message) -> None:
        sent.append(message["type"])

    sent: list[str] = []
    raised[:] = [BrokenResourceError()]
    await app({"type": "http"}, receive, send)
    assert sent == ["http.response.start"], "no answer is added to half a one"
    raised[:] = [BrokenResourceError(), RuntimeError("ours")]
    with pytest.raises(ExceptionGroup):
        await app({"type": "http"}, receive, send)


@pytest.fixture
def anyio_backend() -> str:
    return "asyncio"
