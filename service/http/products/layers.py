"""Layers of results: as files, and rasters as bare numbers by level and by tile, for programs that draw maps."""

from __future__ import annotations

import asyncio
from pathlib import Path
from typing import Annotated

import numpy as np
from fastapi import APIRouter, Request, Response
from fastapi import Path as InPath
from fastapi.responses import FileResponse
from pydantic import JsonValue

from service.errors import NotFoundError
from service.files.layer import COG
from service.jobs.tile_tasks import TILE_POSTS, TileArguments, Tiles
from service.products import Product

from ..context import Service, ServiceDep
from ..jobs import bytes_answer, file_answer, finished, has_layer, path_of
from ..meta import KNOWN, PART, Responses, problem_responses

__all__ = ["add_layers", "add_tiles"]

OCTETS = "application/octet-stream"
BYTES: dict[str, JsonValue] = {"type": "string", "format": "binary"}
Number = Annotated[int, InPath(ge=0, le=1_000_000)]
ETAG = {"ETag": {"description": "Changes when the file does.", "schema": {"type": "string"}}}
NUMBERS: Responses = {
    200: {
        "description": "The values.",
        "content": {OCTETS: {"schema": BYTES}},
        "headers": ETAG,
    },
    304: KNOWN,
    **problem_responses(404, 409, 422, 503, 507),
}
RANGED: Responses = {**NUMBERS, 206: PART, **problem_responses(416)}


def add_layers(router: APIRouter, product: Product, one: str, article: str) -> None:
    """The route of a product's files. article: one of it, in words."""
    layers = product.layer
    responses: Responses = {
        200: {
            "description": "The file.",
            # JSON is told as whatever JSON can be, all else as bytes
            "content": {
                layer.media_type: {"schema": {} if "json" in layer.media_type else BYTES} for layer in layers.values()
            },
            "headers": ETAG,
        },
        206: PART,
        304: KNOWN,
        **problem_responses(404, 409, 416, 422, 503, 507),
    }

    @router.get(
        "/{job_id}/layers/{layer}",
        name=f"download_{one}_layer",
        summary=f"Download a layer of {article}",
        description="A file of the result. It is written when it is first asked for; ranges and If-None-Match are "
        "understood.",
        response_class=FileResponse,
        responses=responses,
    )
    async def download_layer(job_id: str, layer: str, request: Request, service: ServiceDep) -> Response:
        job = await finished(service, product.name, job_id)
        if layer not in layers or not has_layer(job, layers[layer]):
            raise NotFoundError("layer", layer)
        assert job.digest is not None
        path, version = service.folder.result(job.digest) / layer, f"{job.digest}-{layer}"
        if product.finished is not None:
            path = await service.drawings.layer(job.digest, layer, job.summary or {})
            version += f"-{path.parent.name}"  # of the Sightline that drew it
        return await file_answer(request, path, layers[layer].media_type, version)

    if product.inline is not None:
        router.add_api_route(
            "/{job_id}/files/{layer}",
            download_layer,
            name=f"download_{one}_file",
            summary=f"Download a file of {article}",
            description="The same as `/layers/`, under its older name.",
            deprecated=True,
            response_class=FileResponse,
            responses=responses,
        )


def add_tiles(router: APIRouter, product: Product, one: str) -> None:
    """Routes of a product's raster layers; none where it has no such layers."""
    if product.finished is None or not any(layer.media_type == COG for layer in product.layers):
        return

    @router.get(
        "/{job_id}/tiles/{layer}",
        name=f"list_{one}_tiles",
        summary="See a raster layer's levels",
        description="How many values it has at which level, and where they are.",
        responses=problem_responses(404, 409, 503, 507),
    )
    async def list_tiles(job_id: str, layer: str, service: ServiceDep) -> Tiles:
        _, tiles = await _tiles(service, product, job_id, layer)
        return tiles

    @router.get(
        "/{job_id}/tiles/{layer}/{level}",
        name=f"get_{one}_level",
        summary="Get a level of a raster layer",
        description="All bands, one after the other, each row by row from the north; ranges and If-None-Match are "
        "understood.",
        response_class=FileResponse,
        responses=RANGED,
    )
    async def get_level(job_id: str, layer: str, level: Number, request: Request, service: ServiceDep) -> Response:
        digest, tiles = await _tiles(service, product, job_id, layer)
        path = await _level(service, digest, tiles, level)
        return await file_answer(request, path, OCTETS, f"{digest}-{path.name}-{path.parent.name}")

    @router.get(
        "/{job_id}/tiles/{layer}/{level}/{row}/{col}",
        name=f"get_{one}_tile",
        summary="Get a tile of a raster layer",
        description=f"{TILE_POSTS} by {TILE_POSTS} values of each band, fewer at the border; row and col count tiles "
        "from the north-west; If-None-Match is understood.",
        response_class=Response,
        responses=NUMBERS,
    )
    async def get_tile(
        job_id: str, layer: str, level: Number, row: Number, col: Number, request: Request, service: ServiceDep
    ) -> Response:
        digest, tiles = await _tiles(service, product, job_id, layer)
        path = await _level(service, digest, tiles, level)
        values = await asyncio.to_thread(_cut, path, tiles, level, row, col)
        return bytes_answer(request, values, OCTETS, f"{digest}-{path.name}-{path.parent.name}-{row}-{col}")


async def _tiles(service: Service, product: Product, job_id: str, layer: str) -> tuple[str, Tiles]:
    """(digest of the result, its levels). Raises NotFoundError, NotReadyError."""
    job = await finished(service, product.name, job_id)
    known = product.layer.get(layer)
    if known is None or known.media_type != COG or not has_layer(job, known):
        raise NotFoundError("raster layer", layer)
    assert job.digest is not None
    await service.drawings.layer(job.digest, layer, job.summary or {})
    told = await service.checks.ask("tell-tiles", TileArguments(digest=job.digest, layer=layer))
    tiles = Tiles.model_validate(told)
    for one in tiles.levels:
        one.href = f"{path_of(service, job)}/tiles/{layer}/{one.level}"
    return job.digest, tiles


async def _level(service: Service, digest: str, tiles: Tiles, level: int) -> Path:
    if level >= len(tiles.levels):
        raise NotFoundError("level", str(level), f"{tiles.layer} has levels 0 to {len(tiles.levels) - 1}")
    return await service.drawings.layer_level(digest, tiles.layer, level)


def _cut(path: Path, tiles: Tiles, level: int, row: int, col: int) -> bytes:
    """Raises NotFoundError for a tile beyond the border."""
    rows, cols = tiles.levels[level].rows, tiles.levels[level].cols
    north, west = row * TILE_POSTS, col * TILE_POSTS
    if north >= rows or west >= cols:
        most = f"level {level} has {-(-rows // TILE_POSTS)} rows and {-(-cols // TILE_POSTS)} columns of tiles"
        raise NotFoundError("tile", f"{row}/{col}", most)
    try:
        values = np.memmap(path, np.dtype(tiles.data_type).newbyteorder("<"), "r", shape=(len(tiles.bands), rows, cols))
    except FileNotFoundError as error:
        raise NotFoundError("file", path.name) from error
    return values[:, north : north + TILE_POSTS, west : west + TILE_POSTS].tobytes()
