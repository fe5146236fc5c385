"""Safety bubbles along a path or for a history of poses as a product."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from pydantic import JsonValue

from service.errors import LimitError
from service.estimates import estimate_map, refuse_beyond_limits
from service.parts.positioning import ORBIT_TEXTS
from service.products import Inline, Product
from service.settings import Settings
from terrain import ElevationGrid

from .calculate import BubbleOut, SafetyBubblesSummary, calculate_bubbles
from .files import LAYERS
from .request import PATH, BubbleParameters, SafetyBubblesIn, check_bubble_question

__all__ = ["SAFETY_BUBBLES"]

REQUEST = "request.json"
LONG = ("points", "points_m", "times_s", "covariances_m2")


def _check(grid: ElevationGrid, asked: BubbleParameters, settings: Settings) -> None:
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


def _pack(grid: ElevationGrid, asked: BubbleParameters, folder: Path) -> dict[str, JsonValue]:
    """What is asked with the number of its points in place of what is long; the whole of it goes into the folder."""
    folder.mkdir(parents=True)
    (folder / REQUEST).write_text(asked.model_dump_json(exclude_none=True), encoding="utf-8")
    long: dict[str, bool | set[str]] = {
        **dict.fromkeys(LONG, True),
        "satellites": set(ORBIT_TEXTS),
        "buildings": {"base64"},
    }
    return {**asked.model_dump(mode="json", exclude_none=True, exclude=long), "points": asked.count}


def _unpack(packed: Mapping[str, JsonValue], folder: Path) -> BubbleParameters:
    return BubbleParameters.model_validate_json((folder / REQUEST).read_bytes())


SAFETY_BUBBLES = Product(
    name="safety-bubbles",
    title="safety bubbles",
    plural="safety_bubbles",
    model="SafetyBubbles",
    tag="Safety bubbles",
    summary="How surely a vehicle keeps clear of ground and buildings along a path.",
    about="Per point of a path, or of a history of poses: radius of the bubble, clearance to the ground, and the "
    "verdict.",
    asked=SafetyBubblesIn,
    parameters=BubbleParameters,
    answer=SafetyBubblesSummary,
    example=PATH,
    check=_check,
    calculate=calculate_bubbles,
    layers=LAYERS,
    pack=_pack,
    unpack=_unpack,
    long_body=True,
    inline=Inline("points", "points.json", BubbleOut, "One entry per point; null until it succeeded."),
)
