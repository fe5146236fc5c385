"""The drone to move before a stretch where a rover would hear too few anchors, among the places near it."""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace

import numpy as np

from planning.placement import Flight, Goal, MoveQuestion, Repositioning, SightOptions, path_between, reposition
from planning.placement.moves import USUAL_HEIGHTS_M
from terrain import ElevationGrid
from visibility import Anchor, Curvature

from .advice import DarkStretch, Drive
from .detours import part_around

__all__ = ["MoveAdvice", "advise_move"]

MOST_PLACES = 40_000  # of all drones that may move
MOST_POSTS = 100_000  # around each of them


@dataclass(frozen=True, slots=True)
class MoveAdvice:
    """A drone to move before a stretch: what ``reposition`` finds for it.

    reach_m: the longest flight that was looked at; apart_m: how far apart the places were that were looked at.
    sentence: what was found, and what of the places was not looked at.
    """

    stretch: DarkStretch
    found: Repositioning
    reach_m: float
    apart_m: float
    sentence: str


def advise_move(
    grid: ElevationGrid,
    drive: Drive,
    stretch: DarkStretch,
    anchors: Sequence[Anchor],
    *,
    movable: Collection[str] | None = None,
    occluded: Collection[str] = (),
    antenna_above_ground_m: float = 1.5,
    flight: Flight | None = None,
    curvature: Curvature | None = None,
    most_places: int = MOST_PLACES,
    most_posts: int = MOST_POSTS,
) -> MoveAdvice:
    """The drone whose move, at the least flight, gives a stretch the anchors that it needs.

    Looked at are the most_posts posts around each drone, and of these every so many that most_places do for all drones.
    Raises PlacementError, AnchorError.
    """
    flight = flight or Flight()
    path_m = path_between(drive.path_m, stretch.from_m, max(stretch.to_m, stretch.from_m + 1e-3))
    moving = [one for one in anchors if movable is None or one.id in movable]
    near_m = math.sqrt(most_posts * grid.cell_east_m * grid.cell_north_m / math.pi)
    if grid.rows * grid.cols <= most_posts:
        near_m = math.inf
    places = len(moving) * (len(USUAL_HEIGHTS_M) + 1) * min(most_posts, grid.rows * grid.cols)
    every = max(math.ceil(math.sqrt(places / most_places)), 1)
    apart_m = every * max(grid.cell_east_m, grid.cell_north_m)
    reach_m = min(flight.max_flight_m, near_m)
    part = grid
    if math.isfinite(reach_m):
        around = [(one.east_m + side * reach_m, one.north_m + side * reach_m) for one in moving for side in (-1.0, 1.0)]
        part = part_around(grid, np.array([*path_m.tolist(), *((one.east_m, one.north_m) for one in anchors), *around]))
    question = MoveQuestion(
        Goal("coverage", min_anchors=drive.min_anchors), occluded=occluded, movable=movable,
        every=every, receiver_above_ground_m=antenna_above_ground_m, flight=replace(flight, max_flight_m=reach_m),
        sight=SightOptions(curvature=curvature),
    )  # fmt: skip
    found = reposition(part, anchors, path_m, question)
    told = f" Places {apart_m:.0f} m apart were looked at." if every > 1 else ""
    if near_m < flight.max_flight_m and not found.restored:
        told += f" Flights longer than {reach_m:.0f} m were not."
    return MoveAdvice(stretch, found, reach_m, apart_m, found.sentence + told)
