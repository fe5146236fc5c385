"""The service about itself: what OpenAPI says of every route, and what a problem's `type` means."""

from __future__ import annotations

import asyncio
import re
from collections.abc import Callable, Iterable, MutableMapping
from http import HTTPStatus
from typing import Any

import orjson
from fastapi import FastAPI, Request, Response
from pydantic import BaseModel, JsonValue
from pydantic.json_schema import JsonSchemaMode, models_json_schema

from service.access.callers import ROOT
from service.access.gate import is_open
from service.access.logins import COOKIE
from service.errors import NotFoundError
from service.ground.request import GroundIn
from service.live.request import DetectionIn, DetectorIn, EpochsIn
from service.missions.document import MissionIn
from service.probes.canopy_fits import CanopyFitIn
from service.probes.replans import ReplanIn
from service.probes.request import PreviewIn, ProbeIn, ProfilesIn
from service.products import Product

from .answers import Problem, ProblemType, answer_models
from .guard.routing import Router
from .problem_kinds import FRAMEWORK_KINDS, METHOD, PROBLEMS
from .problems import MEDIA_TYPE

__all__ = [
    "FILE_BODY",
    "KNOWN",
    "LOCATION",
    "PART",
    "Document",
    "Responses",
    "answer_like",
    "body_of",
    "describe",
    "problem_responses",
    "problem_routes",
    "tags_of",
]

