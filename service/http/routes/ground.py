"""The ground library: what it covers."""

from __future__ import annotations

from fastapi import APIRouter

from service.ground.coverage import Coverage
from service.http.context import ServiceDep
from service.http.documented import problem_responses
from service.jobs.pool import Lane

__all__ = ["router"]

router = APIRouter(prefix="/ground", tags=["DEMs"])


@router.get("", summary="See what ground there is", responses=problem_responses(422))
async def get_ground(service: ServiceDep) -> Coverage:
    """What the operator's tiles cover; `POST /dems` with an `area` makes a DEM of it."""
    return Coverage.model_validate(await service.supervisor.ask("tell-coverage", {}, lane=Lane.CHECKS))
