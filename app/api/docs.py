"""Pages for people who write programs against the API: the OpenAPI document, readable without script."""

import json
from collections.abc import Iterator, Mapping
from functools import cache
from pathlib import Path
from typing import Any, Final

import jinja2
from fastapi import APIRouter, Request
from fastapi.responses import HTMLResponse, RedirectResponse

from app.api import links

router = APIRouter(include_in_schema=False)

KINDS: Final = {
    "bad-request": "The body is not JSON, or cannot be read at all.",
    "unauthenticated": "No token came, or it is unknown, expired or revoked.",
    "forbidden": "The token is known, but its scopes do not reach.",
    "not-found": "Something named in the address or the body is not there.",
    "method-not-allowed": "The address exists, but takes other methods.",
    "conflict": "The request contradicts what is there: a name that is taken, a key used for something else.",
    "content-too-large": "The body is larger than this address takes.",
    "unsupported-media-type": "The address takes JSON, and something else came.",
    "invalid": "Fields, parameters or rows of a file cannot be used; each is named with its place.",
    "job-failed": "Work in the background ended without a result; it stands in the job's field error.",
    "internal": "Something went wrong on our side.",
}
"""Every kind of problem, by the anchor that its `type` leads to."""

_TEMPLATES: Final = Path(__file__).parents[2] / "templates"
Json = Mapping[str, Any]


@router.get("/")
def root() -> RedirectResponse:
    """Whoever comes to the root wants to know what there is."""
    return RedirectResponse(f"{links.ROOT}/docs")


@router.get("/docs", response_class=HTMLResponse)
def page(request: Request) -> HTMLResponse:
    """Every call with its parameters, bodies and answers."""
    document = request.app.openapi()
    groups: dict[str, list[Json]] = {}
    for operation in _operations(document):
        groups.setdefault(operation["tag"], []).append(operation)
    return HTMLResponse(_template().render(document=document, groups=groups, kinds=KINDS, root=links.ROOT))


@cache
def _template() -> jinja2.Template:
    environment = jinja2.Environment(
        loader=jinja2.FileSystemLoader(_TEMPLATES), autoescape=True, undefined=jinja2.StrictUndefined,
        trim_blocks=True, lstrip_blocks=True,
    )  # fmt: skip
    return environment.get_template("api/docs.html")


def _operations(document: Json) -> Iterator[Json]:
    for path, methods in document["paths"].items():
        for method, operation in methods.items():
            responses = operation["responses"]
            yield {
                "tag": operation["tags"][0],
                "anchor": operation["operationId"],
                "method": method.upper(),
                "short": path,
                "text": operation.get("description", ""),
                "parameters": [_parameter(item) for item in operation.get("parameters", [])],
                "bodies": list(_bodies(operation.get("requestBody", {}), document)),
                "answers": [
                    (status, answer["description"], _answered(answer))
                    for status, answer in responses.items()
                    if status < "400"
                ],
                "problems": sorted(status for status in responses if status >= "400"),
            }


def _parameter(item: Json) -> tuple[str, ...]:
    schema, required = item["schema"], item.get("required", False)
    text = item.get("description") or schema.get("description", "")
    return item["name"], item["in"], _kind(schema), _yes(required), text


def _bodies(body: Json, document: Json) -> Iterator[Json]:
    for media_type, content in body.get("content", {}).items():
        schema = content.get("schema", {})
        if "$ref" in schema:
            schema = document["components"]["schemas"][_name(schema)]
        required = schema.get("required", [])
        fields = [
            (name, _kind(field), _yes(name in required), field.get("description", ""))
            for name, field in schema.get("properties", {}).items()
        ]
        examples = [json.dumps(item, ensure_ascii=False, indent=2) for item in schema.get("examples", [])]
        yield {"media_type": media_type, "fields": fields, "examples": examples}


def _yes(is_so: bool) -> str:
    return "yes" if is_so else "no"


def _answered(answer: Json) -> str:
    return ", ".join(
        f"{media_type} {_kind(content['schema'])}" if "schema" in content else media_type
        for media_type, content in answer.get("content", {}).items()
    )


def _kind(schema: Json) -> str:
    """A schema in a few words: ``number or null``, ``list of Position``, ``one of both, paper``."""
    if "$ref" in schema:
        return _shown_name(schema)
    if "anyOf" in schema:
        return " or ".join(_kind(item) for item in schema["anyOf"])
    if "enum" in schema:
        return "one of " + ", ".join(map(str, schema["enum"]))
    if schema.get("type") == "array":
        return f"list of {_kind(schema['items'])}"
    named = {"date-time": "time", "date": "day", "binary": "file"}.get(schema.get("format", ""))
    return named or str(schema.get("type", "anything"))


def _name(schema: Json) -> str:
    return str(schema["$ref"]).rsplit("/", 1)[-1]


def _shown_name(schema: Json) -> str:
    """`Listing_Gyro_` is what a generic model is called."""
    name, of, item = _name(schema).partition("Listing_")
    return f"list of {item.rstrip('_')}" if of else name
