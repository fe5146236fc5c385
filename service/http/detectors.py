"""Detectors: an epoch judged by itself, and sessions that remember."""

from __future__ import annotations

import asyncio
import logging
from datetime import datetime
from typing import Annotated

from fastapi import Query, Request, Response
from pydantic_core import from_json

from detection import Calibrated, detect_epoch, diagnose
from service.jobs.channel import model_of, validated
from service.jobs.mission_tasks import RangeLogArguments
from service.jobs.records import Place
from service.live.answer_models import CalibrationOut, DetectionOut, DetectorOut, DetectorStateful, EpochsOut
from service.live.answers import as_json, epoch_answer
from service.live.drives import DriveIn, FullAdviceOut
from service.live.log_answers import RangeLogOut
from service.live.request import DetectionIn, DetectorIn, EpochIn, EpochsIn
from service.live.sessions import DetectorSession
from service.parts.cover import covered

from .bodies import json_body, receive
from .context import Service, ServiceDep
from .guard.routing import Router
from .lists import Page, TurnDep
from .meta import FILE_BODY, LOCATION, body_of, problem_responses

__all__ = ["detections", "range_logs", "router"]

logger = logging.getLogger("sightline.http")

router = Router(prefix="/detectors", tags=["Detectors"])
detections = Router(prefix="/detections", tags=["Detectors"])
range_logs = Router(prefix="/range-logs", tags=["Detectors"])


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
        **problem_responses(400, 404, 409, 413, 415, 422, 503),
    },
    openapi_extra=body_of(DetectorIn),
)
async def open_detector(request: Request, service: ServiceDep) -> Response:
    """A session for one rover: it remembers epochs, outlives the service, and expires when it lies idle."""
    asked = model_of(DetectorIn, await json_body(request), service.detectors.limits.refuse_long)
    grid = None
    if asked.dem_id is not None:
        bare, most = await service.supervisor.in_store(service.grid, asked.dem_id), service.settings.max_dem_cells
        grid = await service.detectors.bench.beside(lambda: covered(bare, asked, most))
    session = service.detectors.open(asked, grid)
    return _json(as_json(session.state()), 201, {"Location": f"/detectors/{session.id}"})


@router.get("", summary="List detectors", responses=problem_responses(422))
async def list_detectors(service: ServiceDep, turn: TurnDep) -> DetectorList:
    """Open sessions, newest first, without what they remember. `next` leads to the page after."""
    sessions = {_place(session): session for session in service.detectors.newest_first()}
    places = turn.part_of(list(sessions))
    described = [DetectorOut.model_validate(sessions[place].description()) for place in places[: turn.limit]]
    total, following = len(sessions), turn.cursor(places)
    return DetectorList(detectors=described, total=total, limit=turn.limit, offset=turn.offset, next=following)


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


@router.get(
    "/{detector_id}/calibration",
    response_model=None,
    summary="What ranges are off",
    responses={
        200: {"description": "An estimate with its sigma.", "model": CalibrationOut},
        **problem_responses(404, 410, 422),
    },
)
async def get_calibration(
    detector_id: str,
    service: ServiceDep,
    of: Annotated[Calibrated, Query(description="One offset of all ranges, one scale, or an offset of each anchor.")],
) -> Response:
    """From the latest 240 epochs. To have it applied, open a session with ``calibration``."""
    return _json(as_json(await service.detectors.get(detector_id).calibration(of)))


@router.put(
    "/{detector_id}/drive",
    status_code=204,
    response_model=None,
    summary="Name the path ahead",
    responses={204: {"description": "It is followed from now on."}, **problem_responses(400, 404, 410, 413, 415, 422)},
    openapi_extra=body_of(DriveIn),
)
async def put_drive(detector_id: str, request: Request, service: ServiceDep) -> Response:
    """The path that the rover follows, in place of the one before; epochs are answered with advice from then on."""
    session = service.detectors.get(detector_id)
    await session.follow(model_of(DriveIn, await json_body(request), service.detectors.limits.refuse_long))
    return Response(status_code=204)


@router.get(
    "/{detector_id}/drive",
    response_model=None,
    summary="Which path is followed",
    responses={
        200: {"description": "The path as it was named last; null without one.", "model": DriveIn | None},
        **problem_responses(404, 410),
    },
)
async def get_drive(detector_id: str, service: ServiceDep) -> Response:
    """The path that the rover follows: what distances of its advice are told along."""
    drive = service.detectors.get(detector_id).drive
    return _json(b"null" if drive is None else as_json(drive.model_dump(mode="json")))


@router.get(
    "/{detector_id}/advice",
    response_model=None,
    summary="What lies ahead",
    responses={
        200: {"description": "Stretches with too few usable anchors, bubbles, remedies.", "model": FullAdviceOut},
        **problem_responses(404, 410, 422),
    },
)
async def get_advice(detector_id: str, service: ServiceDep) -> Response:
    """Where too few anchors will be usable on the path ahead, how large the bubble gets, another speed, a move."""
    return _json(as_json(await service.detectors.get(detector_id).advise()))


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


@range_logs.post(
    "",
    response_model=None,
    summary="Read a range log",
    responses={
        200: {"description": "Its epochs, and what was passed over.", "model": RangeLogOut},
        **problem_responses(400, 413, 422, 503, 507),
    },
    openapi_extra=FILE_BODY,
)
async def read_log(
    request: Request,
    service: ServiceDep,
    filename: Annotated[
        str | None, Query(max_length=255, description="Name of the file, when the body is the bare file.")
    ] = None,
    anchor_id: Annotated[
        list[str] | None, Query(max_length=64, description="Ids of the anchors: columns may be named by them.")
    ] = None,
    epoch_s: Annotated[
        float, Query(ge=0.0, le=3600.0, description="Ranges of a table within so many seconds belong together.")
    ] = 0.0,
) -> Response:
    """A table, lines of JSON, or a log of messages (MCAP, ROS bags, ULog, DataFlash, MAVLink); nothing is kept.

    The epochs are as `POST /detectors/{id}/epochs` takes them. A file is known by what it holds.
    """
    limit = service.settings.max_log_bytes
    async with receive(request, service, limit, "max_log_bytes", filename) as upload:
        arguments = RangeLogArguments(path=str(upload.path), anchor_ids=anchor_id or [], epoch_s=epoch_s)
        found = await service.checks.ask("read-range-log", arguments, big=True)
    return _json(str(found["json"]).encode())


def _place(session: DetectorSession) -> Place:
    """Where it stands in lists."""
    return Place(datetime.fromisoformat(session.created_at).timestamp(), session.id)


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


def _json(body: bytes, status: int = 200, headers: dict[str, str] | None = None) -> Response:
    return Response(body, status, headers, "application/json")
