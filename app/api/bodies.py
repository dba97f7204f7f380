"""Bodies that FastAPI does not parse for us: JSON or a file at one address, and long ones as a stream."""

import json
import os
import tempfile
from collections.abc import AsyncIterator, Mapping
from pathlib import Path
from typing import Annotated, Any, Final, TypeVar

from fastapi import Depends, Request
from fastapi.concurrency import run_in_threadpool
from fastapi.exceptions import RequestValidationError
from pydantic import BaseModel, ValidationError

from app.services.lab import Lab

M = TypeVar("M", bound=BaseModel)
LARGEST_RECORD: Final = 64 * 2**20
"""Bytes of one position's record as sent: hours of it; what is longer comes as a session."""

FILE_TYPES: Final = (
    "text/csv",
    "application/vnd.apache.parquet",
    "application/gzip",
    "application/zstd",
    "application/octet-stream",
)
_SUFFIXES: Final = {
    "text/csv": "csv",
    "application/vnd.apache.parquet": "parquet",
    "application/x-npz": "npz",
    "application/zip": "zip",
    "application/gzip": "csv.gz",
    "application/zstd": "csv.zst",
}


def media_type(request: Request) -> str:
    """The body's media type without its parameters, lower case."""
    return request.headers.get("content-type", "").partition(";")[0].strip().lower()


def is_json(request: Request) -> bool:
    """Whether the body says that it is JSON."""
    kind = media_type(request)
    return kind == "application/json" or (kind.startswith("application/") and kind.endswith("+json"))


def filename(request: Request, given: str | None, stem: str) -> str:
    """The name given, else one that tells the format which the media type names."""
    return given or f"{stem}.{_SUFFIXES.get(media_type(request), 'csv')}"


def body_of(*types: str, model: str | None = None, extra: Mapping[str, Any] | None = None) -> dict[str, Any]:
    """For a route's `openapi_extra`: what its body may be."""
    content: dict[str, Any] = {kind: {"schema": {"type": "string", "format": "binary"}} for kind in types}
    content |= extra or {}
    if model is not None:
        content["application/json"] = {"schema": {"$ref": f"#/components/schemas/{model}"}}
    return {"requestBody": {"required": True, "content": content}}


def parsed(model: type[M], content: bytes) -> M:
    """Parse JSON as FastAPI would.

    Raises
    ------
    RequestValidationError
        With places that begin with ``body``.
    """
    try:
        return model.model_validate(json.loads(content))
    except ValidationError as error:
        raise refused_as("body", error) from None
    except (ValueError, RecursionError) as error:
        what, place = getattr(error, "msg", "it cannot be decoded"), getattr(error, "pos", 0)
        raise RequestValidationError(
            [{"type": "json_invalid", "loc": ("body", place), "ctx": {"error": what}}]
        ) from None


def refused_as(where: str, error: ValidationError) -> RequestValidationError:
    """A model's complaint, with the part of the request that it is about."""
    return RequestValidationError([{**item, "loc": (where, *item["loc"])} for item in error.errors()])


def missing(*parameters: str) -> RequestValidationError:
    """Parts of the query that this kind of body needs."""
    return RequestValidationError([{"type": "missing", "loc": ("query", name)} for name in parameters])


async def _whole(request: Request) -> bytes:
    return await request.body()


WholeBody = Annotated[bytes, Depends(_whole)]
"""The body in memory; the middleware keeps it small."""


async def write(request: Request, path: Path) -> None:
    """Write the body to a file as it comes, a piece at a time."""
    with path.open("wb") as file:
        async for piece in request.stream():
            await run_in_threadpool(file.write, piece)


async def _streamed(request: Request) -> AsyncIterator[Path]:
    """Write the body to a file as it comes; the file is gone after the answer."""
    lab: Lab = request.app.state.lab
    request.state.body_budget.limit = min(LARGEST_RECORD, lab.settings.upload_limit_bytes)
    handle, name = await run_in_threadpool(tempfile.mkstemp, dir=lab.settings.uploads, prefix="body-")
    os.close(handle)
    try:
        await write(request, Path(name))
        yield Path(name)
    finally:
        await run_in_threadpool(Path(name).unlink, missing_ok=True)


StreamedBody = Annotated[Path, Depends(_streamed)]
"""The body in a file of its own; never in memory as a whole."""
