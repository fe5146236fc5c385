"""Safety bubbles along a path over a map: who is in sight where, the filter's covariance, and what is nearest."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np
import numpy.typing as npt

import navigation
from navigation import BubbleError, MotionNoise
from planning.paths.exact_lines import exact_lines
from terrain import ElevationGrid, nearest_surface, told_place
from visibility import (
    Anchor,
    Buildings,
    Curvature,
    DistantAnchor,
    MinimumVisibleAltitude,
    min_visible_altitude,
    visible_sets,
)
from visibility.cover import clear_of_buildings, nearest_building, standing_solids
from visibility.cover.building_distance import solid_bodies
from visibility.dilution import dop_at_points, pack_sets, surface_normals

__all__ = ["BubbleFilter", "PathBubbles", "Surroundings", "bubbles_along", "surroundings", "way_m"]

Array = npt.NDArray[np.float64]
Source = Anchor | DistantAnchor
SHARE_OF_SIGHT_LINES = 0.8


@dataclass(frozen=True, slots=True)
class BubbleFilter:
    """The filter that is foreseen: how unsteadily the vehicle moves, what it knows at first, how often it ranges.

    interval_s: seconds between ranges, None = once at each point. dop_scaled: each variance is multiplied by the PDOP
    of the anchors in sight (De Vivo et al., eq. 26). on_ground: the DEM tells the height, to ground_sigma_m.
    """

    kind: Literal["ranging", "pseudorange"] = "ranging"
    motion: MotionNoise = field(default_factory=MotionNoise)
    position_sigma_m: float = 10.0
    velocity_sigma_m_per_s: float = 1.0
    interval_s: float | None = None
    dop_scaled: bool = False
    on_ground: bool = False
    ground_sigma_m: float = 0.5


@dataclass(frozen=True, eq=False, slots=True)
class Surroundings:
    """For n points: signed distance to the nearest ground or building, negative below or inside, and that place.

    at_building: (n,) whether it is a building's. unknown_m: as in NearestSurface.
    """

    distance_m: Array
    nearest_m: Array
    unknown_m: Array
    at_building: npt.NDArray[np.bool_]

    def words(self) -> list[Literal["ground", "building"]]:
        """What is nearest to each point."""
        return ["building" if building else "ground" for building in self.at_building]


@dataclass(frozen=True, eq=False, slots=True)
class PathBubbles:
    """The answer to ``bubbles_along`` at n points.

    covariance_m2: (n, 3, 3) of the position; radius_m: (n,) of eq. 27. promise: (n,) probability that the bubble, less
    dem_sigma_m, holds the vehicle. check: whether d >= r (eq. 25). visible: (n, k) bool, surely in sight, and sight,
    the map it was read from; both None where covariances were given.
    """

    covariance_m2: Array
    radius_m: Array
    promise: Array
    around: Surroundings
    check: navigation.BubbleCheck
    visible: npt.NDArray[np.bool_] | None
    sight: MinimumVisibleAltitude | None
    warnings: tuple[str, ...]


def bubbles_along(
    grid: ElevationGrid,
    points_m: Array,
    times_s: Array,
    anchors: Sequence[Source] = (),
    *,
    epsilon: float = 3.0,
    dem_sigma_m: float = 0.0,
    filter: BubbleFilter | None = None,
    covariance_m2: Array | None = None,
    buildings: Buildings | None = None,
    under_ground: Literal["refuse", "violated"] = "refuse",
    mode: Literal["fast", "exact"] = "fast",
    curvature: Curvature | None = None,
    unknown: Literal["unknown", "open", "blocked"] = "unknown",
    progress: Callable[[float], None] | None = None,
) -> PathBubbles:
    """How surely a vehicle on a path keeps clear of ground and buildings (De Vivo et al., III).

    points_m: (n, 3) east, north, altitude in the grid's frame; times_s: (n,), never backwards. epsilon: how many sigmas
    the radius is; dem_sigma_m is added. filter: None = the usual one. covariance_m2: (n, 3, 3) of a history of poses:
    nothing is predicted then, and no anchors are needed. buildings: hide anchors, and are to be kept clear of.
    under_ground: whether a point below the ground or in a building is a mistake or a violated bubble.
    mode, curvature, unknown: as in ``visibility.min_visible_altitude``; of an anchor with a radio its signal decides.
    progress: takes the finished share.
    Raises BubbleError, MeasurementError, TimeOrderError, AnchorError, VisibilityInputError.
    """
    # what is wrong with the path shows before the sight lines, which take longest
    around = surroundings(grid, points_m, buildings, inside_is_refused=under_ground == "refuse")
    warnings: list[str] = list(_open_bodies(buildings))
    visible = sight = None
    if covariance_m2 is None:
        share = None if progress is None else lambda done: progress(SHARE_OF_SIGHT_LINES * done)
        sight = min_visible_altitude(grid, tuple(anchors), mode, curvature, unknown=unknown, progress=share)
        anchors_m = np.array([_position_m(grid, anchor) for anchor in anchors])
        if mode == "exact" or any(isinstance(anchor, Anchor) and anchor.radio is not None for anchor in anchors):
            # between posts a map is not exact, and the lines that plans are judged by are
            got = exact_lines(sight, points_m)
            visible, unsure = got.visible, int(np.count_nonzero(got.unknown.any(axis=1)))
        else:
            sets = visible_sets(sight, points_m)
            visible, unsure = sets.visible(), int(np.count_nonzero(sets.unknown))
        if buildings is not None:
            visible = clear_of_buildings(grid, buildings, points_m, anchors_m, sight.curvature, asked=visible)
        warnings += sight.warnings
        if unsure:
            warnings.append(
                f"At {unsure} point{'' if unsure == 1 else 's'} it is not known of some anchor whether it is in sight; "
                "it counts as hidden there."
            )
        covariance_m2 = _predicted(grid, points_m, times_s, anchors, anchors_m, visible, filter or BubbleFilter())
    radius_m = navigation.bubble_radius_m(covariance_m2, epsilon, dem_sigma_m=dem_sigma_m)
    check = navigation.check_bubbles(
        *(points_m, radius_m, around.distance_m, around.nearest_m, around.unknown_m), under_ground=under_ground
    )
    promise = navigation.bubble_confidence(covariance_m2, radius_m - dem_sigma_m)
    if progress is not None:
        progress(1.0)
    return PathBubbles(covariance_m2, radius_m, promise, around, check, visible, sight, tuple(warnings))


def surroundings(
    grid: ElevationGrid, points_m: Array, buildings: Buildings | None = None, *, inside_is_refused: bool = False
) -> Surroundings:
    """Distances to what is nearest; raises BubbleError for a point over no ground or, if refused, in a building."""
    ground = nearest_surface(grid, points_m)
    nowhere = np.isnan(ground.distance_m)
    if nowhere.any():
        first = int(np.argmax(nowhere))
        east_m, north_m, _ = points_m[first]
        what = "lies over unknown ground" if grid.contains(east_m, north_m) else "lies outside the DEM"
        raise BubbleError(f"Point {first} {what}, at {told_place(grid, east_m, north_m, 0.1)}.", index=first)
    if buildings is None and grid.standing is None:
        return Surroundings(
            ground.distance_m, ground.nearest_m, ground.unknown_m, np.zeros(len(points_m), dtype=np.bool_)
        )
    walls = nearest_building(buildings or _solids_of(grid), points_m)
    if buildings is not None and grid.standing is not None:
        others = nearest_building(_solids_of(grid), points_m)
        nearer = others.distance_m < walls.distance_m
        walls = replace(
            walls,
            distance_m=np.where(nearer, others.distance_m, walls.distance_m),
            nearest_m=np.where(nearer[:, None], others.nearest_m, walls.nearest_m),
        )
    inside = walls.distance_m < 0.0
    if inside_is_refused and inside.any():
        first = int(np.argmax(inside))
        raise BubbleError(
            f"Point {first} lies inside a building, {-walls.distance_m[first]:.2f} m from its nearest wall or roof.",
            index=first,
        )
    nearer = walls.distance_m < ground.distance_m
    return Surroundings(
        np.where(nearer, walls.distance_m, ground.distance_m),
        np.where(nearer[:, None], walls.nearest_m, ground.nearest_m),
        ground.unknown_m,
        nearer,
    )


def _solids_of(grid: ElevationGrid) -> Buildings:
    solids = standing_solids(grid)
    assert solids is not None, "asked only where something stands"
    return solids


def way_m(points_m: Array) -> Array:
    """(n,) metres along a path up to each of its points."""
    steps_m = np.linalg.norm(np.diff(points_m, axis=0), axis=1)
    return np.concatenate([[0.0], np.cumsum(steps_m)])


def _predicted(
    grid: ElevationGrid,
    points_m: Array,
    times_s: Array,
    anchors: Sequence[Source],
    anchors_m: Array,
    visible: npt.NDArray[np.bool_],
    foreseen: BubbleFilter,
) -> Array:
    variance_m2 = np.column_stack([_variance_m2(anchor, points_m) for anchor in anchors])
    clock = foreseen.kind == "pseudorange"
    dilution = slope = None
    if foreseen.dop_scaled:
        pdop = dop_at_points(points_m, anchors_m, pack_sets(visible), foreseen.kind).pdop
        # no fix is no reason to leave a range out: the filter still learns from it
        dilution = np.where(np.isfinite(pdop), pdop, 1.0)
    start = navigation.initial_state(
        0.0,
        points_m[0],
        position_sigma_m=foreseen.position_sigma_m,
        velocity_sigma_m_per_s=foreseen.velocity_sigma_m_per_s,
        clock_m=(0.0, 0.0) if clock else None,
    )
    if foreseen.on_ground:
        normals = surface_normals(grid, points_m[:, 0], points_m[:, 1])
        slope = -normals[:, :2] / normals[:, 2:]
    return navigation.predict_bubble(
        points_m,
        times_s,
        anchors_m,
        visible,
        np.sqrt(variance_m2),
        motion=foreseen.motion,
        interval_s=foreseen.interval_s,
        clock=clock,
        dop=dilution,
        initial_covariance=start.covariance,
        ground_slope=slope,
        ground_sigma_m=foreseen.ground_sigma_m,
    ).position_covariance_m2


def _variance_m2(anchor: Source, points_m: Array) -> Array:
    """(n,) variance of ranges from each point, with what the anchor's own position adds along the line to it."""
    variance_m2 = np.full(len(points_m), anchor.ranging_sigma_m**2)
    if isinstance(anchor, Anchor):
        variance_m2 += anchor.pose_sigma_m**2
        if anchor.pose_covariance_m2 is not None:
            lines_m = points_m - (anchor.east_m, anchor.north_m, anchor.altitude_m)
            lines_m /= np.maximum(np.linalg.norm(lines_m, axis=1, keepdims=True), np.finfo(float).tiny)
            variance_m2 += np.einsum("ni,ij,nj->n", lines_m, np.array(anchor.pose_covariance_m2), lines_m)
    return variance_m2


def _position_m(grid: ElevationGrid, anchor: Source) -> tuple[float, float, float]:
    if isinstance(anchor, DistantAnchor):
        return anchor.position_m(grid)
    return anchor.east_m, anchor.north_m, anchor.altitude_m


def _open_bodies(buildings: Buildings | None) -> tuple[str, ...]:
    """A sentence about bodies that have no inside."""
    if buildings is None:
        return ()
    solid = solid_bodies(buildings)
    if solid.all():
        return ()
    return (
        f"{int(np.count_nonzero(~solid))} of {len(solid)} bodies in {buildings.source} are open surfaces: a point "
        "inside one is not told from one outside.",
    )
