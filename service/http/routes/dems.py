"""DEMs: upload, list, look at, delete."""

from __future__ import annotations

import hashlib
import json
import math
import time
import uuid
from pathlib import PurePath
from typing import Annotated, Any, Literal

from fastapi import APIRouter, Query, Request, Response
from fastapi.responses import FileResponse

from dem_samples import sample_manifest
from service.errors import BusyError, NotFoundError, RequestError
from service.ground.levels import Levels, levels_of
from service.ground.request import GroundIn
from service.http.bodies import is_json
from service.http.context import Service, ServiceDep
from service.http.dem_answers import DemList, DemOut
from service.http.documented import LOCATION, problem_responses
from service.http.files import file_answer
from service.http.uploads import receive
from service.jobs.folder import move_into_place
from service.jobs.notes import note_dem
from service.jobs.records import DemRecord
from service.parts.pages import Limit, Offset

__all__ = ["router"]

router = APIRouter(prefix="/dems", tags=["DEMs"])

UPLOAD_BODY = {
    "requestBody": {
        "description": "The file, as a form or as it is; or in JSON the area to make a DEM of from the ground library. "
        "Not needed with `sample`.",
        "content": {
            "application/json": {"schema": {"$ref": f"#/components/schemas/{GroundIn.__name__}"}},
            "multipart/form-data": {
                "schema": {
                    "type": "object",
                    "properties": {"file": {"type": "string", "format": "binary"}},
                    "required": ["file"],
                }
            },
            "image/tiff": {"schema": {"type": "string", "format": "binary"}},
            "application/octet-stream": {"schema": {"type": "string", "format": "binary"}},
        },
    }
}


@router.post(
    "",
    status_code=201,
    summary="Upload a DEM, or ask for ground",
    responses={
        201: {"description": "The DEM was read.", "headers": LOCATION},
        200: {"description": "The same DEM was there already.", "headers": LOCATION, "model": DemOut},
        **problem_responses(400, 404, 409, 413, 422, 502, 503, 507),
    },
    openapi_extra=UPLOAD_BODY,
)
async def upload_dem(
    request: Request,
    response: Response,
    service: ServiceDep,
    filename: Annotated[
        str | None, Query(max_length=255, description="Name of the file, when the body is the bare file.")
    ] = None,
    sample: Annotated[
        str | None, Query(max_length=64, description="Take this bundled DEM instead of a file.", examples=["jacksboro"])
    ] = None,
    nodata: Annotated[
        float | None, Query(description="Value in the file that means unknown height; `nan`: no value does.")
    ] = None,
    crs: Annotated[
        str | None,
        Query(
            max_length=4000,
            description="CRS of the file's positions, for files without one; `local` for metres. A code, WKT, PROJJSON "
            "or a plain PROJ string; its vertical part, as in `EPSG:6529+6360`, tells unit and datum of the heights.",
        ),
    ] = None,
    height_unit: Annotated[
        Literal["m", "ft", "us-ft", "dm", "cm", "mm", "km"] | None,
        Query(description="Unit of the heights, in place of what the file says."),
    ] = None,
    band: Annotated[int | None, Query(ge=1, description="Band that holds the heights; without it the first.")] = None,
    cell_m: Annotated[
        float | None, Query(gt=0.0, allow_inf_nan=False, description="Metres between posts, for files without it.")
    ] = None,
) -> DemOut:
    """Read a GeoTIFF, COG, ESRI ASCII, SRTM .hgt, DTED, .npz or .npy file and keep it.

    Send the file as a multipart form (`curl -F file=@dem.tif`) or as the body (`curl --data-binary @dem.tif` with
    `?filename=dem.tif`). Geographic files are warped to metres; what was converted is told.

    With a body in JSON (`{"area": …}`) the DEM is made from the operator's ground library, see `GET /ground`: the
    finest tiles first, voids filled from the next, everything told in `conversions` and `warnings`.
    """
    # as text where JSON has no such number
    fill = str(nodata) if nodata is not None and not math.isfinite(nodata) else nodata
    given = {"nodata": fill, "crs": crs, "height_unit": height_unit, "band": band, "cell_m": cell_m}
    options = {name: value for name, value in given.items() if value is not None}
    if sample is not None:
        if options or filename is not None:
            raise RequestError("A bundled DEM is taken as it is; leave out filename and reading options.")
        if await anext(request.stream(), b""):
            raise RequestError("Send a file or name a bundled DEM with sample, not both.")
        bundled = sample_manifest(sample)
        dem_id = _id_of("sample", str(bundled["sha256"]))
        arguments = {"sample": sample, "options": {}}
        dem, is_new = await _kept(service, dem_id, str(bundled["file"]), "read-dem", arguments, None)
    elif is_json(request):
        if options or filename is not None:
            raise RequestError("Ground from the library is asked for in the body alone; leave out the query.")
        dem, is_new = await _from_library(request, service)
    else:
        dem, is_new = await _uploaded(request, service, filename, options)
    response.status_code = 201 if is_new else 200
    response.headers["Location"] = f"/dems/{dem.id}"
    return DemOut.of(dem)


@router.get("", summary="List DEMs", responses=problem_responses(422))
async def list_dems(service: ServiceDep, limit: Limit = 50, offset: Offset = 0) -> DemList:
    """DEMs, newest first."""
    dems, total = await service.supervisor.in_store(service.store.dems, limit, offset)
    return DemList(dems=[DemOut.of(dem) for dem in dems], total=total, limit=limit, offset=offset)


