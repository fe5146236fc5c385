"""Plans of a path from another start: answered at once, without a job, and kept nowhere."""

from __future__ import annotations

from fastapi import APIRouter, Request, Response

from service.jobs.channel import BodyArguments, ReplanArguments
from service.jobs.pool import Lane
from service.products.paths.replans import ReplanIn, ReplanOut

from ..bodies import json_body
from ..context import ServiceDep
from ..jobs import finished
from ..meta import body_of, problem_responses

__all__ = ["router"]

router = APIRouter(prefix="/paths", tags=["Paths"])


@router.post(
    "/{job_id}/replans",
    name="replan_path",
    summary="Plan a path again from where the rover is",
    response_model=None,
    responses={
        200: {"description": "The answer.", "model": ReplanOut},
        **problem_responses(400, 404, 409, 413, 415, 422, 503),
    },
    openapi_extra=body_of(ReplanIn),
)
async def replan(job_id: str, request: Request, service: ServiceDep) -> Response:
    """The path from another start, all else as the path was asked: no job, and nothing is kept.

    Meant for a rover that left its path. The first plan of a path works out the costs from everywhere to the goals,
    which may take seconds; those after it take a fraction of one, until plans of another path are asked for. For
    anchors that stand, without way-points, and for a rover that turns on the spot.
    """
    body = await json_body(request)
    job = await finished(service, "path", job_id)
    arguments = ReplanArguments(
        parameters=job.request["parameters"], dem_id=job.dem_id, job_id=job.id, given=BodyArguments(body=body)
    )
    found = await service.supervisor.ask("replan", arguments, lane=Lane.PROBES)
    return Response(str(found["json"]), media_type="application/json")
