"""What OpenAPI says beyond what the routes say by themselves: problems, headers, bodies that are read here."""

from __future__ import annotations

from collections.abc import Iterable, MutableMapping
from http import HTTPStatus
from typing import Any

from fastapi import FastAPI
from pydantic import BaseModel, JsonValue

from service.live.request import DetectionIn, DetectorIn, EpochsIn
from service.products import Product

from .answers import Problem
from .problems import FRAMEWORK_KINDS, MEDIA_TYPE, PROBLEMS

__all__ = ["LOCATION", "Responses", "body_of", "describe", "problem_responses", "tags_of"]

LOCATION = {"Location": {"description": "Path of the resource.", "schema": {"type": "string"}}}
# how FastAPI is told of the responses of a route, by status
Responses = dict[int | str, dict[str, Any]]  # JSON of OpenAPI and classes: the type is FastAPI's own
GROUND = [{"name": "DEMs", "description": "The ground: uploaded once, used by every calculation."}]
OTHERS = [
    {
        "name": "Detectors",
        "description": "Which ranges lie, live: by epoch, or as a session. A session is also a WebSocket at "
        "`/detectors/{detector_id}/stream`, which OpenAPI cannot describe: an epoch (`EpochIn`) per text message, its "
        "answer (`EpochOut`) back, in order; `?watch=true` sends every answer of the session.",
    },
    {"name": "Health", "description": "How the service is."},
    {"name": "Problems", "description": "What the errors mean."},
]
# bodies that routes read unparsed, beside those of the products
OTHER_BODIES = (DetectionIn, DetectorIn, EpochsIn)
# Where the framework adds its own 422 nothing can fail: parameters are words, and every word is a valid one.
FRAMEWORK_SCHEMAS = ("HTTPValidationError", "ValidationError")
TEMPLATE = "#/components/schemas/{model}"


def problem_responses(*statuses: int) -> Responses:
    """OpenAPI responses for these statuses and for what may happen everywhere, each a problem of some kinds."""
    return {status: _response(status) for status in sorted({*statuses, 500, 503})}


def _response(status: int) -> dict[str, JsonValue]:
    kinds = {kind.name: kind for kind in (*PROBLEMS.values(), *FRAMEWORK_KINDS.values()) if kind.status == status}
    told = ", ".join(f"`/problems/{name}`" for name in sorted(kinds))
    documented: dict[str, JsonValue] = {
        "description": f"{HTTPStatus(status).phrase}: {told}.",
        "content": {
            MEDIA_TYPE: {
                "schema": {"$ref": f"#/components/schemas/{Problem.__name__}"},
            }
        },
    }
    if status == 503:
        documented["headers"] = {
            "Retry-After": {"description": "Seconds after which to try again.", "schema": {"type": "integer"}}
        }
    return documented


def body_of(model: type[BaseModel]) -> dict[str, JsonValue]:
    """How OpenAPI documents a body that is read here."""
    content: JsonValue = {"application/json": {"schema": {"$ref": f"#/components/schemas/{model.__name__}"}}}
    return {"requestBody": {"required": True, "content": content}}


def tags_of(products: Iterable[Product]) -> list[dict[str, str]]:
    """The groups of operations, in the order of the documents."""
    return [*GROUND, *({"name": product.tag, "description": product.summary} for product in products), *OTHERS]


def describe(app: FastAPI, bodies: Iterable[type[BaseModel]]) -> None:
    """Add to the app's OpenAPI the bodies that routes read unparsed, and the shape of problems.

    The latter in place of the framework's own validation errors.
    """
    models: tuple[type[BaseModel], ...] = (Problem, *bodies, *OTHER_BODIES)
    generated = app.openapi

    def described() -> dict[str, Any]:  # JSON of OpenAPI: the type is FastAPI's own
        if app.openapi_schema is None:
            schema = generated()
            schemas = schema.setdefault("components", {}).setdefault("schemas", {})
            for model in models:
                own = model.model_json_schema(ref_template=TEMPLATE)
                schemas.update(own.pop("$defs", {}))
                schemas[model.__name__] = own
            for name in FRAMEWORK_SCHEMAS:
                schemas.pop(name, None)
            for item in schema["paths"].values():
                for operation in item.values():
                    _drop_framework_answers(operation["responses"])
            app.openapi_schema = schema
        return app.openapi_schema

    app.openapi = described  # type: ignore[method-assign] # FastAPI has no other way


def _drop_framework_answers(responses: MutableMapping[str, object]) -> None:
    for status in [status for status, answer in responses.items() if FRAMEWORK_SCHEMAS[0] in str(answer)]:
        del responses[status]