LOCATION = {"Location": {"description": "Path of the resource.", "schema": {"type": "string"}}}
KNOWN: dict[str, JsonValue] = {"description": "You have it already (If-None-Match)."}
PART: dict[str, JsonValue] = {"description": "The bytes that the header Range names."}
Json = dict[str, Any]  # JSON of OpenAPI: the type is FastAPI's own
# how FastAPI is told of the responses of a route, by status
Responses = dict[int | str, dict[str, Any]]  # JSON of OpenAPI and classes: the type is FastAPI's own
GROUND = [{"name": "DEMs", "description": "The ground: uploaded once, used by every calculation."}]
OTHERS = [
    {
        "name": "Missions",
        "description": "What a planner decides, kept with its versions, shared as a link or as a file.",
    },
    {"name": "Probes", "description": "Places, profiles, previews and canopies, answered at once and kept nowhere."},
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
OTHER_BODIES = (
    CanopyFitIn, DetectionIn, DetectorIn, EpochsIn, GroundIn, MissionIn, PreviewIn, ProbeIn, ProfilesIn,
    ReplanIn,
)  # fmt: skip
# Where the framework adds its own 422 nothing can fail: parameters are words, and every word is a valid one.
FRAMEWORK_SCHEMAS = ("HTTPValidationError", "ValidationError")
# a key is demanded of everybody but on loopback, where a service may have none
SECURITY_SCHEMES = {
    "key": {
        "type": "http",
        "scheme": "bearer",
        "description": "An API key, as `sightline keys add` shows it, or a token of the operator's identity provider. "
        "`GET` needs the scope read, all else calculate.",
    },
    "login": {"type": "apiKey", "in": "cookie", "name": COOKIE, "description": "The login of the page, at `/login`."},
}
TEMPLATE = "#/components/schemas/{model}"
ITS_ID = "$response.body#/id"
problem_routes = Router(prefix="/problems", tags=["Problems"])
DOCUMENTED = [*((kind, error.__doc__) for error, kind in PROBLEMS.items()), (METHOD, "Another method is needed.")]
TYPES = {
    kind.name: ProblemType(
        type=f"/problems/{kind.name}", title=kind.title, status=kind.status, description=(words or kind.title).strip()
    )
    for kind, words in DOCUMENTED
}


def problem_responses(*statuses: int) -> Responses:
    """OpenAPI responses for these statuses and for what may happen everywhere, each a problem of some kinds."""
    return {status: _response(status) for status in sorted({*statuses, 401, 403, 422, 500, 503})}


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


FILE_BODY = {
    "requestBody": {
        "required": True,
        "description": "The file, as a form or as it is.",
        "content": {
            "multipart/form-data": {
                "schema": {
                    "type": "object",
                    "properties": {"file": {"type": "string", "format": "binary"}},
                    "required": ["file"],
                }
            },
            "application/octet-stream": {"schema": {"type": "string", "format": "binary"}},
        },
    }
}


def body_of(model: type[BaseModel]) -> dict[str, JsonValue]:
    """How OpenAPI documents a body that is read here."""
    return {"requestBody": {"required": True, **answer_like(model.__name__)}}


def answer_like(model: str) -> dict[str, JsonValue]:
    """How OpenAPI documents JSON of a model, by its name: it is made when the document is, not before."""
    return {"content": {"application/json": {"schema": {"$ref": TEMPLATE.format(model=model)}}}}


def tags_of(products: Iterable[Product]) -> list[dict[str, str]]:
    """The groups of operations, in the order of the documents."""
    return [*GROUND, *({"name": product.tag, "description": product.summary} for product in products), *OTHERS]


class Document:
    """The document of OpenAPI: made once, in a thread, for it takes a second in which nobody else would be answered."""

    def __init__(self, described: Callable[[], Json]) -> None:
        self._described = described
        self._made: Json | None = None
        self._making: asyncio.Task[Json] | None = None
        self._written: dict[str, bytes] = {}

    async def made(self) -> Json:
        """The document as it is without a proxy."""
        if self._made is None:
            if self._making is None:
                self._making = asyncio.create_task(asyncio.to_thread(self._described))
                self._making.add_done_callback(self._is_made)
            return await asyncio.shield(self._making)
        return self._made

    async def written(self, root: str) -> bytes:
        """Its JSON under a path of a proxy; long, and therefore written once."""
        if root not in self._written:
            self._written[root] = orjson.dumps(await self.made() | ({"servers": [{"url": root}]} if root else {}))
        return self._written[root]

    def _is_made(self, task: asyncio.Task[Json]) -> None:
        self._making = None
        if not task.cancelled() and task.exception() is None:
            self._made = task.result()


def describe(app: FastAPI, products: Iterable[Product]) -> Document:
    """Add to the app's OpenAPI the bodies and answers of products, and the shape of problems.

    The latter in place of the framework's own validation errors.
    """
    bodies: tuple[type[BaseModel], ...] = (Problem, *(product.asked for product in products), *OTHER_BODIES)
    generated = app.openapi

    def described() -> Json:
        if app.openapi_schema is None:
            schema = generated()
            schemas = schema.setdefault("components", {}).setdefault("schemas", {})
            told: list[tuple[type[BaseModel], JsonSchemaMode]] = [
                (model, "serialization") for model in answer_models(products)
            ]
            _, own = models_json_schema(told, ref_template=TEMPLATE)
            schemas.update(own.pop("$defs"))
            for model in bodies:
                own = model.model_json_schema(ref_template=TEMPLATE)
                schemas.update(own.pop("$defs", {}))
                schemas[model.__name__] = own
            for name in FRAMEWORK_SCHEMAS:
                schemas.pop(name, None)
            schema["components"]["securitySchemes"] = SECURITY_SCHEMES
            schema["security"] = [{"key": []}, {"login": []}, {}]
            for path, item in schema["paths"].items():
                for operation in item.values():
                    _drop_framework_answers(operation["responses"])
                    if is_open(path):
                        operation["security"] = []
                        for status in ("401", "403"):
                            operation["responses"].pop(status, None)
            _link(schema)
            app.openapi_schema = schema
        return app.openapi_schema

    app.openapi = described  # type: ignore[method-assign] # FastAPI has no other way
    made = Document(described)

    async def document(request: Request) -> Response:
        return Response(await made.written(ROOT.get()), media_type="application/json")

    app.add_route("/openapi.json", document, methods=["GET", "HEAD"], include_in_schema=False)
    return made


def _link(schema: Json) -> None:
    """Tell of each answer that has made something which operations go on with its id (OpenAPI's links)."""
    paths = schema["paths"]
    for path, item in paths.items():
        own = re.compile(rf"{re.escape(path)}/{{(\w+)}}(/.*)?")
        links: Json = {}
        for target, operation in ((other, operation) for other in paths for operation in paths[other].values()):
            by_path = own.fullmatch(target)
            takes = {by_path[1]: ITS_ID} if by_path else {}
            if path == "/dems" and any(one["name"] == "dem_id" for one in operation.get("parameters", ())):
                takes = takes or {"dem_id": ITS_ID}
            if takes:
                links[operation["operationId"]] = {"operationId": operation["operationId"], "parameters": takes}
            elif path == "/dems" and _takes_dem(operation, schema["components"]["schemas"]):
                body = {"dem_id": ITS_ID}
                links[operation["operationId"]] = {"operationId": operation["operationId"], "requestBody": body}
        for status, answer in item.get("post", {}).get("responses", {}).items():
            if links and status in ("200", "201", "202"):
                answer["links"] = links


def _takes_dem(operation: Json, schemas: Json) -> bool:
    content = operation.get("requestBody", {}).get("content", {})
    name = content.get("application/json", {}).get("schema", {}).get("$ref", "").rsplit("/", 1)[-1]
    return "dem_id" in schemas.get(name, {}).get("properties", {})


def _drop_framework_answers(responses: MutableMapping[str, object]) -> None:
    for status in [status for status, answer in responses.items() if FRAMEWORK_SCHEMAS[0] in str(answer)]:
        del responses[status]


@problem_routes.get("", summary="List the kinds of problems", responses=problem_responses())
async def list_problem_types() -> list[ProblemType]:
    """Every `type` that a problem may have."""
    return [TYPES[name] for name in sorted(TYPES)]


@problem_routes.get("/{name}", summary="Look up a kind of problem", responses=problem_responses(404))
async def get_problem_type(name: str) -> ProblemType:
    """What a `type` means; it is the path of this very answer."""
    if name not in TYPES:
        raise NotFoundError("kind of problem", name)
    return TYPES[name]
