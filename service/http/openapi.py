"""What OpenAPI says beyond what the routes say by themselves."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from fastapi import FastAPI
from pydantic import BaseModel

from service.ground.request import GroundIn
from service.http.problem_answer import Problem
from service.live.request import DetectionIn, DetectorIn, EpochsIn
from service.probes.request import ProbeIn, ProfilesIn
from service.products.product import Product

__all__ = ["describe", "tags_of"]

GROUND = [{"name": "DEMs", "description": "The ground: uploaded once, used by every calculation."}]
OTHERS = [
    {"name": "Probes", "description": "Places and profiles on a DEM, answered at once and kept nowhere."},
    {
        "name": "Detectors",
        "description": "Which ranges lie, live: by epoch, or as a session. A session is also a WebSocket at "
        "`/detectors/{detector_id}/stream`, which OpenAPI cannot describe: an epoch (`EpochIn`) per text message, its "
        "answer (`EpochOut`) back, in order; `?watch=true` sends every answer of the session.",
    },
    {"name": "Health", "description": "How the service is."},
    {"name": "Problems", "description": "What the errors mean."},
]
# what routes read and write without the framework's knowledge
# bodies that routes read unparsed, beside those of the products
OTHER_BODIES = (GroundIn, ProbeIn, ProfilesIn, DetectionIn, DetectorIn, EpochsIn)
# Where the framework adds its own 422 nothing can fail: parameters are words, and every word is a valid one.
FRAMEWORK_SCHEMAS = ("HTTPValidationError", "ValidationError")
TEMPLATE = "#/components/schemas/{model}"


def tags_of(products: Iterable[Product]) -> list[dict[str, str]]:
    """The groups of operations, in the order of the documents."""
    return [*GROUND, *({"name": product.tag, "description": product.summary} for product in products), *OTHERS]


def describe(app: FastAPI, bodies: Iterable[type[BaseModel]]) -> None:
    """Add to the app's OpenAPI the bodies that routes read unparsed, and the shape of problems.

    The latter in place of the framework's own validation errors.
    """
    models: tuple[type[BaseModel], ...] = (Problem, *bodies, *OTHER_BODIES)
    generated = app.openapi

    def described() -> dict[str, Any]:
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


def _drop_framework_answers(responses: dict[str, Any]) -> None:
    for status in [status for status, answer in responses.items() if FRAMEWORK_SCHEMAS[0] in str(answer)]:
        del responses[status]
