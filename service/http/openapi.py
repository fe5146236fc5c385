"""What OpenAPI says beyond what the routes say by themselves."""

from __future__ import annotations

from typing import Any

from fastapi import FastAPI
from pydantic import BaseModel

from service.http.problem_answer import Problem
from service.jobs.map_requests import MAP_REQUESTS
from service.live.request import DetectionIn, DetectorIn, EpochsIn
from service.products.lines_of_sight.request import LinesOfSightIn
from service.products.safety_bubbles.request import SafetyBubblesIn

__all__ = ["TAGS", "describe"]

TAGS = [
    {"name": "DEMs", "description": "The ground: uploaded once, used by every calculation."},
    {"name": "Visibility maps", "description": "Which anchors are seen from where, over a whole DEM."},
    {"name": "DOP maps", "description": "How good positioning is for a rover, and where it is not good enough."},
    {"name": "Morphing maps", "description": "Above which altitude positioning is good enough."},
    {"name": "Paths", "description": "Which way a rover should go so that the anchors stay in sight."},
    {"name": "Flights", "description": "Which way a drone should fly above a morphing map, clear of the ground."},
    {"name": "Placements", "description": "Where to put anchors."},
    {"name": "Repositionings", "description": "Which drone moves where while a mission runs."},
    {"name": "Lines of sight", "description": "Clearance between pairs of points."},
    {
        "name": "Detectors",
        "description": "Which ranges lie, live: by epoch, or as a session. A session is also a WebSocket at "
        "`/detectors/{detector_id}/stream`, which OpenAPI cannot describe: an epoch (`EpochIn`) per text message, its "
        "answer (`EpochOut`) back, in order; `?watch=true` sends every answer of the session.",
    },
    {"name": "Safety bubbles", "description": "How surely a vehicle keeps clear of ground and buildings along a path."},
    {"name": "Health", "description": "How the service is."},
    {"name": "Problems", "description": "What the errors mean."},
]
# what routes read and write without the framework's knowledge
MODELS: tuple[type[BaseModel], ...] = (
    Problem,
    LinesOfSightIn,
    SafetyBubblesIn,
    DetectionIn,
    DetectorIn,
    EpochsIn,
    *(request.model for request in MAP_REQUESTS.values()),
)
# Where the framework adds its own 422 nothing can fail: parameters are words, and every word is a valid one.
FRAMEWORK_SCHEMAS = ("HTTPValidationError", "ValidationError")
TEMPLATE = "#/components/schemas/{model}"


def describe(app: FastAPI) -> None:
    """Add to the app's OpenAPI: the shape of problems, in place of the framework's own validation errors."""
    generated = app.openapi

    def described() -> dict[str, Any]:
        if app.openapi_schema is None:
            schema = generated()
            schemas = schema.setdefault("components", {}).setdefault("schemas", {})
            for model in MODELS:
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
