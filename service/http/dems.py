"""DEMs: upload or ask for, list, look at, delete; and what ground there is to ask for."""

from __future__ import annotations

import math
from typing import Annotated, Literal, cast

from fastapi import Query, Request, Response
from fastapi.responses import FileResponse, JSONResponse

from dem_samples import sample_manifest
from service.access.callers import rooted
from service.errors import NotFoundError, RequestError
from service.ground.coverage import Coverage
from service.ground.levels import Levels, levels_of
from service.ground.request import GroundIn
from service.jobs.channel import ReadDemArguments, ReadingOptions
from service.jobs.pool import Lane

from .bodies import WaitDep
from .context import ServiceDep
from .dem_answers import DemList, DemOut, DemUnderWay
from .dem_keeping import MOST_TILES, dem_id_of, dem_of_files, ground_of_library, keep_dem, under_way_answer
from .guard.routing import Router
from .jobs import file_answer
from .lists import TurnDep
from .meta import KNOWN, LOCATION, PART, problem_responses
from .problems import is_json

__all__ = ["ground", "router"]

router = Router(prefix="/dems", tags=["DEMs"])
DATUM = (
    "What heights shall count from: `msl`, `hae`, `EGM96`, or a vertical CRS as `EPSG:5703`; converted to, or taken so."
)
RESOLUTION = "Of a file with overviews the coarsest is read whose cells are no coarser, metres; without it the posts."
ground = Router(prefix="/ground", tags=["DEMs"])
UPLOAD_BODY = {
    "requestBody": {
        "description": "The file, as a form or as it is; several tiles of one DEM as one form; or in JSON the area to "
        "make a DEM of from the ground library. Not needed with `sample`.",
        "content": {
            "application/json": {"schema": {"$ref": f"#/components/schemas/{GroundIn.__name__}"}},
            "multipart/form-data": {
                "schema": {
                    "type": "object",
                    "properties": {
                        "file": {
                            "type": "array",
                            "items": {"type": "string", "format": "binary"},
                            "minItems": 1,
                            "maxItems": MOST_TILES,
                        }
                    },
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
    response_model=DemOut,
    summary="Upload a DEM, or ask for ground",
    responses={
        201: {"description": "The DEM was read.", "headers": LOCATION},
        202: {
            "description": "Ground that takes long is being made; follow Location.",
            "headers": LOCATION,
            "model": DemUnderWay,
        },
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
    band: Annotated[
        int | None, Query(ge=1, le=65_535, description="Band that holds the heights; without it the first.")
    ] = None,
    cell_m: Annotated[
        float | None, Query(gt=0.0, allow_inf_nan=False, description="Metres between posts, for files without it.")
    ] = None,
    resolution_m: Annotated[float | None, Query(gt=0.0, allow_inf_nan=False, description=RESOLUTION)] = None,
    vertical_datum: Annotated[str | None, Query(max_length=120, description=DATUM)] = None,
    wait_s: WaitDep = None,
) -> DemOut | Response:
    """Read a GeoTIFF, COG, ESRI ASCII, SRTM .hgt, DTED, .npz or .npy file and keep it.

    Send the file as a multipart form (`curl -F file=@dem.tif`) or as the body (`curl --data-binary @dem.tif` with
    `?filename=dem.tif`). Geographic files are warped to metres; what was converted is told. Several files in one form
    (`-F file=@a.hgt -F file=@b.hgt`) are tiles that are joined to one DEM, as those of the ground library are: tiles on
    one lattice post for post, coarser ones where finer are void; seams, voids and datums are told.

    With a body in JSON (`{"area": …}`) the DEM is made from the operator's ground library, see `GET /ground`: the
    finest tiles first, voids filled from the next, everything told in `conversions` and `warnings`. Many posts, or a
    remote source, take long: then the answer is 202 (after the wait that `Prefer` asks for), `GET /dems/{id}` tells the
    progress until the DEM is there, and `DELETE` ends it.
    """
    # as text where JSON has no such number
    fill = str(nodata) if nodata is not None and not math.isfinite(nodata) else nodata
    given = {"nodata": fill, "crs": crs, "height_unit": height_unit, "band": band, "cell_m": cell_m}
    given |= {"resolution_m": resolution_m, "vertical_datum": vertical_datum}
    options = cast(ReadingOptions, {name: value for name, value in given.items() if value is not None})
    if sample is not None:
        if options or filename is not None:
            raise RequestError("A bundled DEM is taken as it is; leave out filename and reading options.")
        if await anext(request.stream(), b""):
            raise RequestError("Send a file or name a bundled DEM with sample, not both.")
        bundled = sample_manifest(sample)
        dem_id = dem_id_of("sample", str(bundled["sha256"]))
        arguments = ReadDemArguments(sample=sample, options={})
        dem, is_new = await keep_dem(service, dem_id, str(bundled["file"]), "read-dem", arguments, None)
    elif is_json(request):
        if options or filename is not None:
            raise RequestError("Ground from the library is asked for in the body alone; leave out the query.")
        found = await ground_of_library(request, response, service, wait_s)
        if isinstance(found, Response):
            return found
        dem, is_new = found
    else:
        dem, is_new = await dem_of_files(request, service, filename, options)
    response.status_code = 201 if is_new else 200
    response.headers["Location"] = f"/dems/{dem.id}"
    return DemOut.of(dem)


@router.get("", summary="List DEMs", responses=problem_responses(422))
async def list_dems(service: ServiceDep, turn: TurnDep) -> DemList:
    """DEMs, newest first. `next` leads to the page after."""
    dems, total = await service.look_up(service.store.dems, turn.limit + 1, turn.offset, turn.after)
    told = [DemOut.of(dem) for dem in dems[: turn.limit]]
    following = turn.cursor([dem.place for dem in dems])
    return DemList(dems=told, total=total, limit=turn.limit, offset=turn.offset, next=following)


@router.get(
    "/{dem_id}",
    summary="Look at a DEM",
    response_model=DemOut,
    responses={
        202: {"description": "It is being made: how far it is.", "model": DemUnderWay},
        **problem_responses(404, 409, 413, 422, 502, 503, 507),
    },
)
async def get_dem(dem_id: str, service: ServiceDep) -> DemOut | Response:
    """What was read, what was converted, and every warning; of one that could not be made, why."""
    under_way = service.grounds.known(dem_id)
    if under_way is not None and not under_way.making.done():
        return under_way_answer(under_way)
    dem = await service.supervisor.in_store(service.store.dem_or_none, dem_id)
    if dem is None:
        dem = None if under_way is None or under_way.making.cancelled() else under_way.outcome()
    if dem is None:
        raise NotFoundError("DEM", dem_id)
    return DemOut.of(dem)


@router.get(
    "/{dem_id}/hillshade.png",
    summary="See a DEM",
    response_class=FileResponse,
    responses={
        200: {
            "description": "The picture.",
            "content": {"image/png": {"schema": {"type": "string", "format": "binary"}}},
            "headers": {"ETag": {"description": "Names the DEM.", "schema": {"type": "string"}}},
        },
        206: PART,
        304: KNOWN,
        **problem_responses(404, 409, 416, 503, 507),
    },
)
async def get_hillshade(dem_id: str, request: Request, service: ServiceDep) -> Response:
    """Its ground lit from the north-west, from corner to corner of its cells; clear where no ground is known."""
    await service.supervisor.in_store(service.store.dem, dem_id)
    path = await service.drawings.hillshade(dem_id)
    return await file_answer(request, path, "image/png", f"{dem_id}-hillshade")


@router.get(
    "/{dem_id}/levels", summary="See at which resolutions a DEM is there", responses=problem_responses(404, 409)
)
async def get_levels(dem_id: str, service: ServiceDep) -> Levels:
    """Sizes and places of its heights at each resolution; every level has half the rows and columns of the one before.

    The coarsest has at most 256 rows and columns. A value is the mean of the known posts under it.
    """
    dem = await service.supervisor.in_store(service.store.dem, dem_id)
    told = levels_of(dem.id, dem.summary)
    for one in told.levels:
        one.href = rooted(one.href)
    return told


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
        206: PART,
        304: KNOWN,
        **problem_responses(404, 409, 416, 422, 503, 507),
    },
)
async def get_heights(
    dem_id: str,
    request: Request,
    service: ServiceDep,
    level: Annotated[
        int, Query(ge=0, le=1000, description="Resolution level, a number; 0 holds the posts themselves.")
    ] = 0,
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


@router.delete(
    "/{dem_id}",
    status_code=204,
    summary="Delete a DEM",
    responses={
        200: {"description": "It was being made and is not any more, now or before.", "model": DemUnderWay},
        204: {"description": "It is gone."},
        **problem_responses(404, 409),
    },
)
async def delete_dem(dem_id: str, service: ServiceDep) -> Response:
    """Free its space. Refused (409) while jobs on it wait or run; finished results keep what they need."""
    ended = await service.grounds.end(dem_id)
    if ended is not None:
        return JSONResponse(DemUnderWay.of(ended).model_dump(mode="json"))

    def remove() -> None:
        service.store.remove_dem(dem_id)
        service.folder.remove(service.folder.dem(dem_id))

    await service.supervisor.in_store(service.supervisor.space.freeing, remove)
    return Response(status_code=204)


@ground.get("", summary="See what ground there is", responses=problem_responses(422))
async def get_ground(service: ServiceDep) -> Coverage:
    """What the operator's tiles cover; `POST /dems` with an `area` makes a DEM of it."""
    return Coverage.model_validate(await service.supervisor.ask("tell-coverage", {}, lane=Lane.CHECKS))