@router.get("/{dem_id}", summary="Look at a DEM", responses=problem_responses(404))
async def get_dem(dem_id: str, service: ServiceDep) -> DemOut:
    """What was read, what was converted, and every warning."""
    return DemOut.of(await service.supervisor.in_store(service.store.dem, dem_id))


@router.get(
    "/{dem_id}/hillshade.png",
    summary="See a DEM",
    response_class=FileResponse,
    responses={
        200: {
            "description": "The picture.",
            "content": {"image/png": {"schema": {"type": "string", "format": "binary"}}},
        },
        304: {"description": "You have it already (If-None-Match)."},
        **problem_responses(404, 416, 503, 507),
    },
)
async def get_hillshade(dem_id: str, request: Request, service: ServiceDep) -> Response:
    """Its ground lit from the north-west, from corner to corner of its cells; clear where no ground is known."""
    await service.supervisor.in_store(service.store.dem, dem_id)
    path = await service.drawings.hillshade(dem_id)
    return await file_answer(request, path, "image/png", f"{dem_id}-hillshade")


@router.get("/{dem_id}/levels", summary="See at which resolutions a DEM is there", responses=problem_responses(404))
async def get_levels(dem_id: str, service: ServiceDep) -> Levels:
    """Sizes and places of its heights at each resolution; every level has half the rows and columns of the one before.

    The coarsest has at most 256 rows and columns. A value is the mean of the known posts under it.
    """
    dem = await service.supervisor.in_store(service.store.dem, dem_id)
    return levels_of(dem.id, dem.summary)


@router.get(
    "/{dem_id}/heights",
    summary="Get the heights of a DEM as bare numbers",
    response_class=FileResponse,
    responses={
        200: {
            "description": "The array.",
            "content": {"application/octet-stream": {"schema": {"type": "string", "format": "binary"}}},
            "headers": {"ETag": {"description": "Changes when the heights do.", "schema": {"type": "string"}}},
        },
        304: {"description": "You have it already (If-None-Match)."},
        **problem_responses(404, 416, 422, 503, 507),
    },
)
async def get_heights(
    dem_id: str,
    request: Request,
    service: ServiceDep,
    level: Annotated[int, Query(ge=0, description="Resolution level, a number; 0 holds the posts themselves.")] = 0,
) -> Response:
    """Altitudes in metres: float32, little-endian, rows from the north, NaN where unknown; `/levels` tells the size.

    Ranges and If-None-Match are understood.
    """
    dem = await service.supervisor.in_store(service.store.dem, dem_id)
    levels = levels_of(dem.id, dem.summary).levels
    if level >= len(levels):
        raise NotFoundError("level", str(level), f"this DEM has levels 0 to {len(levels) - 1}")
    path = await service.drawings.level(dem_id, level)
    return await file_answer(request, path, "application/octet-stream", f"{dem.summary['sha256']}-{level}")


@router.delete("/{dem_id}", status_code=204, summary="Delete a DEM", responses=problem_responses(404, 409))
async def delete_dem(dem_id: str, service: ServiceDep) -> None:
    """Free its space. Refused (409) while jobs on it wait or run; finished results keep what they need."""

    def remove() -> None:
        service.store.remove_dem(dem_id)
        service.folder.remove(service.folder.dem(dem_id))

    await service.supervisor.in_store(remove)


async def _uploaded(
    request: Request, service: Service, filename: str | None, options: dict[str, Any]
) -> tuple[DemRecord, bool]:
    if service.uploads.locked():
        raise BusyError(
            f"{service.settings.max_uploads} uploads are under way, which is the limit; try again in a moment",
            limit_name="max_uploads",
            limit=service.settings.max_uploads,
        )
    async with (
        service.uploads,
        receive(request, service.folder, service.settings.max_upload_bytes, "max_upload_bytes", filename) as upload,
    ):
        # the name decides how a file is read: its suffix the format, and for .hgt the name itself the place
        suffix = PurePath(upload.name).suffix.lower()
        named = upload.name.lower() if suffix == ".hgt" else suffix
        dem_id = _id_of("file", upload.sha256, named, json.dumps(options, sort_keys=True))
        arguments = {"path": str(upload.path), "options": options}
        return await _kept(service, dem_id, upload.name, "read-dem", arguments, upload.size_bytes)


async def _from_library(request: Request, service: Service) -> tuple[DemRecord, bool]:
    limit = service.settings.max_json_bytes
    async with receive(request, service.folder, limit, "max_json_bytes", "body.json") as body:
        planned = await service.checks.ask("plan-ground", {"path": str(body.path)})
    return await _kept(service, planned["dem_id"], "ground", "read-ground", planned, None)


async def _kept(
    service: Service, dem_id: str, name: str, task: str, arguments: dict[str, Any], file_bytes: int | None
) -> tuple[DemRecord, bool]:
    """The DEM of that id, read now unless it is there already, and whether it is new."""
    known = await service.supervisor.in_store(service.store.dem_or_none, dem_id)
    # its files may have been lost; then they are read again
    if known is not None and service.folder.dem(dem_id).is_dir():
        return known, False
    token = uuid.uuid4().hex
    summary = await service.supervisor.ask(task, arguments, token)
    dem = DemRecord(dem_id, summary.pop("name", name), time.time(), {**summary, "file_bytes": file_bytes})

    def keep() -> DemRecord:
        move_into_place(service.folder.work(token), service.folder.dem(dem_id))
        service.store.add_dem(dem)
        note_dem(service.store, service.folder, dem_id)
        return service.store.dem(dem_id)

    return await service.supervisor.in_store(keep), True


def _id_of(*parts: str) -> str:
    return hashlib.sha256("\0".join(parts).encode("utf-8", "surrogatepass")).hexdigest()[:32]
