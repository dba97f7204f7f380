"""The API described: what FastAPI knows of it, and every refusal as the problem document that it is."""

from typing import Any, Final

from fastapi import FastAPI
from fastapi.openapi.utils import get_openapi
from pydantic.json_schema import models_json_schema

from app.api.problems import MEDIA_TYPE
from app.api.schemas.equipment import NewCertificate
from app.api.schemas.jobs import ProblemDocument

TEMPLATE: Final = "#/components/schemas/{model}"
_METHODS: Final = frozenset({"get", "put", "post", "patch", "delete"})
_WITH_BODY: Final = {
    "400": "The body is not JSON.",
    "413": "The body is too large.",
    "415": "The body is of another kind.",
}
_ALWAYS: Final = {
    "401": "No token, or one that is not valid.",
    "403": "The token's scopes do not reach.",
    "422": "Something in the request cannot be used; each place is named.",
}
_DONE: Final = {"200": "Here it is.", "201": "It was made.", "202": "It was put in the queue."}
_WORDS: Final = {
    "404": "There is no such thing.",
    "409": "It contradicts what is there.",
    **_WITH_BODY,
    **_ALWAYS,
}


def describe(app: FastAPI) -> dict[str, Any]:
    """The OpenAPI document, made once."""
    if app.openapi_schema is None:
        app.openapi_schema = _described(app)
    return app.openapi_schema


def _described(app: FastAPI) -> dict[str, Any]:
    document = get_openapi(
        title=app.title, version=app.version, description=app.description, routes=app.routes,
        tags=app.openapi_tags, servers=app.servers,
    )  # fmt: skip
    models = [(ProblemDocument, "serialization"), (NewCertificate, "validation")]
    _, extra = models_json_schema(models, ref_template=TEMPLATE)  # type: ignore[arg-type]
    schemas = document["components"]["schemas"]
    schemas |= {name: schema for name, schema in extra["$defs"].items() if name not in schemas}
    for unused in ("HTTPValidationError", "ValidationError"):
        schemas.pop(unused, None)
    for path in document["paths"].values():
        for method, operation in path.items():
            if method in _METHODS:
                _successes(operation)
                _refusals(operation)
    return document


def _successes(operation: dict[str, Any]) -> None:
    for status, answer in operation["responses"].items():
        if answer["description"] == "Successful Response":
            answer["description"] = _DONE[status]


def _refusals(operation: dict[str, Any]) -> None:
    responses: dict[str, Any] = operation["responses"]
    wanted = set(_ALWAYS) | (set(_WITH_BODY) if "requestBody" in operation else set())
    wanted |= {status for status in responses if status >= "400"}
    for status in sorted(wanted):
        responses[status] = {
            "description": _WORDS[status],
            "content": {MEDIA_TYPE: {"schema": {"$ref": TEMPLATE.format(model="ProblemDocument")}}},
        }
