"""The ground library: what it covers."""

from __future__ import annotations

from typing import Any, Literal

from fastapi import APIRouter
from pydantic import BaseModel, Field

from service.http.context import ServiceDep
from service.http.documented import problem_responses
from service.jobs.pool import Lane

__all__ = ["router"]

router = APIRouter(prefix="/ground", tags=["DEMs"])


class Coverage(BaseModel):
    """GeoJSON: the outline of every tile of the ground library."""

    type: Literal["FeatureCollection"] = "FeatureCollection"
    features: list[dict[str, Any]] = Field(
        description="A polygon each in longitude and latitude, degrees; its properties tell name, CRS, cells in metres."
    )


@router.get("", summary="See what ground there is", responses=problem_responses(422))
async def get_ground(service: ServiceDep) -> Coverage:
    """What the operator's tiles cover; `POST /dems` with an `area` makes a DEM of it."""
    return Coverage.model_construct(**await service.supervisor.ask("tell-coverage", {}, lane=Lane.CHECKS))
