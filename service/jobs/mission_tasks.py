"""What worker processes do with missions and files of other programs: read them, and write the files of a mission."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import TypedDict, cast
from zipfile import is_zipfile

from service.live.log_answers import range_log_of
from service.missions.bundle import sheet_of, unpack
from service.missions.document import MissionIn
from service.missions.files import MISSION_FILES
from service.missions.importing import import_places
from service.missions.shelf import Sheet

from .channel import BodyArguments, body_in, model_of
from .dem_tasks import TaskContext
from .folder import make_durable

__all__ = [
    "MissionFileArguments",
    "OpenedMission",
    "PlacesArguments",
    "RangeLogArguments",
    "SheetFields",
    "open_mission",
    "read_mission",
    "read_places",
    "read_range_log",
    "sheet_in",
    "write_mission_file",
]


class SheetFields(TypedDict):
    """A ``Sheet``, ready for JSON."""

    document: str
    name: str
    anchors: int
    dem_sha256: str | None
    ground: str | None


class OpenedMission(SheetFields):
    """A mission out of a file; dem_path: where its DEM lies that came along."""

    dem_path: str | None


class MissionFileArguments(TypedDict):
    """A file of a mission to write; dem_id: its DEM, None where there is none."""

    file: str
    document: str
    dem_id: str | None


class PlacesArguments(TypedDict):
    """A file of places to bring onto a DEM."""

    path: str
    dem_id: str


class RangeLogArguments(TypedDict):
    """A range log to read; anchor_ids: of the anchors that are known. epoch_s: how rows of tables belong together."""

    path: str
    anchor_ids: list[str]
    epoch_s: float


def read_mission(context: TaskContext, arguments: BodyArguments) -> SheetFields:
    """Read a body. Raises NotJsonError, NotValidError."""
    return _fields(_sheet(body_in(arguments)))


def open_mission(context: TaskContext, arguments: BodyArguments) -> OpenedMission:
    """Read a mission's file, JSON or zip. Raises NotJsonError, NotValidError, RequestError, LimitError."""
    path, settings = Path(arguments["path"]), context.settings
    if not is_zipfile(path):
        return {**_fields(_sheet(path.read_bytes())), "dem_path": None}
    text, dem = unpack(
        path,
        context.work,
        max_mission_bytes=settings.max_mission_bytes,
        max_dem_bytes=settings.max_upload_bytes,
    )
    return {**_fields(_sheet(text)), "dem_path": None if dem is None else str(dem)}


def write_mission_file(context: TaskContext, arguments: MissionFileArguments) -> Mapping[str, object]:
    """Write a file of a mission into the work folder. Raises NotFoundError, NotReadyError, what the writer raises."""
    dem_id = arguments["dem_id"]
    mission = MissionIn.model_validate_json(arguments["document"])
    context.work.mkdir(parents=True)
    file = MISSION_FILES[arguments["file"]]
    file.save(mission, None if dem_id is None else context.grid(dem_id), context.work / file.name)
    make_durable(context.work)
    return {}


def read_places(context: TaskContext, arguments: PlacesArguments) -> Mapping[str, object]:
    """Places of a file on a DEM. Raises NotFoundError, and what ``import_places`` raises."""
    return {"json": import_places(Path(arguments["path"]), context.grid(arguments["dem_id"])).model_dump_json()}


def read_range_log(context: TaskContext, arguments: RangeLogArguments) -> Mapping[str, object]:
    """The epochs of a log. Raises RequestError."""
    found = range_log_of(Path(arguments["path"]), arguments["anchor_ids"], arguments["epoch_s"])
    return {"json": found.model_dump_json()}


def sheet_in(fields: Mapping[str, object]) -> Sheet:
    """The sheet that a worker told."""
    told = cast(SheetFields, fields)
    return Sheet(told["document"], told["name"], told["anchors"], told["dem_sha256"], told["ground"])


def _sheet(data: str | bytes) -> Sheet:
    return sheet_of(model_of(MissionIn, data, lambda fields: None))


def _fields(sheet: Sheet) -> SheetFields:
    return cast(SheetFields, asdict(sheet))
