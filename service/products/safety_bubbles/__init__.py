"""Safety bubbles along a path or for a history of poses as a product."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from pydantic import JsonValue

import navigation
from service.estimates import Demand, sight_lines
from service.parts.positioning import ORBIT_TEXTS
from service.products import Inline, Product, WarmUp
from terrain import ElevationGrid, nearest_surface
from visibility import Anchor, Buildings, min_visible_altitude, visible_sets
from visibility.cover import nearest_building
from visibility.dilution import dop_at_points, pack_sets

from .calculate import BubbleOut, SafetyBubblesSummary, calculate_bubbles
from .files import LAYERS
from .request import PATH, BubbleParameters, SafetyBubblesIn, check_bubble_question

__all__ = ["SAFETY_BUBBLES"]

REQUEST = "request.json"
LONG = ("points", "points_m", "times_s", "covariances_m2")


def _estimate(grid: ElevationGrid, asked: BubbleParameters) -> list[Demand]:
    anchors, *lines = sight_lines(grid.heights_m.size, check_bubble_question(grid, asked)[0], asked.mode)
    return [anchors] if asked.covariances_m2 is not None else [anchors, *lines]


def _along_a_path(grid: ElevationGrid) -> None:
    nearest_surface(grid, [[10.0, -10.0, 60.0]])
    corners_m = np.array([(0, 0, 0), (9, 0, 0), (0, 9, 0), (0, 0, 9)], float)
    tent = Buildings(corners_m, np.array([(0, 1, 2), (0, 1, 3), (1, 2, 3), (0, 2, 3)]))
    nearest_building(tent, [[1.0, 1.0, 1.0]])
    navigation.bubble_confidence(np.eye(3), 1.0)
    navigation.radius_of_confidence(np.eye(3), 0.9)
    points_m, anchors_m = [[10.0, -10.0, 60.0], [20.0, -20.0, 60.0]], [[100.0, -200.0, 90.0]]
    surfaces = min_visible_altitude(grid, [Anchor("A", 100.0, -200.0, 90.0)])
    dop_at_points(points_m, anchors_m, pack_sets(visible_sets(surfaces, points_m).visible()))
    motion = navigation.MotionNoise()
    start = navigation.initial_state(0.0, points_m[0])
    navigation.update_hypotheses(navigation.carry_hypotheses(start, 1), 1.0, motion, anchors_m, [200.0], 1.0).state()
    for clock_m in (None, (0.0, 0.0)):
        state = navigation.predict(navigation.initial_state(0.0, points_m[0], clock_m=clock_m), 1.0, motion)
        navigation.update_ranges(state, anchors_m, [200.0], 1.0)
        navigation.filter_ranges(state, motion, [2.0], [0], [200.0], 1.0, anchors_m)
        navigation.predict_bubble(
            points_m,
            [0.0, 1.0],
            anchors_m,
            [[True], [True]],
            1.0,
            clock=clock_m is not None,
            ground_slope=[[0.0, 0.0]] * 2,
        )


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
    estimate=_estimate,
    warm_up=(WarmUp(_along_a_path),),
    calculate=calculate_bubbles,
    layers=LAYERS,
    pack=_pack,
    unpack=_unpack,
    long_body=True,
    inline=Inline("points", "points.json", BubbleOut, "One entry per point; null until it succeeded."),
)
