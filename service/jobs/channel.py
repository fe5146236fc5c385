"""What the service and a worker process say to each other, one JSON object per line; and bodies in JSON as models.

service -> worker   Start                 first, once
                    Order                 a task, its work folder and its arguments
                    Stop                  the task of that work folder may end with what it has
worker -> service   Ready                 once, when warm
                    Progress              any number
                    Done or Failed        the end of each task
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, Literal, NotRequired, TypedDict, TypeVar, final

import orjson
from pydantic import BaseModel, JsonValue, ValidationError
from pydantic_core import from_json

from service.errors import LimitError, NotJsonError, NotValidError
from service.parts.sentences import fields_of, sentence_of
from service.settings import Settings

from .records import JobRequest

__all__ = [
    "MAX_LINE_BYTES",
    "BodyArguments",
    "CalculateArguments",
    "Calculated",
    "CheckArguments",
    "Checked",
    "DemArguments",
    "Done",
    "Failed",
    "FromWorker",
    "GivenFields",
    "GroundArguments",
    "LayerArguments",
    "LevelArguments",
    "NeedsFields",
    "Order",
    "Progress",
    "ReadDemArguments",
    "ReadingOptions",
    "Ready",
    "ReplanArguments",
    "Start",
    "Stop",
    "ToWorker",
    "body_in",
    "decode",
    "encode",
    "model_of",
    "read_body",
    "validated",
]

MAX_LINE_BYTES = 64 * 1024 * 1024
Body = TypeVar("Body", bound=BaseModel)
# Lists whose length a setting limits, by where they stand; what is longer is refused before any of it is looked at.
LIMITED = {
    ("anchors",): ("max_anchors", "anchors"),
    ("tracks",): ("max_anchors", "anchors on tracks"),
    ("morphing_map", "anchors"): ("max_anchors", "anchors"),
    ("morphing_map", "tracks"): ("max_anchors", "anchors on tracks"),
    ("pairs",): ("max_pairs", "pairs"),
    ("from_points_m",): ("max_pairs", "pairs"),
    ("to_points_m",): ("max_pairs", "pairs"),
    ("points",): ("max_path_points", "points"),
    ("points_m",): ("max_path_points", "points"),
    ("times_s",): ("max_path_points", "times"),
    ("covariances_m2",): ("max_path_points", "covariances"),
}


@final
class Start(TypedDict):
    """The settings of the service; first: whether this worker compiles what no worker before it has."""

    settings: Mapping[str, JsonValue]
    first: bool


@final
class Order(TypedDict):
    """A task by name, its work folder by token, whose DEMs it may read by the tenant's salt, and what memory it has."""

    task: str
    token: str
    salt: str
    memory_bytes: int
    arguments: Mapping[str, object]


@final
class Stop(TypedDict):
    """The task of the work folder of that name is to end with what it has."""

    stop: str


@final
class Ready(TypedDict):
    """The worker is warm; later, that it has taken an order up."""

    ready: Literal[True]


@final
class Progress(TypedDict):
    """The finished share of the task, 0..1."""

    progress: float


@final
class Done(TypedDict):
    """What came of a task."""

    result: Mapping[str, object]


class FailureFields(TypedDict):
    """A ``Failure``, ready for JSON."""

    error: str
    detail: str
    data: Mapping[str, object]


@final
class Failed(TypedDict):
    """Why nothing came of a task."""

    failure: FailureFields


ToWorker = Start | Order | Stop
FromWorker = Ready | Progress | Done | Failed


class ReadingOptions(TypedDict, total=False):
    """How a DEM file is read; nodata is text where JSON has no such number."""

    nodata: float | str
    crs: str
    height_unit: str
    band: int
    cell_m: float
    resolution_m: float
    vertical_datum: str


class ReadDemArguments(TypedDict):
    """A file by its path, or a bundled DEM by its name."""

    path: NotRequired[str]
    sample: NotRequired[str]
    options: ReadingOptions


