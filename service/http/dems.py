"""DEMs: upload, list, look at, delete, and how the service tells about them."""

from __future__ import annotations

import hashlib
import json
import math
import time
import uuid
from collections.abc import Mapping
from datetime import UTC, datetime
from pathlib import PurePath
from typing import Annotated, Literal, Self, cast

from fastapi import APIRouter, Query, Request, Response
from fastapi.responses import FileResponse
from pydantic import BaseModel, ConfigDict, Field, JsonValue

from dem_samples import sample_manifest
from service.errors import BusyError, RequestError
from service.jobs.channel import ReadDemArguments, ReadingOptions
from service.jobs.folder import move_into_place
from service.jobs.records import DemRecord
from service.jobs.recovery import note_dem

from .answers import Limit, Offset, Page
from .bodies import receive
from .context import Service, ServiceDep
from .jobs import file_answer
from .meta import LOCATION, problem_responses

__all__ = ["Bounds", "DemList", "DemOut", "router"]

EXAMPLE: dict[str, JsonValue] = {
    "id": "5b1f0c3e9f7a4d0c8a3f6f0b6f0e2d11",
    "name": "bigtujunga.tif",
    "created_at": "2026-05-01T12:00:00Z",
    "file_bytes": 1843220,
    "driver": "GTiff",
    "rows": 643,
    "cols": 1197,
    "cells": 769671,
    "cell_east_m": 30.0,
    "cell_north_m": 30.0,
    "bounds_of_posts_m": {"west": 380000.0, "south": 3787000.0, "east": 415880.0, "north": 3806260.0},
    "crs": "EPSG:32611",
    "crs_name": "WGS 84 / UTM zone 11N",
    "body": "Earth",
    "grid_north_deg": -0.62,
    "vertical_datum": None,
    "heights_count_from": "unknown",
    "lowest_m": 315.0,
    "highest_m": 2295.0,
    "unknown_posts": 0,
    "conversions": [],
    "warnings": [],
    "sha256": "0f3c2d1e5b1f0c3e9f7a4d0c8a3f6f0b6f0e2d110f3c2d1e5b1f0c3e9f7a4d0c",
    "links": {
        "self": "/dems/5b1f0c3e9f7a4d0c8a3f6f0b6f0e2d11",
        "hillshade": "/dems/5b1f0c3e9f7a4d0c8a3f6f0b6f0e2d11/hillshade.png",
    },
}
router = APIRouter(prefix="/dems", tags=["DEMs"])
DATUM = (
    "What heights shall count from: `msl`, `hae`, `EGM96`, or a vertical CRS as `EPSG:5703`; converted to, or taken so."
)
UPLOAD_BODY = {
    "requestBody": {
        "description": "The file, as a form or as it is. Not needed with `sample`.",
        "content": {
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


class Bounds(BaseModel):
    """Positions of the outermost posts, in the DEM's metric CRS."""

    west: float = Field(description="East coordinate of the westmost posts, metres.")
    south: float = Field(description="North coordinate of the southmost posts, metres.")
    east: float = Field(description="East coordinate of the eastmost posts, metres.")
    north: float = Field(description="North coordinate of the northmost posts, metres.")


class DemOut(BaseModel):
    """An uploaded DEM: what was read, what was converted, and every warning."""

    model_config = ConfigDict(json_schema_extra={"examples": [EXAMPLE]})

    id: str = Field(description="Names the DEM in requests; the same file read the same way has the same id.")
    name: str = Field(description="Name of the file, or of the bundled DEM.")
    created_at: datetime = Field(description="When it was uploaded first.")
    file_bytes: int | None = Field(description="Size of the file, bytes; null for a bundled DEM.")
    driver: str = Field(description="Format that the file was read as.")
    rows: int = Field(description="Rows of posts, north to south.")
    cols: int = Field(description="Columns of posts, west to east.")
    cells: int = Field(description="Rows times columns.")
    cell_east_m: float = Field(description="Distance between neighbouring posts eastwards, metres.")
    cell_north_m: float = Field(description="Distance between neighbouring posts northwards, metres.")
    bounds_of_posts_m: Bounds
    crs: str | None = Field(description="Metric CRS that positions are in; null for a local metric frame.")
    crs_name: str | None = Field(None, description="The same in words.")
    body: str | None = Field(None, description="Celestial body that the CRS lies on; null for a local frame.")
    grid_north_deg: float | None = Field(
        None, description="True azimuth of the grid's north in the middle, degrees; add it to azimuths from grid north."
    )
    vertical_datum: str | None = Field(description="What heights are measured from, when the file says so.")
    heights_count_from: str | None = Field(
        None, description="What that is: sea level, ellipsoid or unknown. Mission files need sea level."
    )
    lowest_m: float | None = Field(description="Lowest known height, metres; null when all is unknown.")
    highest_m: float | None = Field(description="Highest known height, metres; null when all is unknown.")
    unknown_posts: int = Field(description="Posts of unknown height.")
    conversions: list[str] = Field(description="What was converted while reading, in sentences.")
    warnings: list[str] = Field(description="What to know before trusting it, in sentences.")
    sha256: str = Field(description="Digest of heights, geometry and CRS.")
    links: dict[str, str] = Field(description="Paths of what belongs to it.")

    @classmethod
    def of(cls, dem: DemRecord) -> Self:
        """The DEM of a record."""
        own = {
            "id": dem.id,
            "name": dem.name,
            "created_at": datetime.fromtimestamp(dem.created_at_s, UTC),
            "links": {"self": f"/dems/{dem.id}", "hillshade": f"/dems/{dem.id}/hillshade.png"},
        }
        return cls.model_validate({**own, **dem.summary})


class DemList(Page):
    """One page of DEMs, newest first."""

    dems: list[DemOut]


@router.post(
    "",
    status_code=201,
    summary="Upload a DEM",
    responses={
        201: {"description": "The DEM was read.", "headers": LOCATION},
        200: {"description": "The same DEM was there already.", "headers": LOCATION, "model": DemOut},
        **problem_responses(404, 413, 422, 503, 507),
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
    vertical_datum: Annotated[str | None, Query(max_length=120, description=DATUM)] = None,
) -> DemOut:
    """Read a GeoTIFF, COG, ESRI ASCII, SRTM .hgt, DTED, .npz or .npy file and keep it.

    Send the file as a multipart form (`curl -F file=@dem.tif`) or as the body (`curl --data-binary @dem.tif` with
    `?filename=dem.tif`). Geographic files are warped to metres; what was converted is told.
    """
    # as text where JSON has no such number
    fill = str(nodata) if nodata is not None and not math.isfinite(nodata) else nodata
    given = {"nodata": fill, "crs": crs, "height_unit": height_unit, "band": band, "cell_m": cell_m}
    given["vertical_datum"] = vertical_datum
    options = cast(ReadingOptions, {name: value for name, value in given.items() if value is not None})
    if sample is not None:
        if options or filename is not None:
            raise RequestError("A bundled DEM is taken as it is; leave out filename and reading options.")
        if await anext(request.stream(), b""):
            raise RequestError("Send a file or name a bundled DEM with sample, not both.")
        bundled = sample_manifest(sample)
        dem_id = _id_of("sample", str(bundled["sha256"]))
        arguments = ReadDemArguments(sample=sample, options={})
        dem, is_new = await _kept(service, dem_id, str(bundled["file"]), arguments, None)
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


@router.delete("/{dem_id}", status_code=204, summary="Delete a DEM", responses=problem_responses(404, 409))
async def delete_dem(dem_id: str, service: ServiceDep) -> None:
    """Free its space. Refused (409) while jobs on it wait or run; finished results keep what they need."""

    def remove() -> None:
        service.store.remove_dem(dem_id)
        service.folder.remove(service.folder.dem(dem_id))

    await service.supervisor.in_store(remove)


async def _uploaded(
    request: Request, service: Service, filename: str | None, options: ReadingOptions
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
        arguments = ReadDemArguments(path=str(upload.path), options=options)
        return await _kept(service, dem_id, upload.name, arguments, upload.size_bytes)


async def _kept(
    service: Service, dem_id: str, name: str, arguments: ReadDemArguments, file_bytes: int | None
) -> tuple[DemRecord, bool]:
    """The DEM of that id, read now unless it is there already, and whether it is new."""
    known = await service.supervisor.in_store(service.store.dem_or_none, dem_id)
    # its files may have been lost; then they are read again
    if known is not None and service.folder.dem(dem_id).is_dir():
        return known, False
    token = uuid.uuid4().hex
    summary = cast(Mapping[str, JsonValue], await service.supervisor.ask("read-dem", arguments, token))
    dem = DemRecord(dem_id, name, time.time(), {**summary, "file_bytes": file_bytes})

    def keep() -> DemRecord:
        move_into_place(service.folder.work(token), service.folder.dem(dem_id))
        service.store.add_dem(dem)
        note_dem(service.store, service.folder, dem_id)
        return service.store.dem(dem_id)

    return await service.supervisor.in_store(keep), True


def _id_of(*parts: str) -> str:
    return hashlib.sha256("\0".join(parts).encode("utf-8", "surrogatepass")).hexdigest()[:32]
