"""Every refusal of the API as a problem document (RFC 9457), made in this one place.

`type` names the kind and leads to its explanation, `code` the first problem, and `errors` holds
each problem with its place: `pointer` into a JSON body (RFC 6901, as a fragment), `parameter` of
the address, `header`, or `file`, `row` and `column` of an uploaded file.
"""

import re
from collections.abc import Iterable, Mapping
from http import HTTPStatus
from typing import Any, Final

import structlog
from fastapi import FastAPI, Request
from fastapi.exceptions import RequestValidationError
from fastapi.responses import JSONResponse
from starlette.exceptions import HTTPException

from app.api import links
from app.api.wording import worded
from app.errors import AppError, Problem, Unauthenticated
from app.services.views import ProblemView
from solver.errors import Message

MEDIA_TYPE: Final = "application/problem+json"
Json = dict[str, Any]

_log = structlog.get_logger(__name__)
_JSON_MEDIA = re.compile(r"application/([\w.-]+\+)?json", re.IGNORECASE)
_CODES: Final = {
    400: Message("bad-request", "The request cannot be read. Check how its body is written."),
    404: Message("unknown-address", "There is nothing at this address."),
    405: Message("wrong-method", "This address does not take this method; see the header “Allow”."),
    413: Message("too-big", "The body is larger than this address takes. Send it in parts."),
    500: Message("internal", "Something went wrong on our side; it has been noted. Try again later."),
}

_NO_JSON: Final = Message(
    "not-json", "Send the body as JSON with the header “Content-Type: application/json”."
)


def document(status: int, title: str, kind: str, errors: Iterable[Json]) -> Json:
    """A problem document. `kind` is the anchor of its explanation."""
    listed = list(errors)
    return {
        "type": links.kind_of_problem(kind),
        "title": title,
        "status": status,
        "detail": " ".join(_sentence(error) for error in listed),
        "code": listed[0]["code"],
        "errors": listed,
    }


def job_failed(problems: Iterable[ProblemView]) -> Json:
    """Why a job failed, as a problem document."""
    return document(422, "The job failed", "job-failed", [_of_file(item, _said(item)) for item in problems])


def install(app: FastAPI) -> None:
    """Answer every refusal of `app` by a problem document."""
    for kind in (AppError, RequestValidationError, HTTPException):
        app.add_exception_handler(kind, answer)


async def answer(request: Request, error: Exception) -> JSONResponse:
    """The problem document for any error; of one that nobody foresaw, nothing is told but logged."""
    if isinstance(error, AppError):
        media_type = request.headers.get("content-type", "")
        return response(error, json_body=_JSON_MEDIA.match(media_type) is not None)
    if isinstance(error, RequestValidationError):
        return _unfit(error)
    if isinstance(error, HTTPException):
        return _refused(error)
    _log.error("unforeseen", exc_info=error)
    return _answer(document(500, "Internal error", "internal", [_said(_CODES[500])]))


def response(error: AppError, *, json_body: bool = False) -> JSONResponse:
    """The answer to a foreseen error."""
    errors = [_placed(item, json_body=json_body) for item in error.problems]
    challenge = {"www-authenticate": "Bearer"} if isinstance(error, Unauthenticated) else None
    return _answer(document(error.status, error.title, _slug(type(error).__name__), errors), challenge)


def _unfit(error: RequestValidationError) -> JSONResponse:
    found = error.errors()
    if found[0]["loc"] == ("body",) and isinstance(error.body, bytes):
        return _answer(document(415, "Unsupported media type", "unsupported-media-type", [_said(_NO_JSON)]))
    if found[0]["type"] == "json_invalid":
        return _answer(document(400, "Bad request", "bad-request", [_said(worded(found[0]))]))
    errors = [{**_said(worded(item)), **_location(item["loc"])} for item in found]
    return _answer(document(422, "Input not usable", "invalid", errors))


def _refused(error: HTTPException) -> JSONResponse:
    title = HTTPStatus(error.status_code).phrase
    message = _CODES.get(error.status_code, Message(_slug(title), error.detail))
    content = document(error.status_code, title, _slug(title), [_said(message)])
    return _answer(content, error.headers)


def _answer(content: Json, headers: Mapping[str, str] | None = None) -> JSONResponse:
    return JSONResponse(content, content["status"], headers, media_type=MEDIA_TYPE)


def _said(message: Message | ProblemView) -> Json:
    text = message.template % message.values if message.values else message.template
    return {"detail": text, "code": message.code}


def _placed(item: Problem, *, json_body: bool) -> Json:
    error = _said(item.message)
    if item.file is not None:
        return _of_file(item, error)
    if item.column is None:
        return error
    if not json_body:
        return {**error, "parameter": item.column}
    if item.column.startswith("/"):
        return {**error, "pointer": _fragment(item.column)}
    # The only rows of a JSON body are those of its list of positions.
    path: list[int | str] = [item.column] if item.row is None else ["positions", item.row - 1, item.column]
    return {**error, "pointer": _pointer(path)}


def _of_file(item: Problem | ProblemView, error: Json) -> Json:
    place = {"file": item.file, "row": item.row, "column": item.column}
    return {**error, **{name: value for name, value in place.items() if value is not None}}


def _location(place: tuple[int | str, ...]) -> Json:
    where, *path = place
    if where == "body":
        return {"pointer": _pointer(path)}
    return {"header" if where == "header" else "parameter": str(path[-1])}


def _pointer(path: Iterable[int | str]) -> str:
    steps = (str(step).replace("~", "~0").replace("/", "~1") for step in path)
    return _fragment("".join(f"/{step}" for step in steps))


def _fragment(pointer: str) -> str:
    # JSON can write half a surrogate pair, UTF-8 cannot.
    return "#" + pointer.encode("utf-8", "replace").decode()


def _sentence(error: Json) -> str:
    if "pointer" in error:
        return f"{error['pointer'][2:].replace('/', '.') or 'body'}: {error['detail']}"
    named = [error[name] for name in ("parameter", "header", "file") if name in error]
    named += [f"{name} {error[name]}" for name in ("row", "column") if name in error]
    return f"{', '.join(named)}: {error['detail']}" if named else error["detail"]


def _slug(name: str) -> str:
    return re.sub(r"(?<=[a-z])(?=[A-Z])|\s+", "-", name).lower()