class DemArguments(TypedDict):
    """A DEM of the data folder."""

    dem_id: str


class LevelArguments(DemArguments):
    """A DEM of the data folder at a resolution level."""

    level: int


class GroundArguments(TypedDict):
    """Ground to read: the fields of the request, the id of the DEM that it means, and whether it takes long."""

    dem_id: str
    asked: Mapping[str, JsonValue]
    takes_long: bool


class BodyArguments(TypedDict, total=False):
    """The body of a request: its text, or the path of the file that it lies in because it is big."""

    body: str
    path: str


class NeedsFields(TypedDict):
    """A product's ``Needs``, ready for JSON."""

    map_id: str | None
    map_kinds: Sequence[str]
    detector_id: str | None
    persistent_s: float


class GivenFields(TypedDict, total=False):
    """A product's ``Given``, ready for JSON."""

    map_kind: str
    map_parameters: Mapping[str, JsonValue]
    occluded: Sequence[str]


class CheckArguments(TypedDict):
    """A request for a product, and what it refers to once that was found."""

    product: str
    body: BodyArguments
    given: NotRequired[GivenFields]


class Checked(TypedDict):
    """A request that was checked: what a job is asked, or what has to be found first."""

    dem_id: str
    needs: NotRequired[NeedsFields]
    request: NotRequired[JobRequest]


class CalculateArguments(JobRequest):
    """A job to calculate."""

    dem_id: str
    job_id: str


class ReplanArguments(CalculateArguments, BodyArguments):
    """A finished path, and as a body from where it is to be planned again."""


class Calculated(TypedDict):
    """A result: the digest of its files, and its answer."""

    digest: str
    summary: Mapping[str, JsonValue]


class LayerArguments(Calculated):
    """A layer to draw of a result, as the store has it."""

    layer: str


def encode(message: ToWorker | FromWorker) -> bytes:
    """One line; what is no number becomes null."""
    return orjson.dumps(message, option=orjson.OPT_APPEND_NEWLINE)


def decode(line: bytes) -> Any:
    """The message of a line, ``ToWorker`` or ``FromWorker``; raises ValueError when the line is not one."""
    message = orjson.loads(line)
    if not isinstance(message, dict):
        raise ValueError(f"A message must be an object, not {type(message).__name__}.")
    return message


def model_of(model: type[Body], data: str | bytes, refuse_long: Callable[[Any], None]) -> Body:
    """The body as a model. refuse_long: raises LimitError. Raises NotJsonError, NotValidError besides."""
    try:
        fields = from_json(data)
    except ValueError as error:
        raise NotJsonError("The body is not valid JSON.") from error
    refuse_long(fields)
    return validated(model, fields)


def validated(model: type[Body], fields: Any) -> Body:
    """The fields as a model. Raises NotValidError."""
    try:
        return model.model_validate(fields)
    except ValidationError as error:
        raise NotValidError(sentence_of(error), fields_of(error)) from error


def body_in(arguments: BodyArguments) -> str | bytes:
    """The body that came along, or that lies in a file because it is big."""
    return arguments["body"] if "body" in arguments else Path(arguments["path"]).read_bytes()


def read_body(model: type[Body], data: bytes | str, settings: Settings) -> Body:
    """The body as a model; limits come before work. Raises NotJsonError, LimitError, NotValidError."""

    def refuse_long(fields: Any) -> None:
        for place, (limit_name, what) in LIMITED.items():
            found = fields
            for name in place:
                found = found.get(name) if isinstance(found, dict) else None
            limit = getattr(settings, limit_name)
            if isinstance(found, list) and len(found) > limit:
                raise LimitError(
                    f"{len(found):,} {what} are more than the limit of {limit:,} in one request",
                    **{"limit_name": limit_name, "limit": limit, "given": len(found)},
                )

    return model_of(model, data, refuse_long)
