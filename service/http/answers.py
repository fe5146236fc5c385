"""What HTTP answers with: problems, jobs, and the models of each product's answers."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from datetime import UTC, datetime
from functools import cache
from types import GenericAlias
from typing import Annotated, Any, TypeVar, cast

from pydantic import BaseModel, ConfigDict, Field, JsonValue, create_model

from service.jobs.records import JobStatus
from service.parts.map_facts import DEM_ID, MapSummary
from service.products import Product

from .lists import Page

__all__ = [
    "FieldProblem",
    "JobOut",
    "LayerLink",
    "MapOut",
    "OlderResult",
    "OrOlder",
    "Problem",
    "ProblemType",
    "answer_models",
    "list_model",
    "list_name",
    "moment",
    "or_older",
    "out_model",
    "out_name",
    "state_model",
    "state_name",
]

Summary = TypeVar("Summary", bound=BaseModel)
Model = TypeVar("Model", bound=BaseModel)
JOB_ID = "9b2d4c55f0c94f5c8f3d0d3d7f7e6a01"


class FieldProblem(BaseModel):
    """One thing wrong with one field of the request."""

    field: str = Field(description="Where in the request, for instance anchors[0].east_m.")
    detail: str = Field(description="What is wrong with it.")


class Problem(BaseModel):
    """What went wrong, for people (detail) and for programs (type)."""

    model_config = ConfigDict(
        extra="allow",
        json_schema_extra={
            "examples": [
                {
                    "type": "/problems/anchor",
                    "title": "An anchor cannot be used",
                    "status": 422,
                    "detail": "Anchor D1 is 12.4 m below the ground (612.4 m there); raise it or give above_ground_m.",
                    "instance": "/visibility-maps",
                }
            ]
        },
    )

    type: str = Field(description="Stable name of the kind of problem, a reference to its description.")
    title: str = Field(description="What kind of problem it is.")
    status: int = Field(description="The HTTP status.")
    detail: str = Field(description="One sentence about this very problem and what to do.")
    instance: str | None = Field(None, description="Path of the request, or of the job that failed.")
    errors: list[FieldProblem] | None = Field(None, description="Every field that is wrong, when fields are.")


class ProblemType(BaseModel):
    """A kind of problem."""

    model_config = ConfigDict(
        json_schema_extra={
            "examples": [
                {
                    "type": "/problems/anchor",
                    "title": "An anchor cannot be used",
                    "status": 422,
                    "description": "An anchor cannot be used.",
                }
            ]
        }
    )

    type: str = Field(description="Stable name, as in the `type` of a problem.")
    title: str = Field(description="What kind of problem it is.")
    status: int = Field(description="The HTTP status it comes with.")
    description: str = Field(description="What it means.")


class JobOut(BaseModel):
    """How a calculation stands."""

    id: str = Field(description="Names the resource.")
    status: JobStatus = Field(
        description="queued and running are on their way; succeeded has a result; failed has a problem; cancelled was "
        "deleted before it was done; interrupted means that its worker process died more often than is tried again."
    )
    progress: float = Field(ge=0.0, le=1.0, description="Finished share, 0..1.")
    dem_id: str = Field(description="The DEM it is about.")
    created_at: datetime = Field(description="When it was asked for.")
    started_at: datetime | None = Field(description="When a worker took it last.")
    finished_at: datetime | None = Field(description="When it was over, one way or another.")
    run_s: float | None = Field(description="Seconds from start to end of the last attempt.")
    attempts: int = Field(description="How often it was started.")
    pinned: bool = Field(description="Kept for good, whatever the service's retention.")
    expires_at: datetime | None = Field(description="When it is deleted for its age; null when it is not.")
    problem: Problem | None = Field(description="Why there is no result, when it is over without one.")
    links: dict[str, str] = Field(description="Paths of what belongs to it.")


def moment(seconds: float | None) -> datetime | None:
    """A time of the store as a date in UTC."""
    return None if seconds is None else datetime.fromtimestamp(seconds, UTC)


class OlderResult(BaseModel):
    """What an older Sightline stored; fields that were added since are missing. Ask again for a result with all."""

    model_config = ConfigDict(extra="allow")

    version: str = Field(description="Version of Sightline that calculated it.")


# left to right, because any result would do as an older one
OrOlder = Annotated[Summary | OlderResult | None, Field(union_mode="left_to_right")]


def or_older(answer: Any) -> Any:
    """The type of a field for an answer whose model is known at run time only."""
    return cast(Any, OrOlder)[answer]


class LayerLink(BaseModel):
    """A file that the map can be downloaded as."""

    name: str = Field(description="File name of the layer.")
    href: str = Field(description="Path to download it from.")
    media_type: str = Field(description="Its type.")
    description: str = Field(description="What it holds, with units.")


class MapOut(JobOut):
    """A map: how its calculation stands, and its result when it has one."""

    request: dict[str, JsonValue] = Field(
        description="What was asked, defaults filled in. A field longer than 16 KiB of JSON is left out here and in "
        "the result's parameters; links.request has it whole."
    )
    result: OrOlder[MapSummary] = Field(description="What the map says; null until it succeeded.")
    layers: list[LayerLink] = Field(description="What can be downloaded; empty until it succeeded.")


def running_example(path: str, request: dict[str, JsonValue]) -> dict[str, JsonValue]:
    """A map that is being calculated, as an example for OpenAPI."""
    return {
        "id": JOB_ID,
        "status": "running",
        "progress": 0.45,
        "dem_id": DEM_ID,
        "created_at": "2026-05-01T12:00:00Z",
        "started_at": "2026-05-01T12:00:00Z",
        "finished_at": None,
        "run_s": None,
        "attempts": 1,
        "pinned": False,
        "expires_at": None,
        "problem": None,
        "links": {
            "self": f"{path}/{JOB_ID}",
            "request": f"{path}/{JOB_ID}/request",
            "dem": f"/dems/{DEM_ID}",
        },
        "request": request,
        "result": None,
        "layers": [],
    }


def answer_models(products: Iterable[Product]) -> list[type[BaseModel]]:
    """Models of all answers of products; to make them takes a second, which no start waits for."""
    return [model(product) for product in products for model in (out_model, state_model, list_model)]


def out_name(product: Product) -> str:
    """What ``out_model`` is called."""
    return f"{product.model}Out"


def state_name(product: Product) -> str:
    """What ``state_model`` is called."""
    return out_name(product) if product.inline is None else f"{product.model}State"


def list_name(product: Product) -> str:
    """What ``list_model`` is called."""
    return f"{product.model}List"


@cache
def state_model(product: Product) -> type[MapOut]:
    """How a calculation stands, and its result; what is long is left out."""
    result = or_older(product.answer), Field(description="What came out; null until it succeeded.")
    files = list[str], Field(description="The same as layers, under their older paths.")
    model = _made(
        state_name(product),
        f"How the calculation of {product.title} stands, and its result when there is one.",
        MapOut,
        {"result": result} if product.inline is None else {"result": result, "files": files},
    )
    if product.example:
        example = running_example(product.path, dict(product.example))
        model.model_config["json_schema_extra"] = {
            "examples": [{**example, "files": []} if product.inline else example]
        }
    return model


@cache
def out_model(product: Product) -> type[MapOut]:
    """The same with what is long."""
    if product.inline is None:
        return state_model(product)
    inline = product.inline
    return _made(
        out_name(product),
        f"How {product.title} stand, with every one of the {inline.name}.",
        state_model(product),
        {inline.name: (_list_of(inline.model) | None, Field(description=inline.description))},
    )


@cache
def list_model(product: Product) -> type[Page]:
    """One page of them, newest first, without what was asked and what came out."""
    return _made(
        list_name(product),
        f"One page of {product.plural.replace('_', ' ')}, newest first; each tells in links where the whole is.",
        Page,
        {product.plural: (_list_of(JobOut), ...)},
    )


def _made(name: str, doc: str, base: type[Model], fields: Mapping[str, Any]) -> type[Model]:
    """A model made at run time. fields: (type, what pydantic is told of it) by name."""
    return create_model(name, __doc__=doc, __base__=base, **fields)


def _list_of(model: Any) -> Any:
    """The type of lists of a model that is made at run time."""
    return GenericAlias(list, (model,))
