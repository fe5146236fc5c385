"""DEMs read by workers and kept: each once, by its id; tiles joined; ground that takes long followed meanwhile."""

from __future__ import annotations

import hashlib
import json
import time
import uuid
from collections.abc import Callable, Mapping
from pathlib import PurePath
from typing import cast

from fastapi import Request, Response
from fastapi.responses import JSONResponse
from pydantic import JsonValue

from service.access.callers import acting_tenant
from service.errors import RequestError
from service.jobs.channel import BodyArguments, ReadDemArguments, ReadingOptions
from service.jobs.dem_tasks import ReadTilesArguments
from service.jobs.folder import move_into_place
from service.jobs.marker import write_owner
from service.jobs.pool import Lane
from service.jobs.process import to_its_end
from service.jobs.records import DemRecord
from service.jobs.recovery import note_dem

from .bodies import Upload, receive, receive_files
from .context import Service
from .dem_answers import DemUnderWay
from .grounds import GroundUnderWay
from .jobs import RETRY_AFTER_S

__all__ = ["MOST_TILES", "dem_id_of", "dem_of_files", "ground_of_library", "keep_dem", "under_way_answer"]

MOST_TILES = 100


async def dem_of_files(
    request: Request, service: Service, filename: str | None, options: ReadingOptions
) -> tuple[DemRecord, bool]:
    """The DEM of a request's file, or of several that are its tiles, and whether it is new. Raises RequestError."""
    settings = service.settings
    service.supervisor.space.refuse_when_low()
    files = receive_files(request, service, settings.max_upload_bytes, "max_upload_bytes", filename, most=MOST_TILES)
    async with files as uploads:
        if len(uploads) > 1:
            return await _joined(service, uploads, told=bool(options) or filename is not None)
        (upload,) = uploads
        dem_id = dem_id_of("file", upload.sha256, _read_by(upload), json.dumps(options, sort_keys=True))
        arguments = ReadDemArguments(path=str(upload.path), options=options)
        return await keep_dem(service, dem_id, upload.name, "read-dem", arguments, upload.size_bytes)


async def _joined(service: Service, tiles: tuple[Upload, ...], *, told: bool) -> tuple[DemRecord, bool]:
    if told:
        raise RequestError("Several files are joined as they are; leave out filename and reading options.")
    # of equally fine tiles the first by name gives what two hold, so names are part of what they are
    ordered = sorted(tiles, key=lambda tile: (tile.name, tile.sha256))
    dem_id = dem_id_of("tiles", *(part for tile in ordered for part in (tile.name, tile.sha256)))
    arguments = ReadTilesArguments(paths=[str(tile.path) for tile in ordered])
    size_bytes = sum(tile.size_bytes for tile in ordered)
    return await keep_dem(service, dem_id, "tiles", "read-tiles", arguments, size_bytes)


def _read_by(upload: Upload) -> str:
    """What of a file's name decides how it is read: its suffix the format, and for .hgt the name itself the place."""
    suffix = PurePath(upload.name).suffix.lower()
    return upload.name.lower() if suffix == ".hgt" else suffix


async def ground_of_library(
    request: Request, response: Response, service: Service, wait_s: float | None
) -> tuple[DemRecord, bool] | Response:
    """The DEM of a request for ground and whether it is new; 202 while it is made, after the wait asked for."""
    limit = service.settings.max_json_bytes
    async with receive(request, service, limit, "max_json_bytes", "body.json") as body:
        planned = await service.checks.ask("plan-ground", BodyArguments(path=str(body.path)))
    named, takes_long = str(planned["dem_id"]), bool(planned["takes_long"])
    dem_id, known = await known_dem(service, named)
    if known is not None:
        return known, False
    lane = Lane.CALCULATIONS if takes_long else Lane.FILES
    service.supervisor.refuse_requests(lane)
    await _refuse_when_full(service)

    async def make(tell: Callable[[float], None]) -> DemRecord:
        dem, _ = await keep_dem(service, named, "ground", "read-ground", planned, None, lane, tell)
        return dem

    under_way = service.grounds.begin(dem_id, make)
    if wait_s is not None:
        response.headers["Preference-Applied"] = f"wait={wait_s:g}"
    dem = await under_way.wait(0.0 if wait_s is None and takes_long else wait_s)
    return under_way_answer(under_way, dict(response.headers)) if dem is None else (dem, True)


def under_way_answer(ground: GroundUnderWay, headers: Mapping[str, str] | None = None) -> Response:
    """202 and how it stands."""
    kept = {name: value for name, value in (headers or {}).items() if name not in ("content-length", "content-type")}
    told = {**kept, "Location": f"/dems/{ground.dem_id}", "Retry-After": str(RETRY_AFTER_S)}
    return JSONResponse(DemUnderWay.of(ground).model_dump(mode="json"), 202, told)


async def known_dem(service: Service, named: str) -> tuple[str, DemRecord | None]:
    """The acting tenant's own id of what has this one by its content, and the DEM where its files are there.

    They may have been lost; then they are read again.
    """
    dem_id = await service.supervisor.in_store(service.store.own_id, named)
    known = await service.supervisor.in_store(service.store.dem_or_none, dem_id)
    return dem_id, known if known is not None and service.folder.dem(dem_id).is_dir() else None


async def keep_dem(
    service: Service,
    named: str,
    name: str,
    task: str,
    arguments: Mapping[str, object],
    file_bytes: int | None,
    lane: Lane = Lane.FILES,
    on_progress: Callable[[float], None] | None = None,
) -> tuple[DemRecord, bool]:
    """The DEM that has this id by its content, read now unless it is there already, and whether it is new."""
    dem_id, known = await known_dem(service, named)
    if known is not None:
        return known, False
    await _refuse_when_full(service)
    token = uuid.uuid4().hex
    summary = dict(
        cast(Mapping[str, JsonValue], await service.supervisor.ask(task, arguments, token, lane, on_progress))
    )
    called = str(summary.pop("name", name))
    dem = DemRecord(dem_id, called, time.time(), {**summary, "file_bytes": file_bytes}, acting_tenant())

    def keep() -> None:
        write_owner(service.folder.work(token), service.store.salt(dem.tenant))
        move_into_place(service.folder.work(token), service.folder.dem(dem_id))
        service.store.add_dem(dem)
        note_dem(service.store, service.folder, dem_id)

    # a DEM is a DEM, also when it is ended this very moment
    await to_its_end(service.supervisor.in_store(keep))
    return await service.supervisor.in_store(service.store.dem, dem_id), True


async def _refuse_when_full(service: Service) -> None:
    service.supervisor.space.refuse_when_low()
    await service.supervisor.in_store(service.supervisor.quotas.refuse_storage)


def dem_id_of(*parts: str) -> str:
    """The id of a DEM that these words name: what kind, which bytes, how they are read."""
    return hashlib.sha256("\0".join(parts).encode("utf-8", "surrogatepass")).hexdigest()[:32]
