"""Safety bubbles in a worker: read the body, check it, calculate, write the files."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from service.errors import LimitError
from service.estimates import estimate_map, refuse_beyond_limits
from service.jobs.folder import digest_of, make_durable
from service.jobs.tasks.bodies import body_in, read_body
from service.jobs.tasks.context import TaskContext
from service.parts.satellites import ORBIT_TEXTS
from service.products.safety_bubbles.calculate import calculate_bubbles
from service.products.safety_bubbles.files import BUBBLE_FILES, write_bubble_file
from service.products.safety_bubbles.question import check_bubble_question
from service.products.safety_bubbles.request import BubbleParameters, SafetyBubblesIn

__all__ = ["calculate_safety_bubbles", "check_safety_bubbles"]

REQUEST = "request.json"
LONG = ("points", "points_m", "times_s", "covariances_m2")


def check_safety_bubbles(context: TaskContext, arguments: Mapping[str, Any]) -> Mapping[str, Any]:
    """Read the request; it goes into the work folder whole, and comes back without what is long.

    Raises NotJsonError, NotValidError, LimitError, NotFoundError, and what check_bubble_question raises.
    """
    asked = read_body(SafetyBubblesIn, body_in(arguments), context.settings)
    settings = context.settings
    grid = context.grid(asked.dem_id)
    sources = check_bubble_question(grid, asked)[0]
    if sources > settings.max_anchors:
        raise LimitError(
            f"{sources} anchors and satellites are more than the limit of {settings.max_anchors} in one request",
            limit_name="max_anchors",
            limit=settings.max_anchors,
            given=sources,
        )
    if asked.covariances_m2 is None:
        refuse_beyond_limits(estimate_map(grid.heights_m.size, sources, asked.mode), settings)
    context.work.mkdir(parents=True)
    whole = asked.model_dump_json(exclude_none=True, exclude={"dem_id"})
    (context.work / REQUEST).write_text(whole, encoding="utf-8")
    make_durable(context.work)
    long: dict[str, bool | set[str]] = {
        "dem_id": True,
        **dict.fromkeys(LONG, True),
        "satellites": set(ORBIT_TEXTS),
        "buildings": {"base64"},
    }
    short = asked.model_dump(mode="json", exclude_none=True, exclude=long)
    return {"dem_id": asked.dem_id, "options": short, "points": asked.count}


def calculate_safety_bubbles(context: TaskContext, arguments: Mapping[str, Any]) -> Mapping[str, Any]:
    """Leave the files in the work folder; digest and summary come back."""
    path = context.folder.inputs(arguments["job_id"]) / REQUEST
    parameters = BubbleParameters.model_validate_json(path.read_bytes())
    finished = calculate_bubbles(context.grid(arguments["dem_id"]), parameters, context.progress)
    context.work.mkdir(parents=True)
    for name in BUBBLE_FILES:
        write_bubble_file(finished, name, context.work / name)
    make_durable(context.work)
    return {"digest": digest_of(context.work), "summary": finished.summary()}
