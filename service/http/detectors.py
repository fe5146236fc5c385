"""Detectors: an epoch judged by itself, and sessions that remember."""

from __future__ import annotations

import asyncio
import logging

from fastapi import APIRouter, Request, Response
from pydantic_core import from_json

from detection import detect_epoch, diagnose
from service.jobs.channel import model_of, validated
from service.jobs.kept_files import load_grid
from service.live.answer_models import DetectionOut, DetectorOut, DetectorStateful, EpochsOut
from service.live.answers import as_json, epoch_answer
from service.live.request import DetectionIn, DetectorIn, EpochIn, EpochsIn
from service.live.watching import looked_at
from terrain import ElevationGrid

from .answers import Limit, Offset, Page
from .bodies import json_body
from .context import Service, ServiceDep
from .meta import LOCATION, body_of, problem_responses

__all__ = ["detections", "router"]

logger = logging.getLogger("sightline.http")

router = APIRouter(prefix="/detectors", tags=["Detectors"])
detections = APIRouter(prefix="/detections", tags=["Detectors"])


@detections.post(
    "",
    response_model=None,
    summary="Judge one epoch",
    responses={
        200: {"description": "The verdicts, and a position from the ranges that are left.", "model": DetectionOut},
        **problem_responses(400, 413, 415, 422),
    },
    openapi_extra=body_of(DetectionIn),
)
async def judge_epoch(request: Request, service: ServiceDep) -> Response:
    """Which of these ranges lie, judged by themselves: stateless, answered at once, nothing is kept."""
    limits = service.detectors.limits
    asked = model_of(DetectionIn, await json_body(request), limits.refuse_long)
    limits.check_detector(asked)
    limits.check_ranges(asked.ranges)
    anchors = [anchor.anchor() for anchor in asked.anchors]
    epoch, settings = asked.epoch(), asked.settings.settings()
    result = await service.detectors.bench.judge(len(asked.ranges), lambda: detect_epoch(anchors, epoch, settings))
    warnings = [one.sentence for one in diagnose(anchors, (epoch,), (result,), settings)]
    return Response(as_json({**epoch_answer(result), "warnings": warnings}), media_type="application/json")


class DetectorList(Page):
    """One page of sessions, newest first, without their states."""

    detectors: list[DetectorOut]


@router.post(
    "",
    status_code=201,
    response_model=None,
    summary="Open a detector",
    responses={
        201: {"description": "Open; epochs go to the path in links.", "headers": LOCATION, "model": DetectorStateful},
        **problem_responses(400, 404, 413, 415, 422, 503),
    },
    openapi_extra=body_of(DetectorIn),
)
async def open_detector(request: Request, service: ServiceDep) -> Response:
    """A session for one rover: it remembers epochs, and expires when it lies idle or the service ends."""
    asked = model_of(DetectorIn, await json_body(request), service.detectors.limits.refuse_long)
    grid = None if asked.dem_id is None else await _grid(service, asked.dem_id)
    session = service.detectors.open(asked, grid)
    return _json(as_json(session.state()), 201, {"Location": f"/detectors/{session.id}"})


@router.get("", summary="List detectors", responses=problem_responses(422))
async def list_detectors(service: ServiceDep, limit: Limit = 50, offset: Offset = 0) -> DetectorList:
    """Open sessions, newest first, without what they remember."""
    sessions = service.detectors.page(limit, offset)
    described = [DetectorOut.model_validate(session.description()) for session in sessions]
    return DetectorList(detectors=described, total=len(service.detectors), limit=limit, offset=offset)


@router.get(
    "/{detector_id}",
    response_model=None,
    summary="Read a detector",
    responses={
        200: {"description": "The session and what it remembers.", "model": DetectorStateful},
        **problem_responses(404, 410),
    },
)
async def get_detector(detector_id: str, service: ServiceDep) -> Response:
    """Counts, the last word on each anchor, the witnesses' health, the last answer. Reading keeps it from expiring."""
    return _json(as_json(await service.detectors.get(detector_id).state_between_epochs()))


@router.post(
    "/{detector_id}/epochs",
    response_model=None,
    summary="Send epochs",
    responses={
        200: {"description": "One answer per epoch, in their order.", "model": EpochsOut},
        **problem_responses(400, 404, 410, 413, 415, 422),
    },
    openapi_extra=body_of(EpochsIn),
)
async def send_epochs(detector_id: str, request: Request, service: ServiceDep) -> Response:
    """Each epoch is answered; one that is late, out of order or a duplicate is told, counted, and otherwise ignored.

    A request that is refused changes nothing: all its epochs are checked before the first is used.
    """
    session = service.detectors.get(detector_id)
    epochs = await _epochs_in(await json_body(request), service)
    for epoch in epochs:
        session.check(epoch)
    async with session.turn:
        answers = [await session.answer_in_turn(epoch) for epoch in epochs]
    return _json(b'{"answers":[' + b",".join(answers) + b"]}")


@router.get(
    "/{detector_id}/map-doubts",
    response_model=None,
    summary="Where ranges contradict the map",
    responses={
        200: {
            "description": "GeoJSON: a line or point for each contradiction that lasted, with anchor_id, expected "
            "(what the map has), bearing_deg, distance_m, from_s, to_s, ranges, excess_m and probability.",
            "content": {"application/geo+json": {"schema": {"type": "object"}}},
        },
        **problem_responses(404, 410, 422),
    },
)
async def get_map_doubts(detector_id: str, service: ServiceDep) -> Response:
    """Places where an anchor was hidden that the map has in sight, or heard straight that it has hidden."""
    doubts = await service.detectors.get(detector_id).map_doubts()
    return Response(doubts, media_type="application/geo+json")


@router.delete(
    "/{detector_id}",
    status_code=204,
    summary="Delete a detector",
    responses={204: {"description": "It is over, and so are its streams."}, **problem_responses(404, 410)},
)
async def delete_detector(detector_id: str, service: ServiceDep) -> Response:
    """Its streams are closed; what it remembered is gone."""
    service.detectors.delete(detector_id)
    return Response(status_code=204)


async def _epochs_in(body: str, service: Service) -> list[EpochIn]:
    """The epochs of a body. Raises NotJsonError, LimitError, NotValidError."""
    limits = service.detectors.limits
    if len(body) <= service.settings.max_stream_message_bytes:
        return model_of(EpochsIn, body, limits.refuse_long_epochs).epochs
    # what is wrong with a long one takes long to tell; what is right is read here, epoch by epoch
    await service.checks.ask("check-epochs", {"body": body})
    epochs = []
    for fields in from_json(body)["epochs"]:
        epochs.append(validated(EpochIn, fields))
        await asyncio.sleep(0)
    return epochs


async def _grid(service: Service, dem_id: str) -> ElevationGrid:
    """The ground of a DEM, its heights mapped from the file. Raises NotFoundError."""
    await service.supervisor.in_store(service.store.dem, dem_id)
    return await asyncio.to_thread(lambda: looked_at(load_grid(service.folder.dem(dem_id))))


def _json(body: bytes, status: int = 200, headers: dict[str, str] | None = None) -> Response:
    return Response(body, status, headers, "application/json")
