"""Safety bubbles along a path or for a history of poses: ground, sight and navigation joined."""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np
import numpy.typing as npt

import navigation
from planning.paths.sight_maps import exact_lines
from terrain import ElevationGrid
from visibility import (
    Anchor,
    DistantAnchor,
    dop_at_points,
    pack_sets,
    surface_normals,
    visible_sets,
)

from .asked_frame import told_as_asked
from .bubble_question import bubble_sources, check_bubble_question, given_covariances
from .bubble_surroundings import buildings_of, in_sight_past, open_bodies_warning, surroundings
from .finished_bubbles import FinishedBubbles
from .ranging_sources import Source, lines_to
from .schemas.safety_bubbles import BubbleParameters

__all__ = ["calculate_bubbles"]

Array = npt.NDArray[np.float64]
SHARE_OF_SIGHT_LINES = 0.8


@told_as_asked
def calculate_bubbles(
    grid: ElevationGrid, parameters: BubbleParameters, progress: Callable[[float], None] | None = None
) -> FinishedBubbles:
    """The bubbles that are asked for; progress is called with the finished share. Raises as check_bubble_question."""
    started_s = time.perf_counter()
    _, points_m, times_s = check_bubble_question(grid, parameters)
    asked = bubble_sources(grid, parameters)
    buildings = buildings_of(grid, parameters.buildings)
    sources, warnings = asked.all, [*asked.warnings, *open_bodies_warning(buildings)]
    visible, sight = None, None
    if parameters.covariances_m2 is not None:
        covariance_m2 = given_covariances(parameters)
    else:
        share = None if progress is None else lambda done: progress(SHARE_OF_SIGHT_LINES * done)
        sight = lines_to(grid, sources, parameters, share)
        sets = visible_sets(sight, points_m)
        anchors_m = [_position_m(grid, source) for source in sources]
        # between posts a map is not exact, and the lines that plans are judged by are
        seen = exact_lines(sight, points_m)[0] if parameters.mode == "exact" else sets.visible()
        visible = in_sight_past(grid, buildings, points_m, anchors_m, sight.curvature, seen)
        warnings += list(sight.warnings)
        if sets.unknown.any():
            warnings.append(
                f"At {int(sets.unknown.sum())} points it is not known of some anchor whether it is in sight; it counts "
                "as hidden there."
            )
        covariance_m2 = _predicted(grid, parameters, sources, points_m, times_s, visible)
    radius_m = navigation.bubble_radius_m(covariance_m2, parameters.epsilon, dem_sigma_m=parameters.dem_sigma_m)
    around = surroundings(grid, points_m, buildings, inside_is_refused=False)
    check = navigation.check_bubbles(
        points_m,
        radius_m,
        around.distance_m,
        around.nearest_m,
        around.unknown_m,
        under_ground=parameters.under_ground,
    )
    promise = navigation.bubble_confidence(covariance_m2, radius_m - parameters.dem_sigma_m)
    if progress is not None:
        progress(1.0)
    return FinishedBubbles(
        grid,
        sources,
        parameters,
        points_m,
        times_s,
        covariance_m2,
        radius_m,
        promise,
        buildings,
        around,
        check,
        visible,
        sight,
        (*grid.provenance.warnings, *warnings),
        time.perf_counter() - started_s,
    )


def _predicted(
    grid: ElevationGrid,
    parameters: BubbleParameters,
    sources: tuple[Source, ...],
    points_m: Array,
    times_s: Array,
    visible: npt.NDArray[np.bool_],
) -> Array:
    anchors_m = np.array([_position_m(grid, source) for source in sources])
    variance_m2 = np.column_stack([_variance_m2(source, points_m) for source in sources])
    clock = parameters.kind == "pseudorange"
    dilution = None
    if parameters.dop_scaled:
        pdop = dop_at_points(points_m, anchors_m, pack_sets(visible), parameters.kind).pdop
        # no fix is no reason to leave a range out: the filter still learns from it
        dilution = np.where(np.isfinite(pdop), pdop, 1.0)
    motion = parameters.motion
    start = navigation.initial_state(
        0.0,
        points_m[0],
        position_sigma_m=parameters.initial_position_sigma_m,
        velocity_sigma_m_per_s=parameters.initial_velocity_sigma_m_per_s,
        clock_m=(0.0, 0.0) if clock else None,
    )
    slope = None
    if parameters.on_ground:
        normals = surface_normals(grid, points_m[:, 0], points_m[:, 1])
        slope = -normals[:, :2] / normals[:, 2:]
    return navigation.predict_bubble(
        points_m,
        times_s,
        anchors_m,
        visible,
        np.sqrt(variance_m2),
        motion=navigation.MotionNoise(
            motion.horizontal_m2_per_s3, motion.horizontal_m2_per_s3, motion.up_m2_per_s3, motion.clock_m2_per_s3
        ),
        interval_s=parameters.ranging_interval_s,
        clock=clock,
        dop=dilution,
        initial_covariance=start.covariance,
        ground_slope=slope,
        ground_sigma_m=parameters.ground_sigma_m,
    ).position_covariance_m2


def _variance_m2(source: Source, points_m: Array) -> Array:
    """(n,) variance of ranges from each point, with what the anchor's own position adds along the line to it."""
    variance_m2 = np.full(len(points_m), source.ranging_sigma_m**2)
    if isinstance(source, Anchor):
        variance_m2 += source.pose_sigma_m**2
        if source.pose_covariance_m2 is not None:
            lines_m = points_m - (source.east_m, source.north_m, source.altitude_m)
            lines_m /= np.maximum(np.linalg.norm(lines_m, axis=1, keepdims=True), np.finfo(float).tiny)
            variance_m2 += np.einsum("ni,ij,nj->n", lines_m, np.array(source.pose_covariance_m2), lines_m)
    return variance_m2


def _position_m(grid: ElevationGrid, source: Source) -> tuple[float, float, float]:
    if isinstance(source, DistantAnchor):
        return source.position_m(grid)
    return source.east_m, source.north_m, source.altitude_m
