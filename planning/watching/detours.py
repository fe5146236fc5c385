"""Another path round a stretch where a rover would hear too few anchors: what ``plan`` finds for it, within a second.

The plan is made on the part of the map that holds the path, the anchors and all lines of sight between: that part is
convex, so ground outside it hides nothing.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from planning.errors import PathProblemError, PlaceError, PlanningError
from planning.paths import PathLimits, PathProblem, PathStatus, PlanBudget, RoverModel, plan_path
from terrain import ElevationGrid
from visibility import Anchor, AnchorError, Curvature
from visibility.signal import min_usable_altitude

from .advice import DarkStretch, Drive

__all__ = ["PathAdvice", "advise_path", "part_around"]

Floats = npt.NDArray[np.float64]

SECONDS = 0.6  # of planning; maps of the anchors come before it
MOST_POSTS = 100_000  # over more ground a plan takes too long for advice
MARGIN_CELLS = 8


@dataclass(frozen=True, slots=True, eq=False)
class PathAdvice:
    """Another way from before a stretch to after it, with enough anchors in sight all along.

    path_m: (n, 2) east, north; None where there is none. from_m, to_m: where on the path it leaves and comes back.
    longer_m: than the path. fewest: anchors in sight where there are fewest. sentence: the same, or why there is none.
    """

    path_m: Floats | None
    from_m: float
    to_m: float
    longer_m: float
    fewest: int | None
    sentence: str


def advise_path(
    grid: ElevationGrid,
    drive: Drive,
    stretch: DarkStretch,
    anchors: Sequence[Anchor],
    at_m: float = 0.0,
    occluded: Collection[str] = (),
    antenna_above_ground_m: float = 1.5,
    curvature: Curvature | None = None,
    seconds: float = SECONDS,
) -> PathAdvice:
    """The way round a stretch that ``plan_path`` finds; none is an answer, with the reason in its sentence.

    at_m: where on the path the rover is, before which no way can leave. occluded: ids that do not count.
    seconds: of planning, at most; a plan that they end says so.
    """
    usable = tuple(anchor for anchor in anchors if anchor.id not in occluded)
    cell_m = max(grid.cell_east_m, grid.cell_north_m)
    # a stretch ends half way to a point that is well; a cell more stands clear of its edge
    from_m, to_m = max(at_m, stretch.from_m - cell_m), min(float(drive.along_m[-1]), stretch.to_m + cell_m)
    ends_m = np.array([_on_path(drive, along_m) for along_m in (from_m, to_m)])
    part = part_around(grid, np.vstack([ends_m, drive.path_m, [(one.east_m, one.north_m) for one in usable] or ends_m]))
    if part.rows * part.cols > MOST_POSTS:
        return PathAdvice(
            None, from_m, to_m, math.nan, None,
            f"No other way was looked for: {part.rows * part.cols:,} posts between path and anchors are more than "
            f"{MOST_POSTS:,}; plan it apart.",
        )  # fmt: skip
    try:
        problem = PathProblem(
            part,
            tuple(ends_m[0].tolist()),
            (tuple(ends_m[1].tolist()),),
            rover=RoverModel(
                receiver_above_ground_m=antenna_above_ground_m,
                max_slope_rad=drive.max_slope_rad,
                speed_m_per_s=drive.speed_m_per_s,
            ),
            limits=PathLimits(min_anchors=drive.min_anchors),
            anchors=usable,
            maps=min_usable_altitude(part, usable, "fast", curvature, only_above_ground_m=antenna_above_ground_m),
            budget=PlanBudget(seconds=seconds, sampling=False),
        )
        found = plan_path(problem)
    except (PlaceError, PathProblemError, AnchorError) as error:
        return PathAdvice(None, from_m, to_m, math.nan, None, f"There is no way round: {error}")
    except PlanningError as error:
        return PathAdvice(None, from_m, to_m, math.nan, None, f"No way round was found: {error}")
    if found.status not in (PathStatus.FOUND, PathStatus.UNREACHABLE):
        return PathAdvice(None, from_m, to_m, math.nan, None, f"No way round was found: {found.sentence}")
    if found.path is None:
        return PathAdvice(None, from_m, to_m, math.nan, None, f"There is no way round: {found.sentence}")
    path_m = np.column_stack([found.path.east_m, found.path.north_m])
    longer_m = float(np.hypot(*np.diff(path_m, axis=0).T).sum()) - (to_m - from_m)
    fewest = int(found.path.anchor_count.min())
    sentence = (
        f"Leave the path at {from_m:.0f} m and come back to it at {to_m:.0f} m: {longer_m:+.0f} m of way, with at "
        f"least {fewest} anchors {problem.counted}."
    )
    return PathAdvice(path_m, from_m, to_m, longer_m, fewest, sentence)


def _on_path(drive: Drive, along_m: float) -> tuple[float, float]:
    east_m, north_m = (float(np.interp(along_m, drive.along_m, drive.path_m[:, axis])) for axis in (0, 1))
    return east_m, north_m


def part_around(grid: ElevationGrid, places_m: Floats) -> ElevationGrid:
    """The part of the grid that holds all of (n, 2) places east, north that are inside it, and some cells more."""
    spans = []
    for posts, count in zip(grid.post_at(places_m[:, 0], places_m[:, 1]), grid.shape, strict=True):
        first, last = math.floor(np.min(posts)) - MARGIN_CELLS, math.ceil(np.max(posts)) + MARGIN_CELLS
        spans += [min(max(first, 0), count - 2), max(min(last, count - 1), 1)]
    return grid.window(*spans)
