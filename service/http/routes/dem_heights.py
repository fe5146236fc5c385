"""The heights of a DEM as they are, for whoever shades, colours or measures them."""

from __future__ import annotations

import asyncio
from pathlib import Path
from typing import Annotated

import numpy as np
import numpy.typing as npt
from fastapi import APIRouter, Query, Request, Response

from service.http.context import ServiceDep
from service.http.documented import problem_responses
from service.jobs.dem_files import load_grid

__all__ = ["router"]

router = APIRouter(prefix="/dems", tags=["DEMs"])
MEDIA_TYPE = "application/octet-stream"


@router.get(
    "/{dem_id}/heights",
    summary="Get the heights of a DEM",
    response_class=Response,
    responses={
        200: {
            "description": "Little-endian float32, metres, NaN unknown; rows from the north, each from the west.",
            "content": {MEDIA_TYPE: {"schema": {"type": "string", "format": "binary"}}},
            "headers": {
                "Sightline-Rows": {"description": "Number of rows.", "schema": {"type": "integer"}},
                "Sightline-Cols": {"description": "Number of posts in each.", "schema": {"type": "integer"}},
                "ETag": {"description": "Changes when the heights do.", "schema": {"type": "string"}},
            },
        },
        304: {"description": "You have it already (If-None-Match)."},
        **problem_responses(404, 422),
    },
)
async def get_heights(
    dem_id: str,
    request: Request,
    service: ServiceDep,
    level: Annotated[int, Query(ge=0, le=16, description="Every 2^level-th post, from the north-west one.")] = 0,
) -> Response:
    """All posts, or every second, fourth and so on of both directions."""
    await service.supervisor.in_store(service.store.dem, dem_id)
    # a DEM's id is a digest of its file and how it was read: what it names never changes
    headers = {"ETag": f'"{dem_id}-heights-{level}"', "Cache-Control": "private, no-cache"}
    if headers["ETag"] in request.headers.get("if-none-match", ""):
        return Response(status_code=304, headers=headers)
    heights_m = await asyncio.to_thread(_heights_m, service.folder.dem(dem_id), 2**level)
    rows, cols = heights_m.shape
    headers |= {"Sightline-Rows": str(rows), "Sightline-Cols": str(cols)}
    return Response(heights_m.tobytes(), headers=headers, media_type=MEDIA_TYPE)


def _heights_m(folder: Path, step: int) -> npt.NDArray[np.float32]:
    """Every step-th post as little-endian float32 in one piece of memory."""
    return np.ascontiguousarray(load_grid(folder).heights_m[::step, ::step], dtype="<f4")
