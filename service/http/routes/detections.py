"""Detections: one epoch of ranges in, the verdict on each anchor out, at once."""

from __future__ import annotations

from fastapi import APIRouter, Request, Response

from detection import detect_epoch, diagnose
from service.http.bodies import body_of, json_body
from service.http.context import ServiceDep
from service.http.documented import problem_responses
from service.jobs.bodies import model_of
from service.live.answer_models import DetectionOut
from service.live.answers import as_json, epoch_answer
from service.live.request import DetectionIn

__all__ = ["router"]

router = APIRouter(prefix="/detections", tags=["Detectors"])


@router.post(
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
